// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the segmenters of the kind make of a volume.
#include <string>

#include "marrow/domain/list.hpp"
#include "marrow/domain/volume.hpp"
#include "shipped.hpp"

namespace segmented {

inline shipped::Inputs inputs(const marrow::Volume& volume, const marrow::List<marrow::Seeds>& seeds) {
  return {{"volume", shipped::item(volume)}, {"seeds", shipped::list(seeds, "fragment")}};
}

/// The fields that a node gives.
inline marrow::List<marrow::SignedField> fields(const std::string& node, const marrow::Volume& volume,
                                                const marrow::List<marrow::Seeds>& seeds,
                                                const shipped::Options& options = {}) {
  return shipped::call(node, inputs(volume, seeds), options).at("field").as_list<marrow::SignedField>();
}

}  // namespace segmented
