// SPDX-License-Identifier: Apache-2.0
#pragma once
// Runs a network by OpenCV's dnn, tile by tile. The tiles are computed in parallel, each on one thread, and are joined
// in a fixed order: the result is the same at any number of threads.
#include <marrow/domain/camera.hpp>
#include <marrow/runtime/node/context.hpp>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "marrow/toolbox/network/description.hpp"

namespace marrow::network {

/// A network that was read. Safe to use from several threads.
class Network {
 public:
  /// Throws Error if the file is not a model that OpenCV reads, or if the model lacks an output of the description.
  explicit Network(Description description);
  Network(Network&&) noexcept;
  ~Network();

  const Description& description() const;
  /// The maps of an output, one CV_32F of each channel, for an image of any size. `planes` are the channels of the
  /// input: CV_32F, of one size, normalised, in the network's pixels. A map's size is that of the planes divided by the
  /// output's stride, rounded up; the centre of its pixel i is at i * stride + (stride - 1) / 2. The image is continued
  /// by its mirror image. Throws Error if the shapes do not fit or a value is not finite.
  std::vector<cv::Mat> maps(const std::vector<cv::Mat>& planes, const Output& output, const Context& context) const;

 private:
  struct Model;
  std::unique_ptr<Model> model_;
};

/// The network for a node that takes views. Throws Error as read_description() and Network do, or if the network does
/// not take the values of views.
Network read_for_views(const std::filesystem::path& file, const std::string& node);

/// (value - low) / (high - low) by the method, negated first where the network wants bone dark. `counts`: CV_8U, 0
/// where a pixel does not count for the scale; empty: all count. A constant image becomes 0.
cv::Mat normalised(const cv::Mat& values, const cv::Mat& counts, const Input& input);

/// The maps of a view, in its own pixels: resampled to the network's pixels, normalised, computed, and interpolated
/// back. A pixel of pixel_mm is as large at the depth of the bone: object_distance_mm from the source along the
/// central ray, or that of the world's origin where this is 0.
std::vector<cv::Mat> maps_of_view(const Network& network, const Output& output, const View& view,
                                  double object_distance_mm, const Context& context);

/// The maps as the network gives them, and the size of their pixels: pixel (u, v) of a map lies at
/// ((u + 0.5) * step_u_px - 0.5, (v + 0.5) * step_v_px - 0.5) of the view.
struct ViewMaps {
  std::vector<cv::Mat> channels;
  double step_u_px = 1, step_v_px = 1;
};
ViewMaps raw_maps_of_view(const Network& network, const Output& output, const View& view, double object_distance_mm,
                          const Context& context);

}  // namespace marrow::network
