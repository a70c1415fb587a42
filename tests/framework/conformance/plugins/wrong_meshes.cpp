// SPDX-License-Identifier: Apache-2.0
#include "wrong.hpp"

namespace {

using marrow::Mesh;
using marrow::SignedField;

template <wrong::Fault fault>
Mesh polygonise(const SignedField& field) {
  SignedField changed = field;
  if (fault == "fat")
    for (float& value : changed.values_mm) value -= 0.3f;
  if (fault == "unturned") changed.grid.direction.setIdentity();
  Mesh mesh;
  try {
    mesh = wrong::right<Mesh>("mesh.marching_cubes", "mesh", {{"field", marrow::node_test::item(changed)}});
  } catch (const marrow::Error&) {
    while (fault == "endless") std::atomic_signal_fence(std::memory_order_seq_cst);
    throw;
  }
  const bool is_rough = field.grid.count() > 100 && mesh.triangles.size() > field.grid.count();
  if (fault == "open" || (fault == "hasty" && is_rough)) mesh.triangles.pop_back();
  if (fault == "pinched")
    for (auto& triangle : mesh.triangles)
      std::replace(triangle.begin(), triangle.end(), std::uint32_t(mesh.vertices_mm.size() - 1), std::uint32_t(0));
  if (fault == "inward")
    for (auto& triangle : mesh.triangles) std::swap(triangle[0], triangle[1]);
  return mesh;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  wrong::declare<"plain", "inward", "open", "pinched", "hasty", "fat", "unturned", "endless">(
      plugin, "mesh", []<wrong::Fault fault>() { return &polygonise<fault>; },
      [](auto&& node) { node.in("field", "signed distance").out("mesh", "surface"); });
}
