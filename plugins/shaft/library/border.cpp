// SPDX-License-Identifier: Apache-2.0
#include "marrow/shaft/border.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <tuple>
#include "marrow/domain/decompositions.hpp"
#include "marrow/toolbox/image/grey_values.hpp"

namespace marrow::shaft {
namespace {

/// Calls function(position, distance from the line) for the edge pixels that support a border.
template <class Function>
void for_support(const EdgeMap& edges, const Border& border, const Support& support, Function function) {
  for (const EdgePixel& edge : edges.pixels) {
    const Eigen::Vector2d position(edge.u_px, edge.v_px);
    const double distance = border.normal.dot(position) - border.rho;
    if (std::abs(distance) > support.tolerance_px) continue;
    if (border.normal.dot(Eigen::Vector2d(edge.direction_u, edge.direction_v)) < support.direction_cosine) continue;
    function(position, distance);
  }
}

}  // namespace

Eigen::Vector2d point_at(const Border& border, const Eigen::Vector2d& along, double s) {
  Eigen::Matrix2d rows;
  rows << border.normal.transpose(), along.transpose();
  return rows.inverse() * Eigen::Vector2d(border.rho, s);
}

std::vector<double> supported_positions(const EdgeMap& edges, const Border& border, const Support& support,
                                        const Eigen::Vector2d& along) {
  std::vector<double> positions;
  for_support(edges, border, support,
              [&](const Eigen::Vector2d& position, double) { positions.push_back(along.dot(position)); });
  std::sort(positions.begin(), positions.end());
  return positions;
}

std::pair<double, double> longest_run(const std::vector<double>& positions, double gap_px) {
  std::pair<double, double> best{0, 0};
  std::size_t most = 0;
  for (std::size_t from = 0, to = 0; from < positions.size(); from = to) {
    for (to = from + 1; to < positions.size() && positions[to] - positions[to - 1] <= gap_px;) ++to;
    if (to - from > most) most = to - from, best = {positions[from], positions[to - 1]};
  }
  return best;
}

Border refit(const EdgeMap& edges, Border border, const Support& support, const Stretch& stretch, int weighted) {
  for (int round = 0; round <= weighted; ++round) {
    double sum = 0;
    int count = 0;
    Eigen::Vector2d first = Eigen::Vector2d::Zero();
    Eigen::Matrix2d second = Eigen::Matrix2d::Zero();
    for_support(edges, border, support, [&](const Eigen::Vector2d& position, double distance) {
      const double s = stretch.along.dot(position), share = distance / support.tolerance_px;
      if (s < stretch.from || s > stretch.to) return;
      const double weight = round < weighted ? (1 - share * share) * (1 - share * share) : 1.0;
      sum += weight, ++count;
      first += weight * position;
      second += weight * position * position.transpose();
    });
    border.pixels = count;
    if (count < 10 || !(sum > 0)) return border.pixels = 0, border;
    const Eigen::Vector2d centre = first / sum;
    const SymmetricEigen<2> eigen = eigen_of_symmetric<2>(second / sum - centre * centre.transpose());
    const Eigen::Vector2d normal = eigen.vectors.col(0);  // the direction of least spread
    border.normal = normal.dot(border.normal) < 0 ? Eigen::Vector2d(-normal) : normal;
    border.rho = border.normal.dot(centre);
    border.spread_px = std::sqrt(std::max(0.0, eigen.values[0]));
  }
  return border;
}

Stretch common_stretch(const EdgeMap& edges, const Border& one, const Border& other, const Support& support,
                       const Eigen::Vector2d& along, double gap_px, int& supported) {
  const auto whole_positions = [&](const Border& border) {
    std::vector<double> positions = supported_positions(edges, border, support, along);
    for (double& s : positions) s = std::round(s);
    positions.erase(std::unique(positions.begin(), positions.end()), positions.end());
    return positions;
  };
  const std::vector<double> at_one = whole_positions(one), at_other = whole_positions(other);
  std::vector<double> both;
  std::set_intersection(at_one.begin(), at_one.end(), at_other.begin(), at_other.end(), std::back_inserter(both));
  Stretch stretch;
  stretch.along = along;
  std::tie(stretch.from, stretch.to) = longest_run(both, gap_px);
  supported =
      int(std::count_if(both.begin(), both.end(), [&](double s) { return s >= stretch.from && s <= stretch.to; }));
  return stretch;
}

Stretch stretch_at_outline(const EdgeMap& edges, const Border& one, const Border& other, const Support& support,
                           const Stretch& stretch, double reach_px, double gap_px) {
  const int count = std::max(1, int(std::ceil(stretch.length())));
  std::vector<char> inside(std::size_t(count), 0);
  for (const Border* border : {&one, &other})
    for (const EdgePixel& edge : edges.pixels) {
      const Eigen::Vector2d position(edge.u_px, edge.v_px);
      const double distance = border->normal.dot(position) - border->rho,
                   s = stretch.along.dot(position) - stretch.from;
      if (distance < 1.5 * support.tolerance_px || distance > reach_px || s < 0 || s >= count) continue;
      if (border->normal.dot(Eigen::Vector2d(edge.direction_u, edge.direction_v)) < support.direction_cosine) continue;
      for (int i = std::max(0, int(s) - 1); i <= std::min(count - 1, int(s) + 1); ++i) inside[std::size_t(i)] = 1;
    }
  std::vector<double> positions;
  for (int i = 0; i < count; ++i)
    if (!inside[std::size_t(i)]) positions.push_back(std::min(stretch.to, stretch.from + i));
  Stretch part = stretch;
  std::tie(part.from, part.to) = longest_run(positions, gap_px);
  return part;
}

namespace {

constexpr double kLeastStep = 0.3;            // part of the step of this image's bone
constexpr double kAlong_mm = 1, kSmooth = 2;  // steps are measured every mm, as means over 2 mm to either side
constexpr std::array<double, 4> kAcross_mm{0.7, 1.4, 2.1, 2.8};

std::optional<double> grey_at(const cv::Mat& image, const Eigen::Vector2d& at) {
  const cv::Point pixel(int(std::lround(at.x())), int(std::lround(at.y())));
  if (pixel.x < 0 || pixel.y < 0 || pixel.x >= image.cols || pixel.y >= image.rows) return std::nullopt;
  if (image.depth() == CV_8U) return image.at<uchar>(pixel);
  if (image.depth() == CV_16U) return image.at<std::uint16_t>(pixel);
  return image.at<float>(pixel);
}

/// Sum and count of grey values.
struct Sum {
  double grey = 0;
  int count = 0;
  void add(const std::optional<double>& value) {
    if (value) grey += *value, ++count;
  }
  double mean() const { return count ? grey / count : std::numeric_limits<double>::infinity(); }
};

/// The steps (outside - inside) / (outside + inside) of a border at positions along the stretch. They are between -1
/// and 1; a small step is half the step of attenuation. Beyond the end of the image the step is taken as 1.
std::vector<double> steps_of(const cv::Mat& image, const Border& border, const Stretch& stretch, double pixel_mm,
                             int count) {
  std::vector<Sum> inside(static_cast<std::size_t>(count)), outside(inside.size());
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector2d at = point_at(border, stretch.along, stretch.from + (i + 0.5) / count * stretch.length());
    for (const double distance_mm : kAcross_mm) {
      inside[std::size_t(i)].add(grey_at(image, at - distance_mm / pixel_mm * border.normal));
      outside[std::size_t(i)].add(grey_at(image, at + distance_mm / pixel_mm * border.normal));
    }
  }
  std::vector<double> steps;
  for (int i = 0; i < count; ++i) {
    Sum in, out;
    for (int k = std::max(0, i - int(kSmooth)); k <= std::min(count - 1, i + int(kSmooth)); ++k) {
      in.grey += inside[std::size_t(k)].grey, in.count += inside[std::size_t(k)].count;
      out.grey += outside[std::size_t(k)].grey, out.count += outside[std::size_t(k)].count;
    }
    const double sum = in.mean() + out.mean();
    steps.push_back(!in.count || !out.count ? 1.0 : sum > 0 ? (out.mean() - in.mean()) / sum : 0.0);
  }
  return steps;
}

int pieces_of(const Stretch& stretch, double pixel_mm) {
  return std::clamp(int(stretch.length() * pixel_mm / kAlong_mm), 8, 400);
}

}  // namespace

