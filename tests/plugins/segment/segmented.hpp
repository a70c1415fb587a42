// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the segmenters of the kind make of a volume.
#include "tests/harness/node_test.hpp"

namespace marrow::test::segmented {

inline Inputs inputs(const Volume& volume, const List<Seeds>& seeds) {
  return {{"volume", item(volume)}, {"seeds", shipped::list(seeds, "fragment")}};
}

/// The fields that a node gives.
inline List<SignedField> fields(const std::string& node, const Volume& volume, const List<Seeds>& seeds,
                                const Options& options = {}) {
  return output_list<SignedField>(node, "field", inputs(volume, seeds), options);
}

}  // namespace marrow::test::segmented
