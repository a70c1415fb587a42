// SPDX-License-Identifier: Apache-2.0
#include "compare/unchanged.hpp"

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/text_file.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void refuse(const std::string& what) {
  throw Error(what +
              " was changed while the comparison ran: its tables may mix the old with the new; give the same "
              "command again, which runs again what that concerns");
}

/// The folder or the seed of each case, by its name.
std::map<std::string, std::string> cases_of(const compare::Experiment& experiment) {
  std::map<std::string, std::string> cases;
  for (const compare::ExperimentCase& one : experiment.cases)
    cases[one.name] = formatted("{} {}", one.folder.string(), one.seed);
  return cases;
}

/// The first case in which the two experiments differ. Empty if there is none.
std::string difference(const compare::Experiment& before, const compare::Experiment& now) {
  const auto old_cases = cases_of(before), new_cases = cases_of(now);
  for (const auto& one : old_cases)
    if (!new_cases.contains(one.first) || *new_cases.find(one.first) != one)
      return "'" + one.first + "' is another, or gone";
  for (const auto& one : new_cases)
    if (!old_cases.contains(one.first)) return "'" + one.first + "' is new";
  return "";
}

}  // namespace

Unchanged::Unchanged(const compare::Experiment& experiment, Cases cases)
    : experiment_(experiment), cases_(cases), texts_{{experiment.file, experiment.text}} {
  for (const fs::path& file : experiment.files)
    if (file != experiment.file) texts_[file] = read_text_file(file, kMostSourceBytes);
}

void Unchanged::check(const compare::Dependencies& dependencies) const {
  for (const auto& [file, text] : texts_)
    if (read_text_file(file, kMostSourceBytes) != text) refuse(file.string());
  const Catalogue catalogue;
  const std::string change = compare::first_change(dependencies, catalogue);
  if (!change.empty()) refuse(change);
  Diagnostics diagnostics;
  compare::Experiment now = compare::read_experiment(experiment_.file, catalogue, diagnostics, experiment_.more_cases);
  if (!diagnostics.empty()) refuse("what " + experiment_.file.string() + " names (" + diagnostics.text() + ")");
  if (now.tune && cases_ == Cases::held_out) keep_held_out_cases(now);
  if (const std::string other = difference(experiment_, now); !other.empty())
    refuse("the list of cases (" + other + ")");
}

}  // namespace marrow::cli
