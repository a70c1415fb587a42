// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>

#include "experiment_yaml.hpp"

namespace marrow::compare {

/// Reads the section 'tune': options whose numbers an optimizer chooses on training cases. Names in it can be checked
/// only after the whole file was read.
class TuneReader {
 public:
  explicit TuneReader(StrictYaml& yaml) : yaml_(yaml) {}
  void read(const YamlEntry& section);
  std::vector<Named> names() const { return names_of_options(rule_.options); }
  /// Adds the pipeline as it is, if the experiment has no variant.
  void add_variant(Experiment& experiment) const;
  /// Puts the rule into the experiment if there is one. Its metrics, variants and cases are read before, and `starts`
  /// is the number of its starts.
  void apply(Experiment& experiment, std::size_t starts);

 private:
  void read_optimizer(const YamlEntry& section);
  void check_keys(const YamlEntry& section);
  void find_figure(const Experiment& experiment, TuneRule& rule);
  void find_failed_as(const MetricChoice& metric, TuneRule& rule);
  void check_names(const Experiment& experiment);
  void check_cases(const Experiment& experiment, const TuneRule& rule, std::size_t starts);

  StrictYaml& yaml_;
  bool is_given_ = false, is_good_ = false, has_optimizer_ = false;
  TuneRule rule_;
  Place place_, cases_place_;
  std::optional<Named> figure_, variant_;
  std::optional<double> failed_as_;
  Place failed_as_place_;
};

}  // namespace marrow::compare
