// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>

#include "experiment_yaml.hpp"

namespace marrow::compare {

/// Reads the section 'stop': when a comparison with more and more cases ends. Names in it can be checked only after the
/// whole file was read.
class StopReader {
 public:
  explicit StopReader(StrictYaml& yaml) : yaml_(yaml) {}
  void read(const YamlEntry& section);
  /// Puts the rule into the experiment if there is one. Its metrics, variants and cases are read before, and `starts`
  /// is the number of its starts.
  void apply(Experiment& experiment, std::size_t starts);

 private:
  void check_keys(const YamlEntry& section);
  void find_figure(const Experiment& experiment, StopRule& rule);
  void find_variant(const Experiment& experiment, StopRule& rule);
  void check_cases(const Experiment& experiment, const StopRule& rule, std::size_t starts);

  StrictYaml& yaml_;
  bool is_given_ = false;
  StopRule rule_;
  Place place_, most_place_;
  std::optional<Named> figure_, difference_, variant_, width_, alpha_;
};

}  // namespace marrow::compare
