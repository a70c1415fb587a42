// SPDX-License-Identifier: Apache-2.0
#pragma once
// The common part of the meshers: checks of the field, and the last steps on the surface.
#include <algorithm>
#include <cmath>
#include <string>

#include "marrow/domain/mesh.hpp"
#include "marrow/domain/volume.hpp"

namespace marrow::surface {

/// Throws Error for an empty field, missing or non-finite values, a grid that is not rigid, or a field without a
/// surface.
void check_field(const marrow::SignedField& field);
/// The two parts of check_field(), for code that visits all values anyway.
void check_grid(const marrow::SignedField& field);
void check_values(bool all_finite, bool any_inside, bool any_outside);
/// Throws Error for more vertices than a mesh can index.
void check_vertex_count(std::size_t count);

/// A field that continues beyond its grid. There it has the absolute value at the nearest border sample, so it is
/// outside. A surface that reaches the border is closed half a sample beyond it. Refers to the field, which must
/// outlive it.
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

/// The component that encloses the largest volume. (An inner wall encloses a negative volume.) Its vertices keep their
/// order.
marrow::Mesh largest_component(marrow::Mesh mesh);

/// Smoothing without shrinking: `iterations` pairs of a smoothing and an inflating step (Taubin, A signal processing
/// approach to fair surface design, SIGGRAPH 1995). Shapes longer than about 2 pi / sqrt(pass_band) edges keep their
/// size. The surface must be closed. lambda and pass_band are above 0, and pass_band is at most 1.
struct Taubin {
  int iterations = 10;
  double lambda = 0.5, pass_band = 0.1;
};
/// Throws Error unless no wave of any surface grows by more than 15 %. `what` names the mesh in the message.
void check_stable(const Taubin& taubin, const std::string& what);
void smooth(marrow::Mesh& mesh, const Taubin& taubin);

/// The last steps of each mesher: keep only the largest component, then smooth.
struct Finish {
  bool largest_only = true;
  int smoothing = 0;
};
marrow::Mesh finish(marrow::Mesh mesh, const Finish& options);
constexpr auto kLargestOnlyHelp = "keep only the part that encloses the largest volume; drops specks and inner walls";
constexpr auto kSmoothingHelp = "iterations of Taubin smoothing, which keeps the volume";

}  // namespace marrow::surface
