// SPDX-License-Identifier: Apache-2.0
#include "marrow/compare/letters.hpp"

#include <algorithm>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"

namespace marrow::compare {
namespace {

using Group = std::vector<std::size_t>;  // sorted

constexpr std::size_t kLetters = 26;
constexpr std::size_t kMostGroups = 1000;  // before all pairs are looked at; later ones may make fewer of them

bool is_within(const Group& group, const std::vector<Group>& others) {
  return std::any_of(others.begin(), others.end(), [&](const Group& other) {
    return std::includes(other.begin(), other.end(), group.begin(), group.end());
  });
}

/// Divides the groups that hold both of a pair that differs. Those that another group holds are left out.
std::vector<Group> divided(const std::vector<Group>& groups, std::size_t one, std::size_t other) {
  std::vector<Group> kept, parts;
  for (const Group& group : groups) {
    const bool has_both =
        std::binary_search(group.begin(), group.end(), one) && std::binary_search(group.begin(), group.end(), other);
    if (!has_both) {
      kept.push_back(group);
      continue;
    }
    for (const std::size_t without : {one, other}) {
      parts.push_back(group);
      std::erase(parts.back(), without);
    }
  }
  // Larger parts first: a part can only lie within one that is not smaller.
  std::stable_sort(parts.begin(), parts.end(), [](const Group& a, const Group& b) { return a.size() > b.size(); });
  for (Group& part : parts)
    if (!is_within(part, kept)) kept.push_back(std::move(part));
  return kept;
}

}  // namespace

std::optional<std::vector<std::string>> letters_of_groups(
    std::size_t things, const std::vector<std::pair<std::size_t, std::size_t>>& different) {
  Group all(things);
  for (std::size_t i = 0; i < things; ++i) all[i] = i;
  std::vector<Group> groups{all};
  for (const auto& [one, other] : different) {
    if (one >= things || other >= things || one == other)
      throw Error(formatted("the pair {} and {} of {} things cannot differ; give two of them, counted from 0", one,
                            other, things));
    groups = divided(groups, one, other);
    if (groups.size() > kMostGroups) return std::nullopt;
  }
  if (groups.size() > kLetters) return std::nullopt;
  std::sort(groups.begin(), groups.end());
  std::vector<std::string> letters(things);
  for (std::size_t g = 0; g < groups.size(); ++g)
    for (const std::size_t thing : groups[g]) letters[thing] += char('a' + g);
  return letters;
}

}  // namespace marrow::compare
