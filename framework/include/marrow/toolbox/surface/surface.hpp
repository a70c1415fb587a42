// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the nodes of this kind share: what they ask of a field, and what they do with a surface once it is there.
#include <algorithm>
#include <cmath>

#include "marrow/domain/mesh.hpp"
#include "marrow/domain/volume.hpp"

namespace marrow::surface {

/// Throws Error for an empty field, missing or non-finite values, or a field with no surface.
void check_field(const marrow::SignedField& field);
/// The two halves of check_field, for those who look at all values anyway.
void check_grid(const marrow::SignedField& field);
void check_values(bool all_finite, bool any_inside, bool any_outside);
/// Throws Error for more vertices than a mesh can index.
void check_vertex_count(std::size_t count);

/// A field beyond whose border lies its mirror image, outside: a surface that reaches the border closes half a sample
/// beyond it. Indices may lie off the grid.
class Padded {
 public:
  explicit Padded(const marrow::SignedField& field) : field_(field) {}
  float operator()(int x, int y, int z) const {
    const auto& size = field_.grid.size;
    if (field_.grid.contains(x, y, z)) return field_.at(x, y, z);
    return std::abs(
        field_.at(std::clamp(x, 0, size[0] - 1), std::clamp(y, 0, size[1] - 1), std::clamp(z, 0, size[2] - 1)));
  }

 private:
  const marrow::SignedField& field_;
};

/// The component that encloses the largest volume (an inner wall encloses a negative one), its vertices in their old
/// order.
marrow::Mesh largest_component(marrow::Mesh mesh);

/// Smooths without shrinking: `iterations` pairs of a smoothing and an inflating step (Taubin, A signal processing
/// approach to fair surface design, SIGGRAPH 1995). Shapes longer than about 2 pi / sqrt(pass_band) edges keep their
/// size. The surface must be closed.
struct Taubin {
  int iterations = 10;
  double lambda = 0.5, pass_band = 0.1;
};
void smooth(marrow::Mesh& mesh, const Taubin& taubin);

/// What each mesher does with its surface at last.
struct Finish {
  bool largest_only = true;
  int smoothing = 0;
};
marrow::Mesh finish(marrow::Mesh mesh, const Finish& options);
constexpr auto kLargestOnlyHelp = "keep only the part that encloses the largest volume; drops specks and inner walls";
constexpr auto kSmoothingHelp = "iterations of Taubin smoothing, which keeps the volume";

}  // namespace marrow::surface
