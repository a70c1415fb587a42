// SPDX-License-Identifier: Apache-2.0
#pragma once
// The outlines of a surface from all sides, and the poses in which it looks like a silhouette that is seen (Jensen et
// al., Joint Track Machine Learning, arXiv 2205.00057).
#include <Eigen/Core>
#include <array>
#include <complex>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "marrow/domain/camera.hpp"
#include "marrow/domain/mesh.hpp"
#include "marrow/runtime/node/context.hpp"

namespace marrow::initial {

// The shape of a closed outline by Fourier descriptors (Zahn and Roskies, IEEE Trans Comput 1972; for implants Banks
// and Hodge, IEEE TMI 1996).

/// Points evenly spaced along the outline as complex numbers, x + i y, are a periodic signal. Its constant term is
/// where the outline lies, the norm of the others is its size, and the others divided by this norm are its shape. A
/// turn of the outline multiplies them by a phase, another starting point by a phase that is proportional to the order.
struct OutlineShape {
  static constexpr int kOrders = 24;  ///< orders -24 to 24 are kept, without 0
  std::complex<double> middle;
  double size = 0;  ///< root mean square distance of the outline from its middle
  std::array<std::complex<double>, 2 * kOrders> terms{};
};

/// The shape of a closed polygon; its last point is joined to the first. Throws Error if it has no length.
OutlineShape outline_shape(const std::vector<Eigen::Vector2d>& polygon);

/// How alike two shapes are in the best turn, over all starting points.
struct Likeness {
  double value = 0;  ///< 1: the same; the mean square distance of the outlines is 2 (1 - value) of their size squared
  double turn_rad = 0;  ///< by which `drawn` is turned (from x to y) to lie on `seen`
};
Likeness likeness(const OutlineShape& seen, const OutlineShape& drawn);

// What a view shows of a part that stands out: its silhouette.

/// A silhouette in an image of its own, about the part and as large as needed.
struct SeenSilhouette {
  Camera camera;         ///< of this image
  cv::Mat1b mask;        ///< 255 where the part is seen
  cv::Mat1f distance;    ///< of each pixel's centre from the border of the mask, in pixels; negative inside
  bool is_whole = true;  ///< the view's own image does not cut it off
};

/// The silhouette in a view whose mask is not 0 where the part is seen. Pieces with less than a twentieth of the
/// largest one's area are left out. The largest one becomes as large as a square of `size_px`, or stays smaller: so a
/// thin one is not lost. Throws Error if the view has no mask, or if nothing or everything is in it; `node` is named in
/// the message.
SeenSilhouette seen_silhouette(const View& view, int size_px, const std::string& node);

/// The outer outline of the largest piece, as rays (x, y, 1) in the camera's frame: for a mask in this camera's image.
std::vector<Eigen::Vector2d> outline_rays(const cv::Mat1b& mask, const Camera& camera);

/// The area that both cover as a part of the area that any of them covers (intersection over union).
double overlap(const cv::Mat1b& one, const cv::Mat1b& other);

class ShapeLibrary {
 public:
  /// Draws the surface from `directions` sides, spread evenly, at the distance at which it is about as large as the
  /// silhouette.
  ShapeLibrary(const Mesh& surface, const SeenSilhouette& about, int directions, Context& context);

  struct Match {
    RigidTransform world_from_model;
    double likeness = 0;
  };
  /// For each side the pose in which the surface looks most like the silhouette, the most likely first. The shape
  /// gives the side and the turn in the image, the size gives the depth, and the middle gives the place.
  std::vector<Match> matches(const SeenSilhouette& seen) const;

 private:
  struct Side {
    Eigen::Matrix3d camera_from_model;
    OutlineShape shape;  ///< of rays about the one to middle_mm_
  };
  const std::string frame_;
  Eigen::Vector3d middle_mm_;
  double distance_mm_ = 0;
  std::vector<Side> sides_;
};

}  // namespace marrow::initial
