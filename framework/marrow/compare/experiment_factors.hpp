// SPDX-License-Identifier: Apache-2.0
#pragma once
// What 'matrix' and 'compare_all' say of the variants.
#include <vector>

#include "experiment_yaml.hpp"

namespace marrow::compare {

/// Names the experiment's factors and gives each variant that the matrix made its levels. `columns` are those of the
/// matrix, each with its values. `combined` has the experiment's own variants, or one without a name, in all
/// combinations: the last column changes fastest.
void set_factors(Experiment& experiment, const std::vector<std::vector<Override>>& columns,
                 std::vector<Variant>& combined);

void read_compare_all(StrictYaml& yaml, const YamlEntry& entry, Experiment& experiment);
/// Reports a fault if all pairs are too many. The variants and figures are known.
void check_compare_all(StrictYaml& yaml, const Experiment& experiment);

}  // namespace marrow::compare
