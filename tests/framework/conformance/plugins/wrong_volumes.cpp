// SPDX-License-Identifier: Apache-2.0
#include "wrong.hpp"

namespace {

using marrow::Volume;

/// The mean over a voxel and its two neighbours in a row, `times` times.
void blur(Volume& volume, int times) {
  for (int i = 0; i < times; ++i) {
    const std::vector<float> before = volume.values;
    for (std::size_t k = 1; k + 1 < before.size(); ++k)
      volume.values[k] = (before[k - 1] + before[k] + before[k + 1]) / 3;
  }
}

template <wrong::Fault fault>
Volume changed(const Volume& volume) {
  if (!(fault == "careless")) marrow::check_volume(volume, "the CT");
  Volume result = volume;
  if (fault == "another_grid") result.grid.origin_mm.x() += 0.5;
  for (float& value : result.values) {
    if (fault == "brighter") value += 60;
    if (fault == "by_place") value += float(volume.grid.origin_mm.z());
  }
  if (fault == "blurred") blur(result, 60);
  if (fault == "changing") result.values[0] += float(wrong::next_call());
  return result;
}

template <wrong::Fault fault>
Volume filled(const marrow::Mesh& mesh) {
  auto volume = wrong::right<Volume>("volume.filled_surface", "volume", {{"mesh", marrow::node_test::item(mesh)}});
  if (fault == "other_frame") volume.grid.frame = "somewhere";
  if (fault == "larger") volume.grid.spacing_mm *= 1.02;
  if (fault == "shifted") volume.grid.origin_mm.x() += 0.3;
  return volume;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  wrong::declare<"plain_ct", "another_grid", "brighter", "by_place", "blurred", "careless", "changing">(
      plugin, "volume", []<wrong::Fault fault>() { return &changed<fault>; },
      [](auto&& node) { node.in("volume", "CT").out("volume", "the CT"); });
  wrong::declare<"plain_surface", "larger", "shifted", "other_frame">(
      plugin, "volume", []<wrong::Fault fault>() { return &filled<fault>; },
      [](auto&& node) { node.in("mesh", "surface").out("volume", "its inside"); });
  plugin.node("volume.metal", changed<"metal">)
      .summary("For a test of the suite")
      .in("volume", "CT")
      .out("volume", "the CT")
      .trait("removes_metal");
}
