// SPDX-License-Identifier: Apache-2.0
#pragma once
// Where the edge of a body of metal appears. Right inside its outline the path through it is short, so a rim of it
// lets radiation pass, and the edge of the image lies inside the outline: the farther, the more slowly the path grows
// there and the less opaque the metal is. So a thin plate that is seen at a slant looks smaller than it is.
#include <opencv2/core/mat.hpp>
#include <vector>

#include "marrow/domain/camera.hpp"
#include "marrow/domain/functions.hpp"
#include "marrow/domain/mesh.hpp"

namespace marrow::deviations {

/// The lengths of the rays' paths through a closed surface, in mm, around its image.
class PathLengths {
 public:
  PathLengths(const Mesh& mesh, const Camera& camera, const RigidTransform& world_from_model);
  /// Bilinear between pixels; 0 outside of the surface's image.
  double at(double u_px, double v_px) const;

 private:
  double u_px_ = 0, v_px_ = 0;  ///< of the first pixel
  cv::Mat1f lengths_mm_;        ///< kPerPixel values a pixel along each side
};

/// How metal and image blur an edge.
struct Rim {
  double opaque_mm;  ///< the path through the metal behind which 1 / e of the radiation arrives
  double blur_px;    ///< standard deviation of the blur by the device and the edge extractor together
};

/// How far inside a point of the outline the image is steepest, in pixels: radiation exp(-path / opaque_mm), blurred,
/// along the point's normal. Between 0 and 8.
double edge_inside_px(const PathLengths& paths, const OutlinePoint& point, const Rim& rim);

}  // namespace marrow::deviations
