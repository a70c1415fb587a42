// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a view shows of a part that stands out: its silhouette.
#include <opencv2/core/mat.hpp>
#include <vector>

#include "marrow/domain/camera.hpp"

namespace marrow::initial {

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

}  // namespace marrow::initial
