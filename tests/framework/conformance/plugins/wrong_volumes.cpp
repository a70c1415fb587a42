// SPDX-License-Identifier: Apache-2.0
// Plain nodes of the kind volume, and others that are wrong in one way each: the suite must catch each of them.
#include <algorithm>
#include <marrow/plugin.hpp>

namespace {

using marrow::Mesh;
using marrow::Volume;

enum class Fault {
  none,
  another_grid,
  brighter,
  by_place,
  blurred,
  careless,
  changing,
  metal,
  larger,
  shifted,
  other_frame
};

/// The mean over a voxel and its two neighbours in a row, `times` times.
void blur(Volume& volume, int times) {
  for (int i = 0; i < times; ++i) {
    const std::vector<float> before = volume.values;
    for (std::size_t k = 1; k + 1 < before.size(); ++k)
      volume.values[k] = (before[k - 1] + before[k] + before[k + 1]) / 3;
  }
}

template <Fault kFault>
Volume changed(const Volume& volume) {
  if (kFault != Fault::careless) marrow::check_volume(volume, "the CT");
  Volume result = volume;
  if (kFault == Fault::another_grid) result.grid.origin_mm.x() += 0.5;
  if (kFault == Fault::brighter)
    for (float& value : result.values) value += 60;
  if (kFault == Fault::by_place)
    for (float& value : result.values) value += float(volume.grid.origin_mm.z());
  if (kFault == Fault::blurred) blur(result, 60);
  if (kFault == Fault::changing) {
    static int calls = 0;
    result.values[0] += float(++calls);
  }
  return result;
}

/// The heights at which a line along z goes through the surface.
std::vector<double> heights_over(const Mesh& mesh, double x, double y) {
  std::vector<double> heights;
  for (const auto& corners : mesh.triangles) {
    const Eigen::Vector3d a = mesh.vertices_mm[corners[0]], b = mesh.vertices_mm[corners[1]] - a,
                          c = mesh.vertices_mm[corners[2]] - a, q = Eigen::Vector3d(x, y, 0) - a;
    const double area = b.x() * c.y() - b.y() * c.x();
    const double u = (q.x() * c.y() - q.y() * c.x()) / area, v = (b.x() * q.y() - b.y() * q.x()) / area;
    if (u >= 0 && v >= 0 && u + v <= 1) heights.push_back(a.z() + u * b.z() + v * c.z());
  }
  return heights;
}

template <Fault kFault>
Volume filled(const Mesh& mesh) {
  marrow::check_closed_surface(mesh, "the surface");
  Eigen::Vector3d low = mesh.vertices_mm[0], high = low;
  for (const Eigen::Vector3d& vertex : mesh.vertices_mm) low = low.cwiseMin(vertex), high = high.cwiseMax(vertex);
  Volume volume;
  volume.grid.frame = kFault == Fault::other_frame ? "somewhere" : mesh.frame;
  volume.grid.spacing_mm.setConstant(0.7);
  volume.grid.origin_mm = low.array() - 1.03;
  for (int k = 0; k < 3; ++k) volume.grid.size[std::size_t(k)] = int((high - low)[k] / 0.7) + 4;
  volume.values.assign(volume.grid.count(), -1000);
  for (int y = 0; y < volume.grid.size[1]; ++y)
    for (int x = 0; x < volume.grid.size[0]; ++x) {
      const Eigen::Vector3d foot = volume.grid.point_from_index({x + 1e-5, y + 1e-5, 0});
      for (const double height : heights_over(mesh, foot.x(), foot.y()))
        for (int z = 0; z < volume.grid.size[2]; ++z)  // inside: an odd number of crossings is above
          if (foot.z() + 0.7 * z < height) {
            float& value = volume.values[volume.grid.offset(x, y, z)];
            value = value < 0 ? 2000.0F : -1000.0F;
          }
    }
  if (kFault == Fault::larger) volume.grid.spacing_mm *= 1.02;
  if (kFault == Fault::shifted) volume.grid.origin_mm.x() += 0.3;
  return volume;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  const auto changes_a_ct = [&](const char* name, auto* function) {
    plugin.node(name, function).summary("For a test of the suite").in("volume", "CT").out("volume", "the CT");
  };
  const auto fills = [&](const char* name, auto* function) {
    plugin.node(name, function).summary("For a test of the suite").in("mesh", "surface").out("volume", "its inside");
  };
  changes_a_ct("volume.plain_ct", changed<Fault::none>);
  changes_a_ct("volume.another_grid", changed<Fault::another_grid>);
  changes_a_ct("volume.brighter", changed<Fault::brighter>);
  changes_a_ct("volume.by_place", changed<Fault::by_place>);
  changes_a_ct("volume.blurred", changed<Fault::blurred>);
  changes_a_ct("volume.careless", changed<Fault::careless>);
  changes_a_ct("volume.changing", changed<Fault::changing>);
  plugin.node("volume.metal", changed<Fault::metal>)
      .summary("For a test of the suite")
      .in("volume", "CT")
      .out("volume", "the CT")
      .trait("removes_metal");
  fills("volume.plain_surface", filled<Fault::none>);
  fills("volume.larger", filled<Fault::larger>);
  fills("volume.shifted", filled<Fault::shifted>);
  fills("volume.other_frame", filled<Fault::other_frame>);
}
