// SPDX-License-Identifier: Apache-2.0
#include "brightness.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

namespace marrow::shaft {
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

}  // namespace marrow::shaft
