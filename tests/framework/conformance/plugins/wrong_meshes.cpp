// SPDX-License-Identifier: Apache-2.0
// A plain mesher, and others that are wrong in one way each: the suite must catch each of them.
#include <algorithm>
#include <cmath>
#include <map>
#include <marrow/plugin.hpp>

namespace {

enum class Fault { none, inward, open, pinched, hasty, fat, unturned, endless };

/// Marching tetrahedra: six in each cell, so that every field gives a closed surface.
class Tetrahedra {
 public:
  explicit Tetrahedra(const marrow::SignedField& field) : field_(field) {}

  marrow::Mesh mesh() {
    static constexpr int kCorners[6][4] = {{0, 1, 3, 7}, {0, 3, 2, 7}, {0, 2, 6, 7},
                                           {0, 6, 4, 7}, {0, 4, 5, 7}, {0, 5, 1, 7}};
    const auto& size = field_.grid.size;
    for (int z = -1; z < size[2]; ++z)
      for (int y = -1; y < size[1]; ++y)
        for (int x = -1; x < size[0]; ++x)
          for (const auto& corners : kCorners) {
            std::array<std::array<int, 3>, 4> at;
            for (int k = 0; k < 4; ++k)
              at[std::size_t(k)] = {x + (corners[k] & 1), y + (corners[k] >> 1 & 1), z + (corners[k] >> 2 & 1)};
            add(at);
          }
    return mesh_;
  }

 private:
  using Corner = std::array<int, 3>;

  double value(const Corner& c) const {
    const double inside =
        field_.at(std::clamp(c[0], 0, field_.grid.size[0] - 1), std::clamp(c[1], 0, field_.grid.size[1] - 1),
                  std::clamp(c[2], 0, field_.grid.size[2] - 1));
    const double value = field_.grid.contains(c[0], c[1], c[2]) ? inside : std::abs(inside);
    return std::abs(value) < 1e-6 ? 1e-6 : value;
  }

  std::uint32_t crossing(Corner a, Corner b) {
    if (b < a) std::swap(a, b);
    const auto [place, added] = vertices_.try_emplace({a, b}, std::uint32_t(mesh_.vertices_mm.size()));
    if (added) {
      const double t = value(a) / (value(a) - value(b));
      const Eigen::Vector3d from(a[0], a[1], a[2]), to(b[0], b[1], b[2]);
      mesh_.vertices_mm.push_back(field_.grid.point_from_index(from + t * (to - from)));
    }
    return place->second;
  }

  /// The triangle, turned so that its normal points from inside to outside.
  void triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c, const Corner& outside) {
    const auto& v = mesh_.vertices_mm;
    const Eigen::Vector3d normal = (v[b] - v[a]).cross(v[c] - v[a]),
                          out = field_.grid.point_from_index(Eigen::Vector3d(outside[0], outside[1], outside[2]));
    if (normal.dot(out - v[a]) < 0) std::swap(b, c);
    mesh_.triangles.push_back({a, b, c});
  }

  void add(const std::array<Corner, 4>& at) {
    std::vector<Corner> in, out;
    for (const Corner& corner : at) (value(corner) < 0 ? in : out).push_back(corner);
    if (in.empty() || out.empty()) return;
    if (in.size() == 2) {
      const std::uint32_t a = crossing(in[0], out[0]), b = crossing(in[0], out[1]), c = crossing(in[1], out[1]),
                          d = crossing(in[1], out[0]);
      triangle(a, b, c, out[0]);
      triangle(a, c, d, out[0]);
    } else {
      const auto& one = in.size() == 1 ? in : out;
      const auto& three = in.size() == 1 ? out : in;
      triangle(crossing(one[0], three[0]), crossing(one[0], three[1]), crossing(one[0], three[2]), out[0]);
    }
  }

  const marrow::SignedField& field_;
  marrow::Mesh mesh_;
  std::map<std::pair<Corner, Corner>, std::uint32_t> vertices_;
};

template <Fault fault>
marrow::Mesh polygonise(const marrow::SignedField& field) {
  if (field.grid.count() == 0 || field.values_mm.size() != field.grid.count())
    throw marrow::Error("the field is empty or not complete");
  for (const float value : field.values_mm)
    if (!std::isfinite(value)) throw marrow::Error("a value of the field is not finite");
  marrow::SignedField changed = field;
  if (fault == Fault::fat)
    for (float& value : changed.values_mm) value -= 0.3f;
  if (fault == Fault::unturned) changed.grid.direction.setIdentity();
  marrow::Mesh mesh = Tetrahedra(changed).mesh();
  if (mesh.triangles.empty()) {
    while (fault == Fault::endless) std::atomic_signal_fence(std::memory_order_seq_cst);
    throw marrow::Error("the field has no surface");
  }
  const bool rough = field.grid.count() > 100 && mesh.triangles.size() > 4 * field.grid.count();
  if (fault == Fault::open || (fault == Fault::hasty && rough)) mesh.triangles.pop_back();
  if (fault == Fault::pinched)
    for (auto& triangle : mesh.triangles)
      std::replace(triangle.begin(), triangle.end(), std::uint32_t(mesh.vertices_mm.size() - 1), std::uint32_t(0));
  if (fault == Fault::inward)
    for (auto& triangle : mesh.triangles) std::swap(triangle[0], triangle[1]);
  mesh.frame = field.grid.frame;
  return mesh;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  const auto add = [&](const char* name, auto* function) {
    plugin.node(name, function)
        .summary("For a test of the suite")
        .in("field", "signed distance")
        .out("mesh", "surface");
  };
  add("mesh.plain", polygonise<Fault::none>);
  add("mesh.inward", polygonise<Fault::inward>);
  add("mesh.open", polygonise<Fault::open>);
  add("mesh.pinched", polygonise<Fault::pinched>);
  add("mesh.hasty", polygonise<Fault::hasty>);
  add("mesh.fat", polygonise<Fault::fat>);
  add("mesh.unturned", polygonise<Fault::unturned>);
  add("mesh.endless", polygonise<Fault::endless>);
}