Brightness brightness_of(const cv::Mat& image, const Border& left, const Border& right, const Stretch& stretch,
                         double pixel_mm) {
  const auto mean_between = [&](auto from_at, auto to_at) {
    constexpr int kAlong = 24, kAcross = 12;
    Sum sum;
    for (int i = 0; i < kAlong; ++i) {
      const double s = stretch.from + (i + 0.5) / kAlong * stretch.length();
      const Eigen::Vector2d from = from_at(s), to = to_at(s);
      for (int k = 0; k < kAcross; ++k) sum.add(grey_at(image, from + (k + 0.5) / kAcross * (to - from)));
    }
    return sum.mean();
  };
  const auto beside = [&](const Border& border, double distance_mm) {
    return [&stretch, &border, shift = distance_mm / pixel_mm](double s) -> Eigen::Vector2d {
      return point_at(border, stretch.along, s) + shift * border.normal;
    };
  };
  return {mean_between(beside(left, 0), beside(right, 0)), mean_between(beside(left, 1), beside(left, 4)),
          mean_between(beside(right, 1), beside(right, 4))};
}

double step_of(const cv::Mat& image, const Border& left, const Border& right, const Stretch& stretch, double pixel_mm) {
  const int count = pieces_of(stretch, pixel_mm);
  const auto mean = [&](const Border& border) {
    const std::vector<double> steps = steps_of(image, border, stretch, pixel_mm, count);
    return std::max(0.0, std::accumulate(steps.begin(), steps.end(), 0.0) / count);
  };
  return std::sqrt(mean(left) * mean(right));
}

Stretch stretch_with_steps(const cv::Mat& image, const Border& left, const Border& right, const Stretch& stretch,
                           double bone_step, double pixel_mm, double gap_px) {
  const int count = pieces_of(stretch, pixel_mm);
  const std::vector<double> at_left = steps_of(image, left, stretch, pixel_mm, count),
                            at_right = steps_of(image, right, stretch, pixel_mm, count);
  std::vector<double> positions;
  for (std::size_t i = 0; i < at_left.size(); ++i)
    if (bone_step > 0 && std::min(at_left[i], at_right[i]) >= kLeastStep * bone_step)
      positions.push_back(stretch.from + (double(i) + 0.5) / count * stretch.length());
  Stretch part = stretch;
  std::tie(part.from, part.to) = longest_run(positions, gap_px + stretch.length() / count);
  if (part.to > part.from) {  // positions are the centres of pieces
    part.from -= 0.5 * stretch.length() / count;
    part.to += 0.5 * stretch.length() / count;
  }
  return part;
}

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
