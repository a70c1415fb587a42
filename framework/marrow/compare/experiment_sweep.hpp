// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "experiment_yaml.hpp"

namespace marrow::compare {

/// Reads an option and its range, as  edges.high: [60, 90]  or  {range: [0.7, 2.8], scale: log}. Reports its faults.
SweptOption swept_option_of(StrictYaml& yaml, const YamlEntry& entry);

/// Reads the section 'sweep': options whose numbers are tried over ranges, on a grid or at Sobol's points. Each point
/// becomes one variant, or one for each variant of the file.
class SweepReader {
 public:
  explicit SweepReader(StrictYaml& yaml) : yaml_(yaml) {}
  void read(const YamlEntry& section);
  std::vector<Named> names() const { return names_of_options(options_); }
  /// Puts the swept options into the experiment, and the points into its variants. Call it when these are complete
  /// otherwise.
  void apply(Experiment& experiment);

 private:
  void check(const YamlEntry& section);
  std::vector<std::vector<double>> points() const;

  StrictYaml& yaml_;
  Place place_;
  bool is_good_ = false;
  std::size_t grid_ = 0, sobol_ = 0;
  std::vector<SweptOption> options_;
};

}  // namespace marrow::compare
