// SPDX-License-Identifier: Apache-2.0
#include "outline.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "marrow/toolbox/image/line_integrals.hpp"

namespace marrow::shaft {
namespace {

constexpr double kSample_px = 0.125;
constexpr double kReach_mm = 3;                          // length of the profile to either side
constexpr double kInwards_mm = 0.3, kOutwards_mm = 1.2;  // range of positions in which the outline is sought
constexpr double kPiece_mm = 4;                          // a bowed border is followed in pieces of this length
constexpr double kLeastBlur_px = 0.3, kMostBlur_px = 5;

/// How many samples a length has at the shaft. A number that is whole but for rounding is taken as whole, so that a
/// moved world does not change it.
int samples_in(double length_mm, double pixel_mm) { return int(length_mm / pixel_mm / kSample_px + 1e-6); }

/// std::nullopt outside the image, and at dead pixels.
std::optional<double> line_integral_at(const cv::Mat& image, const image::GreyScale& scale, const Eigen::Vector2d& at) {
  const int u = int(std::floor(at.x())), v = int(std::floor(at.y()));
  if (u < 0 || v < 0 || u + 1 >= image.cols || v + 1 >= image.rows) return std::nullopt;
  const auto grey = [&](int row, int column) -> double {
    if (image.depth() == CV_8U) return image.at<uchar>(row, column);
    if (image.depth() == CV_16U) return image.at<std::uint16_t>(row, column);
    return image.at<float>(row, column);
  };
  const double a = at.x() - u, b = at.y() - v;
  const double value =
      (1 - b) * ((1 - a) * grey(v, u) + a * grey(v, u + 1)) + b * ((1 - a) * grey(v + 1, u) + a * grey(v + 1, u + 1));
  if (!(value > 0)) return std::nullopt;
  return scale.line_integral(value);
}

/// Mean distance of the edge pixels from the line for each piece. std::nullopt for a piece with fewer than three.
std::vector<std::optional<double>> distances_of(const EdgeMap& edges, const Border& border, const Support& support,
                                                const Stretch& stretch, int pieces) {
  std::vector<double> sums(static_cast<std::size_t>(pieces));
  std::vector<int> counts(sums.size());
  for (const EdgePixel& edge : edges.pixels) {
    const Eigen::Vector2d position(edge.u_px, edge.v_px);
    const double distance = border.normal.dot(position) - border.rho, s = stretch.along.dot(position);
    if (std::abs(distance) > support.tolerance_px || s < stretch.from || s >= stretch.to) continue;
    if (border.normal.dot(Eigen::Vector2d(edge.direction_u, edge.direction_v)) < support.direction_cosine) continue;
    const auto piece = std::min(sums.size() - 1, std::size_t((s - stretch.from) / stretch.length() * pieces));
    sums[piece] += distance, ++counts[piece];
  }
  std::vector<std::optional<double>> distances;
  for (std::size_t i = 0; i < sums.size(); ++i)
    distances.push_back(counts[i] >= 3 ? std::optional(sums[i] / counts[i]) : std::nullopt);
  return distances;
}

/// Mean line integral at distances of -reach to reach steps from the edges. Rows that leave the image
/// are left out. Empty if fewer than ten rows remain.
std::vector<double> profile_of(const cv::Mat& image, const EdgeMap& edges, const Border& border, const Support& support,
                               const Stretch& stretch, double pixel_mm, int reach) {
  const int pieces = std::max(1, int(stretch.length() * pixel_mm / kPiece_mm));
  const auto distances = distances_of(edges, border, support, stretch, pieces);
  const image::GreyScale scale(image);
  std::vector<double> sums(std::size_t(2 * reach + 1), 0.0);
  int rows = 0;
  for (double s = stretch.from; s < stretch.to; s += 1) {
    const auto& distance =
        distances[std::min(distances.size() - 1, std::size_t((s - stretch.from) / stretch.length() * pieces))];
    if (!distance) continue;
    const Eigen::Vector2d on_line = point_at(border, stretch.along, s);
    std::vector<double> row;
    for (int i = -reach; i <= reach; ++i)
      if (const auto value = line_integral_at(image, scale, on_line + (*distance + i * kSample_px) * border.normal))
        row.push_back(*value);
    if (row.size() != sums.size()) continue;
    for (std::size_t i = 0; i < row.size(); ++i) sums[i] += row[i];
    ++rows;
  }
  for (double& sum : sums) sum /= std::max(1, rows);
  return rows >= 10 ? sums : std::vector<double>();
}

/// The chord of a cylinder at a distance from its outline (negative inside), blurred by a Gaussian.
double blurred_chord(double distance_px, double width_px, double blur_px) {
  constexpr int kHalf = 20;
  double sum = 0, weights = 0;
  for (int i = -kHalf; i <= kHalf; ++i) {
    const double share = 3.5 * i / kHalf, weight = std::exp(-0.5 * share * share);
    const double depth = -(distance_px + share * blur_px);
    weights += weight;
    if (depth > 0) sum += weight * std::sqrt(depth * std::max(0.0, width_px - depth));
  }
  return sum / weights;
}

/// A profile minus its mean and its linear trend.
Eigen::VectorXd without_slope(Eigen::VectorXd profile) {
  const Eigen::VectorXd place = Eigen::VectorXd::LinSpaced(profile.size(), -1, 1);
  profile.array() -= profile.mean();
  profile -= place * (place.dot(profile) / place.squaredNorm());
  return profile;
}

}  // namespace

std::optional<double> outline_beyond_edges_px(const cv::Mat& image, const EdgeMap& edges, const Border& border,
                                              const Support& support, const Stretch& stretch, double width_px,
                                              double pixel_mm) {
  const int reach = std::max(4, samples_in(kReach_mm, pixel_mm));
  const std::vector<double> profile = profile_of(image, edges, border, support, stretch, pixel_mm, reach);
  if (profile.empty()) return std::nullopt;
  const Eigen::VectorXd measured =
      without_slope(Eigen::Map<const Eigen::VectorXd>(profile.data(), Eigen::Index(profile.size())));
  const int inwards = samples_in(kInwards_mm, pixel_mm), outwards = samples_in(kOutwards_mm, pixel_mm);
  double best_gain = 0;
  int best = outwards;
  for (double blur_px = kLeastBlur_px; blur_px < kMostBlur_px; blur_px *= 1.1) {
    std::vector<double> chords;  // at distances of -reach - outwards to reach + inwards steps from the outline
    for (int i = -reach - outwards; i <= reach + inwards; ++i)
      chords.push_back(blurred_chord(i * kSample_px, width_px, blur_px));
    for (int shift = -inwards; shift <= outwards; ++shift) {
      const Eigen::VectorXd chord = without_slope(
          Eigen::Map<const Eigen::VectorXd>(chords.data() + (outwards - shift), Eigen::Index(profile.size())));
      const double along = chord.dot(measured);
      if (along <= 0) continue;
      const double gain = along * along / chord.squaredNorm();
      if (gain > best_gain) best_gain = gain, best = shift;
    }
  }
  if (best == outwards || best == -inwards) return std::nullopt;
  return best * kSample_px;
}

}  // namespace marrow::shaft
