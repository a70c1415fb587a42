// SPDX-License-Identifier: Apache-2.0
// The rows of a comparison for its page, as data.js describes a cell_table.
#include <cstdlib>
#include <unordered_map>

#include "marrow/base/number_text.hpp"
#include "report/cell_material.hpp"

namespace marrow::cli {
namespace {

using compare::CellRow;
using nlohmann::json;

/// Enough digits to tell cells apart; the tables have all of them.
constexpr std::size_t kKeyDigits = 12;

/// With nine digits, like the tables for other programs: half as long as the exact number.
json rounded(const std::optional<double>& value) {
  if (!value) return {};
  return parsed_number(formatted("{:.9g}", *value)).value();
}

/// Texts that many cells share. Each is stored once.
class Texts {
 public:
  json place_of(const std::string& text) {
    if (text.empty()) return {};
    const auto [found, is_new] = places_.try_emplace(text, all_.size());
    if (is_new) all_.push_back(text);
    return found->second;
  }
  const std::vector<std::string>& all() const { return all_; }

 private:
  std::unordered_map<std::string, std::size_t> places_;
  std::vector<std::string> all_;
};

json row_of(const compare::Experiment& experiment, const compare::CellIndex& index, const CellRow& row, Texts& texts) {
  const bool is_done = row.failed.empty();
  int cached = 0;
  for (const auto& [name, calls] : row.nodes) cached += calls.made == 0 && calls.cached > 0;
  json values = {index.variant,
                 index.case_index,
                 index.start,
                 texts.place_of(is_done ? "done" : "failed"),
                 experiment.defines_success() ? json(row.is_success(experiment)) : json(),
                 row.tries,
                 rounded(row.initial_error),
                 rounded(row.seconds),
                 is_done ? json(row.evaluations) : json(),
                 cached,
                 texts.place_of(row.failed),
                 texts.place_of(row.absent),
                 texts.place_of(row.verdict ? name_of(*row.verdict) : ""),
                 row.verdict ? rounded(row.failure_probability) : json(),
                 row.key.empty() ? json() : json(row.key.substr(0, kKeyDigits))};
  for (const auto& value : row.values) values.push_back(is_done ? rounded(value) : json());
  return values;
}

}  // namespace

json cell_table(const compare::Experiment& experiment, const std::vector<CellRow>& rows) {
  const std::size_t starts = experiment.starts.size(), variants = experiment.variants.size();
  Texts texts;
  json table = json::array();
  for (std::size_t i = 0; i < rows.size(); ++i)  // in the order of the cells: by case, by start, by variant
    table.push_back(row_of(experiment, {i % variants, i / variants / starts, i / variants % starts}, rows[i], texts));
  return {{"fields",
           {"variant", "case", "start", "status", "success", "tries", "initial_error", "seconds", "evaluations",
            "cached_nodes", "reason", "absent", "verdict", "failure_probability", "key"}},
          {"rows", std::move(table)},
          {"texts", texts.all()}};
}

}  // namespace marrow::cli
