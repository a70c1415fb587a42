// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "experiment_yaml.hpp"

namespace marrow::compare {

/// The options, or the inputs, that a section of an experiment's file sets.
struct SetBySection {
  std::string section;  ///< "variant 'canny'"
  std::vector<Named> names;
};

SetBySection options_set_by(const std::string& section, const std::vector<Override>& changes);
/// Reports each name of `first` that `later` sets too. Its value would have no effect in any cell.
void refuse_replaced(StrictYaml& yaml, const std::string& what, const SetBySection& first, const SetBySection& later);
/// Calls refuse_replaced() for the sections of an experiment, before variants are combined. The sections are applied in
/// this order: 'set', the variants, `combined` ('matrix' and 'sweep'), `tuned`, 'starts'. A variant may change what
/// 'set' says, and only one variant is tuned; so neither is reported here. An input that is given for all cases must
/// not also have a value for each case.
void refuse_replaced_values(StrictYaml& yaml, const Experiment& experiment, std::vector<SetBySection> combined,
                            const SetBySection& tuned);

}  // namespace marrow::compare
