// SPDX-License-Identifier: Apache-2.0
#include "compare/doubled_cases.hpp"
#include "marrow/base/number_text.hpp"

namespace marrow::cli {

namespace fs = std::filesystem;

std::string doubled_cases_text(const compare::Experiment& experiment, const compare::CellRunner& runner) {
  std::map<std::string, std::string> first;  // case, by the digest of its content
  std::size_t doubled = 0;
  std::string example;
  for (std::size_t i = 0; i < experiment.cases.size(); ++i) {
    const fs::path place = runner.case_place(i);
    if (place.empty()) continue;
    const auto content = runner.dependencies().contents.find(fs::absolute(place).string());
    if (content == runner.dependencies().contents.end()) continue;
    const auto [known, is_new] = first.emplace(content->second, experiment.cases[i].name);
    if (is_new) continue;
    if (!doubled++) example = "'" + known->second + "' and '" + experiment.cases[i].name + "'";
  }
  if (!doubled) return "";
  return formatted(
      "{}{} the same content as another one, such as {}; each counts as a case of its own, so intervals are too narrow "
      "and p too small: leave the copies out{}",
      doubled, doubled > 1 ? " cases have" : " case has", example,
      experiment.simulation.pipeline.empty() ? "" : ", or let the simulation take the seed (seed_input)");
}

}  // namespace marrow::cli
