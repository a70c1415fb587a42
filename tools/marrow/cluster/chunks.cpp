// SPDX-License-Identifier: Apache-2.0
// How the cells of a comparison are cut into chunks.
#include <algorithm>
#include <cmath>
#include <utility>

#include "cluster/plan.hpp"

namespace marrow::cli {
namespace {

using Numbers = std::vector<std::size_t>;

std::vector<Numbers> by_case(const Numbers& numbers, std::size_t cells_of_a_case) {
  std::vector<Numbers> cases;
  std::size_t last = 0;
  for (const std::size_t number : numbers) {
    const std::size_t of_case = number / cells_of_a_case;
    if (cases.empty() || of_case != last) cases.emplace_back();
    last = of_case;
    cases.back().push_back(number);
  }
  return cases;
}

/// Pieces of about equal length, none shorter than `least`.
void add_pieces(const Numbers& numbers, std::size_t least, std::vector<Numbers>& chunks) {
  const std::size_t pieces = std::max<std::size_t>(1, numbers.size() / least);
  for (std::size_t i = 0; i < pieces; ++i)
    chunks.emplace_back(numbers.begin() + std::ptrdiff_t(i * numbers.size() / pieces),
                        numbers.begin() + std::ptrdiff_t((i + 1) * numbers.size() / pieces));
}

std::vector<Numbers> cut_cases(const std::vector<Numbers>& cases, std::size_t least) {
  std::vector<Numbers> chunks;
  Numbers open;
  for (const Numbers& one : cases) {
    if (open.empty() && one.size() >= 2 * least) {
      add_pieces(one, least, chunks);
      continue;
    }
    open.insert(open.end(), one.begin(), one.end());
    if (open.size() >= least) chunks.push_back(std::exchange(open, {}));
  }
  if (!open.empty()) chunks.push_back(std::move(open));
  return chunks;
}

}  // namespace

std::vector<Numbers> cut_into_chunks(const Numbers& numbers, std::size_t cells_of_a_case, double seconds_of_a_cell,
                                     const ChunkRule& rule) {
  const double wanted = seconds_of_a_cell > 0 ? std::ceil(60 * rule.least_minutes / seconds_of_a_cell) : 1;
  std::size_t least = std::size_t(std::clamp(wanted, 1., double(std::max<std::size_t>(1, numbers.size()))));
  if (!(seconds_of_a_cell > 0)) least = std::max<std::size_t>(1, cells_of_a_case);
  const std::vector<Numbers> cases = by_case(numbers, cells_of_a_case);
  std::vector<Numbers> chunks = cut_cases(cases, least);
  while (chunks.size() > rule.most_tasks) chunks = cut_cases(cases, least = least + least / 4 + 1);
  return chunks;
}

}  // namespace marrow::cli
