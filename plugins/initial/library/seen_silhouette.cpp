// SPDX-License-Identifier: Apache-2.0
#include "marrow/initial/seen_silhouette.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "marrow/base/error.hpp"

namespace marrow::initial {
namespace {

struct Pieces {
  cv::Mat1b mask;    ///< 255 in the pieces that count
  cv::Rect largest;  ///< the box of the largest one
  int area_px = 0;   ///< of the largest one
};

Pieces pieces_of(const cv::Mat1b& mask) {
  constexpr double kLeastPart = 0.05;
  cv::Mat labels, figures, centres;
  const int count = cv::connectedComponentsWithStats(mask != 0, labels, figures, centres, 8, CV_32S);
  const auto area = [&](int piece) { return figures.at<int>(piece, cv::CC_STAT_AREA); };
  int largest = 1;
  for (int piece = 2; piece < count; ++piece)
    if (area(piece) > area(largest)) largest = piece;
  Pieces pieces{cv::Mat1b(mask.size(), std::uint8_t(0)), {}, 0};
  for (int piece = 1; piece < count; ++piece)
    if (area(piece) >= kLeastPart * area(largest)) pieces.mask.setTo(255, labels == piece);
  pieces.largest = {figures.at<int>(largest, cv::CC_STAT_LEFT), figures.at<int>(largest, cv::CC_STAT_TOP),
                    figures.at<int>(largest, cv::CC_STAT_WIDTH), figures.at<int>(largest, cv::CC_STAT_HEIGHT)};
  pieces.area_px = area(largest);
  return pieces;
}

/// The part of an image in a box that may reach beyond it; nothing is seen there.
cv::Mat1b cut_out(const cv::Mat1b& image, const cv::Rect& box) {
  cv::Mat1b result(box.size(), std::uint8_t(0));
  const cv::Rect inside = box & cv::Rect({0, 0}, image.size());
  image(inside).copyTo(result(inside - box.tl()));
  return result;
}

}  // namespace

SeenSilhouette seen_silhouette(const View& view, int size_px, const std::string& node) {
  check_view(view);
  const std::string where = node + ": view '" + view.name + "': ";
  if (view.mask.empty())
    throw Error(where + "it has no mask, so no silhouette; wire a node of the kind mask, such as mask.network with " +
                "leave_out: [background]");
  const int seen_px = cv::countNonZero(view.mask);
  if (seen_px == 0) throw Error(where + "its mask is empty, so the part is not seen; look at the mask's node");
  if (std::size_t(seen_px) == view.mask.total())
    throw Error(where + "its mask is the whole image, which is no silhouette; look at the mask's node");
  const Pieces pieces = pieces_of(view.mask);
  const cv::Rect& box = pieces.largest;
  const int margin = std::max(4, int(0.5 * std::max(box.width, box.height)));
  const cv::Rect around(box.x - margin, box.y - margin, box.width + 2 * margin, box.height + 2 * margin);
  const double scale = std::min(1.0, size_px / std::sqrt(double(pieces.area_px)));
  SeenSilhouette seen;
  seen.is_whole = box.x > 0 && box.y > 0 && box.br().x < view.mask.cols && box.br().y < view.mask.rows;
  const cv::Size size(int(std::lround(scale * around.width)), int(std::lround(scale * around.height)));
  cv::resize(cut_out(pieces.mask, around), seen.mask, size, 0, 0, cv::INTER_AREA);
  seen.mask = seen.mask >= 128;
  seen.camera = view.camera;
  seen.camera.width_px = size.width, seen.camera.height_px = size.height;
  const double by_u = double(size.width) / around.width, by_v = double(size.height) / around.height;
  Eigen::Matrix3d to_own;
  to_own << by_u, 0, by_u * (0.5 - around.x) - 0.5, 0, by_v, by_v * (0.5 - around.y) - 0.5, 0, 0, 1;
  seen.camera.intrinsics = to_own * view.camera.intrinsics;
  cv::Mat1f outside, inside;
  cv::distanceTransform(~seen.mask, outside, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  cv::distanceTransform(seen.mask, inside, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  seen.distance = outside - inside;
  // The border lies between the centres of the pixels on its sides.
  for (float& value : seen.distance) value += value > 0 ? -0.5F : 0.5F;
  return seen;
}

std::vector<Eigen::Vector2d> outline_rays(const cv::Mat1b& mask, const Camera& camera) {
  std::vector<std::vector<cv::Point>> chains;
  cv::findContours(mask, chains, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  std::vector<Eigen::Vector2d> rays;
  if (chains.empty()) return rays;
  const auto largest = std::max_element(chains.begin(), chains.end(), [](const auto& a, const auto& b) {
    return cv::contourArea(a) < cv::contourArea(b);
  });
  const Eigen::Matrix3d ray_from_pixel = camera.intrinsics.inverse();
  for (const cv::Point& pixel : *largest)
    rays.push_back((ray_from_pixel * Eigen::Vector3d(pixel.x, pixel.y, 1)).hnormalized());
  return rays;
}

double overlap(const cv::Mat1b& one, const cv::Mat1b& other) {
  const int any = cv::countNonZero(one | other);
  return any > 0 ? double(cv::countNonZero(one & other)) / any : 0;
}

}  // namespace marrow::initial
