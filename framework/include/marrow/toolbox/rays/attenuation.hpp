// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the rays of a radiograph run through: a volume's attenuation relative to water.
#include <array>
#include <cstdint>
#include <vector>

#include "marrow/plugin.hpp"
#include "marrow/toolbox/rays/large_pages.hpp"

namespace marrow::rays {

/// Which voxels attenuate, and how much.
struct AttenuationOptions {
  double below_hu = -1000;       ///< voxels below attenuate nothing
  double background_hu = -1000;  ///< what attenuates nothing: air, or the tissue that the bone is seen against
  double margin_mm = 1;          ///< voxels further than this outside the field attenuate nothing
};

/// Thousandths of water's attenuation per voxel, x fastest, then y, then z.
struct Attenuation {
  Grid grid;
  std::vector<std::int16_t, LargePages<std::int16_t>> thousandths;
  std::array<int, 3> first{0, 0, 0}, last{-1, -1, -1};  ///< box of what attenuates; last < first where nothing does

  bool is_empty() const { return last[0] < first[0]; }
};

/// Attenuation of a voxel: (HU - background_hu) / 1000, not below 0. With a field, of that fragment alone. Throws Error
/// for a volume or a field that is none, or on another grid.
Attenuation attenuation_of(const Volume& volume, const SignedField* field, const AttenuationOptions& options);

/// Declares the inputs, the output and the options that all projectors of radiographs share.
template <class Options, class Node>
Node& declare(Node&& node) {
  return node.in("volume", "CT")
      .in("field", "signed field of one fragment, to leave all else out")
      .out("projector", "draws the radiograph for any camera and pose")
      .option("below_hu", &Options::below_hu, "voxels below attenuate nothing", unit("HU"))
      .option("background_hu", &Options::background_hu, "what attenuates nothing: air, or the tissue around the bone",
              unit("HU"))
      .option("margin_mm", &Options::margin_mm, "voxels further than this outside the field attenuate nothing",
              at_least(0));
}

}  // namespace marrow::rays
