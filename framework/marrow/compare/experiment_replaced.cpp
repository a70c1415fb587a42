// SPDX-License-Identifier: Apache-2.0
// Values that another section of the same file would silently replace.
#include "experiment_sections.hpp"

#include <algorithm>

#include "marrow/base/number_text.hpp"

namespace marrow::compare {
namespace {

/// The options of the displaced node that each start sets.
SetBySection options_of_starts(const StartProtocol& protocol) {
  SetBySection set{"'starts'", {}};
  for (const char* option : {"rotation_deg", "translation_mm"})
    set.names.push_back({protocol.node + "." + option, protocol.place});
  if (protocol.distance_mm > 0) set.names.push_back({protocol.node + ".distance_mm", protocol.place});
  return set;
}

/// Inputs that are given for all cases although each case has its own value. `case_input` is the one that gets the
/// case's folder, or empty.
void refuse_replaced_inputs(StrictYaml& yaml, const std::vector<InputValue>& inputs, const SeededInputs& seeded,
                            const Named& case_input) {
  SetBySection given{"'inputs'", {}}, drawn{"'draw'", {}}, seeds{"'seed_input'", {}};
  for (const InputValue& one : inputs) given.names.push_back({one.name, one.place});
  for (const DrawnInput& one : seeded.drawn) drawn.names.push_back({one.name, one.place});
  for (const auto& [name, place] : seeded.taking_seed) seeds.names.push_back({name, place});
  refuse_replaced(yaml, "the input", given, drawn);
  refuse_replaced(yaml, "the input", given, seeds);
  refuse_replaced(yaml, "the input", drawn, seeds);
  if (!case_input.name.empty()) refuse_replaced(yaml, "the input", given, {"'cases'", {case_input}});
}

}  // namespace

SetBySection options_set_by(const std::string& section, const std::vector<Override>& changes) {
  SetBySection set{section, {}};
  for (const Override& one : changes) set.names.push_back({one.key, one.place});
  return set;
}

void refuse_replaced(StrictYaml& yaml, const std::string& what, const SetBySection& first, const SetBySection& later) {
  for (const Named& one : first.names)
    for (const Named& other : later.names)
      if (one.name == other.name)
        yaml.fault(one.place,
                   formatted("{} '{}' is set by {} and by {} in line {}, whose values would replace this one", what,
                             one.name, first.section, later.section, other.place.line),
                   "leave one of them out");
}

void refuse_replaced_values(StrictYaml& yaml, const Experiment& experiment, std::vector<SetBySection> combined,
                            const SetBySection& tuned) {
  const auto refuse = [&](const SetBySection& first, const SetBySection& later) {
    refuse_replaced(yaml, "the option", first, later);
  };
  if (experiment.protocol) {
    const SetBySection starts = options_of_starts(*experiment.protocol);
    refuse(options_set_by("'set'", experiment.common), starts);
    refuse(tuned, starts);
    combined.push_back(starts);
  }
  for (const Variant& variant : experiment.variants)
    for (const SetBySection& section : combined)
      refuse(options_set_by("variant '" + variant.name + "'", variant.overrides), section);
  for (std::size_t i = 0; i < combined.size(); ++i)
    for (std::size_t k = i + 1; k < combined.size(); ++k) refuse(combined[i], combined[k]);
  const bool has_folders = std::any_of(experiment.cases.begin(), experiment.cases.end(),
                                       [](const auto& one) { return one.is_simulated || !one.folder.empty(); });
  refuse_replaced_inputs(yaml, experiment.inputs, experiment.seeded,
                         {has_folders ? experiment.case_input : "", experiment.cases_place});
  refuse_replaced_inputs(yaml, experiment.simulation.inputs, experiment.simulation.seeded, {});
}

}  // namespace marrow::compare
