// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/distortion/distortion.hpp"

#include <tbb/parallel_for.h>
#include <Eigen/LU>
#include <cmath>

#include "marrow/base/number_text.hpp"
#include "marrow/domain/decompositions.hpp"
#include "marrow/domain/quantile.hpp"

namespace marrow::distortion {
namespace {

/// Weights of Catmull and Rom's splines of four nodes, at `t` after the second one. They are those of Keys' cubic
/// convolution with a = -1/2 (IEEE Trans. ASSP 1981), which is exact for parabolas. OpenCV's a = -3/4 moves edges by up
/// to 0.05 pixel.
std::array<double, 4> catmull_rom(double t) {
  return {t * (-0.5 + t * (1 - 0.5 * t)), 1 + t * t * (-2.5 + 1.5 * t), t * (0.5 + t * (2 - 1.5 * t)),
          t * t * (-0.5 + 0.5 * t)};
}

double longer_side(int width_px, int height_px) { return std::max(width_px, height_px); }

/// The displacement by the lattice. Beyond its border, the border's nodes are repeated.
Eigen::Vector2d lattice_at(const Distortion& d, const Eigen::Vector2d& ideal_px) {
  const int columns = lattice_columns(d), rows = lattice_rows(d);
  const Eigen::Vector2d at = (ideal_px / d.step_px).cwiseMax(0).cwiseMin(Eigen::Vector2d(columns - 1, rows - 1));
  const int column = int(at.x()), row = int(at.y());
  const auto across = catmull_rom(at.x() - column), down = catmull_rom(at.y() - row);
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (int j = 0; j < 4; ++j)
    for (int i = 0; i < 4; ++i) {
      const int r = std::clamp(row - 1 + j, 0, rows - 1), c = std::clamp(column - 1 + i, 0, columns - 1);
      sum += down[std::size_t(j)] * across[std::size_t(i)] * d.lattice_px[std::size_t(r * columns + c)];
    }
  return sum;
}

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

bool all_finite(const std::vector<Eigen::Vector2d>& values) {
  return std::all_of(values.begin(), values.end(), [](const Eigen::Vector2d& value) { return value.allFinite(); });
}

void check_sizes(const Distortion& d, const std::string& what) {
  if (d.width_px < 2 || d.height_px < 2 || d.width_px > 65536 || d.height_px > 65536)
    throw Error(formatted("{}: the image has {} x {} pixels; expected 2 to 65536", what, d.width_px, d.height_px));
  if (!d.terms_px.empty() && (d.degree < 0 || d.degree > 9 || d.terms_px.size() != terms_of(d.degree)))
    throw Error(formatted("{}: there are {} terms, but a polynomial of degree {} has {}", what, d.terms_px.size(),
                          d.degree, terms_of(std::clamp(d.degree, 0, 9))));
  if (!d.lattice_px.empty()) {
    if (!(d.step_px >= 1))
      throw Error(formatted("{}: the lattice's step is {} px; expected at least 1", what, d.step_px));
    const std::size_t nodes = std::size_t(lattice_columns(d)) * std::size_t(lattice_rows(d));
    if (d.lattice_px.size() != nodes)
      throw Error(formatted("{}: the lattice has {} nodes, but one with a step of {} px has {} for {} x {} pixels",
                            what, d.lattice_px.size(), d.step_px, nodes, d.width_px, d.height_px));
  }
  if (!all_finite(d.terms_px) || !all_finite(d.lattice_px) || !all_finite(d.area_px))
    throw Error(what + ": a number is not finite");
  if (!d.is_none() && d.area_px.size() < 3)
    throw Error(formatted("{}: the measured area has {} corners; at least 3 are needed", what, d.area_px.size()));
}

/// The values of all terms x^i y^j up to `degree`.
Eigen::VectorXd values_of_terms(int degree, const Eigen::Vector2d& at) {
  Eigen::VectorXd values((degree + 1) * (degree + 2) / 2);
  values[0] = 1;
  for (int sum = 1; sum <= degree; ++sum) {
    const int first = sum * (sum + 1) / 2, before = first - sum;
    for (int j = 0; j < sum; ++j) values[first + j] = at.x() * values[before + j];
    values[first + sum] = at.y() * values[before + sum - 1];
  }
  return values;
}

void check_size(const cv::Mat& image, const Distortion& distortion, const std::string& what) {
  if (image.cols != distortion.width_px || image.rows != distortion.height_px)
    throw Error(
        formatted("{}: the image has {} x {} pixels, but the distortion is of images of {} x {}; measure it on "
                  "images as they are used, neither cropped nor resized",
                  what, image.cols, image.rows, distortion.width_px, distortion.height_px));
}

/// For each pixel of the straight image its place in the original one; (-1, -1) where there is none.
cv::Mat2f places(const Distortion& distortion) {
  cv::Mat2f map(distortion.height_px, distortion.width_px, cv::Vec2f(-1, -1));
  tbb::parallel_for(0, map.rows, [&](int v) {
    for (int u = 0; u < map.cols; ++u) {
      if (!is_measured(distortion, {u, v})) continue;
      const Eigen::Vector2d seen = seen_pixel(distortion, {u, v});
      if (seen.x() >= 0 && seen.y() >= 0 && seen.x() <= map.cols - 1 && seen.y() <= map.rows - 1)
        map(v, u) = {float(seen.x()), float(seen.y())};
    }
  });
  return map;
}

/// Grey value at a place between pixels. Outside the image, the border pixels are repeated.
float sample(const cv::Mat1f& image, const cv::Vec2f& place) {
  const int u = int(place[0]), v = int(place[1]);
  const auto across = catmull_rom(double(place[0]) - u), down = catmull_rom(double(place[1]) - v);
  double sum = 0;
  for (int j = 0; j < 4; ++j) {
    const float* row = image[std::clamp(v - 1 + j, 0, image.rows - 1)];
    for (int i = 0; i < 4; ++i)
      sum += down[std::size_t(j)] * across[std::size_t(i)] * double(row[std::clamp(u - 1 + i, 0, image.cols - 1)]);
  }
  return float(sum);
}

/// The pixel to which a place belongs, or nullptr if there is none.
template <class Mask>
auto* pixel_at(Mask& mask, const cv::Vec2f& place) {
  return place[0] < 0 ? nullptr : &mask(int(std::lround(place[1])), int(std::lround(place[0])));
}

cv::Mat1b mask_at(const cv::Mat2f& map, const cv::Mat1b& original) {
  cv::Mat1b straight(original.size(), std::uint8_t(0));
  for (int v = 0; v < map.rows; ++v)
    for (int u = 0; u < map.cols; ++u)
      if (const std::uint8_t* pixel = pixel_at(original, map(v, u))) straight(v, u) = *pixel;
  return straight;
}

/// The derivative of seen_pixel(), by central differences of half a pixel.
Eigen::Matrix2d seen_derivative(const Distortion& d, const Eigen::Vector2d& ideal_px) {
  constexpr double kHalf = 0.5;
  Eigen::Matrix2d derivative;
  for (int axis : {0, 1}) {
    const Eigen::Vector2d step = kHalf * Eigen::Vector2d::Unit(axis);
    derivative.col(axis) = (seen_pixel(d, ideal_px + step) - seen_pixel(d, ideal_px - step)) / (2 * kHalf);
  }
  return derivative;
}

}  // namespace

double lattice_step_px(int width_px, int height_px) { return std::max(1.0, longer_side(width_px, height_px) / 32); }
int lattice_columns(const Distortion& d) { return int(std::ceil((d.width_px - 1) / d.step_px)) + 1; }
int lattice_rows(const Distortion& d) { return int(std::ceil((d.height_px - 1) / d.step_px)) + 1; }

Eigen::Vector2d seen_pixel(const Distortion& d, const Eigen::Vector2d& ideal_px) {
  Eigen::Vector2d seen = ideal_px;
  if (!d.terms_px.empty()) {
    const double half = 0.5 * longer_side(d.width_px, d.height_px);
    const double x = (ideal_px.x() - 0.5 * (d.width_px - 1)) / half,
                 y = (ideal_px.y() - 0.5 * (d.height_px - 1)) / half;
    // Horner's rule in y for each power of x: terms of x^i y^j lie at terms_of(i + j - 1) + j.
    Eigen::Vector2d in_x = Eigen::Vector2d::Zero();
    for (int i = d.degree; i >= 0; --i) {
      Eigen::Vector2d in_y = Eigen::Vector2d::Zero();
      for (int j = d.degree - i; j >= 0; --j)
        in_y = in_y * y + d.terms_px[(i + j == 0 ? 0 : terms_of(i + j - 1)) + std::size_t(j)];
      in_x = in_x * x + in_y;
    }
    seen += in_x;
  }
  if (!d.lattice_px.empty()) seen += lattice_at(d, ideal_px);
  return seen;
}

std::optional<Eigen::Vector2d> ideal_pixel(const Distortion& d, const Eigen::Vector2d& seen_px) {
  Eigen::Vector2d ideal = seen_px;
  for (int round = 0; round < 30; ++round) {
    const Eigen::Vector2d off = seen_px - seen_pixel(d, ideal);
    if (off.norm() < 1e-9) return is_measured(d, ideal) ? std::optional(ideal) : std::nullopt;
    const Eigen::Matrix2d derivative = seen_derivative(d, ideal);
    if (!(std::abs(derivative.determinant()) > 1e-3)) return std::nullopt;
    ideal += derivative.inverse() * off;
    if (!ideal.allFinite() || ideal.cwiseAbs().maxCoeff() > 1e6) return std::nullopt;
  }
  return std::nullopt;
}

bool is_measured(const Distortion& d, const Eigen::Vector2d& ideal_px) {
  bool is_left = false, is_right = false;
  for (std::size_t i = 0; i < d.area_px.size(); ++i) {
    const Eigen::Vector2d& from = d.area_px[i];
    const double side = cross(d.area_px[(i + 1) % d.area_px.size()] - from, ideal_px - from);
    is_left |= side < 0;
    is_right |= side > 0;
  }
  return !(is_left && is_right);
}

void check_distortion(const Distortion& d, const std::string& what) {
  check_sizes(d, what);
  if (d.is_none()) return;
  constexpr int kSteps = 48;
  for (int row = 0; row <= kSteps; ++row)
    for (int column = 0; column <= kSteps; ++column) {
      const Eigen::Vector2d at(column * (d.width_px - 1.0) / kSteps, row * (d.height_px - 1.0) / kSteps);
      if (!is_measured(d, at)) continue;
      const double growth = seen_derivative(d, at).determinant();
      if (!(growth > 0.25) || !(growth < 4))
        throw Error(formatted(
            "{}: the distortion folds the image, or more than doubles or halves it, at pixel ({:.0f}, {:.0f}); "
            "check that the terms are in pixels, and of x and y from -1 to 1",
            what, at.x(), at.y()));
    }
}

Eigen::Vector2d Polynomial::at(const Eigen::Vector2d& place) const {
  const Eigen::VectorXd values = values_of_terms(degree, (place - middle) / half);
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < terms.size(); ++i) sum += values[Eigen::Index(i)] * terms[i];
  return sum;
}

Eigen::Matrix2d Polynomial::derivative_at(const Eigen::Vector2d& place) const {
  const double step = 1e-4 * half;
  Eigen::Matrix2d derivative;
  for (int axis : {0, 1}) {
    const Eigen::Vector2d aside = step * Eigen::Vector2d::Unit(axis);
    derivative.col(axis) = (at(place + aside) - at(place - aside)) / (2 * step);
  }
  return derivative;
}

Polynomial fit_polynomial(int degree, const Eigen::Vector2d& middle, double half,
                          const std::vector<Eigen::Vector2d>& places, const std::vector<Eigen::Vector2d>& values) {
  Polynomial result{degree, middle, half, {}};
  const Eigen::Index count = Eigen::Index(places.size()), terms = (degree + 1) * (degree + 2) / 2;
  Eigen::MatrixXd design(count, terms), right(count, 2);
  for (Eigen::Index i = 0; i < count; ++i) {
    design.row(i) = values_of_terms(degree, (places[std::size_t(i)] - middle) / half).transpose();
    right.row(i) = values[std::size_t(i)].transpose();
  }
  const Eigen::MatrixXd solution = least_squares(design, right);
  for (Eigen::Index i = 0; i < terms; ++i) result.terms.emplace_back(solution(i, 0), solution(i, 1));
  return result;
}

Polynomial fit_robustly(int degree, const Eigen::Vector2d& middle, double half,
                        const std::vector<Eigen::Vector2d>& places, const std::vector<Eigen::Vector2d>& values,
                        double deviations, std::vector<bool>& is_used) {
  Polynomial fit;
  constexpr int kRounds = 4;
  for (int round = 0; round < kRounds; ++round) {
    std::vector<Eigen::Vector2d> used_places, used_values;
    for (std::size_t i = 0; i < places.size(); ++i)
      if (is_used[i]) {
        used_places.push_back(places[i]);
        used_values.push_back(values[i]);
      }
    fit = fit_polynomial(degree, middle, half, used_places, used_values);
    if (round == kRounds - 1) break;
    std::vector<double> distances, sorted;
    for (std::size_t i = 0; i < places.size(); ++i) {
      distances.push_back((values[i] - fit.at(places[i])).norm());
      if (is_used[i]) sorted.push_back(distances.back());
    }
    // For a normal distribution in two directions, the median length is 1.177 standard deviations.
    const double limit = deviations * std::max(quantile_in_place(sorted, 0.5) / 1.17741, 1e-6);
    std::vector<bool> kept(places.size());
    for (std::size_t i = 0; i < places.size(); ++i) kept[i] = distances[i] <= limit;
    if (std::size_t(std::count(kept.begin(), kept.end(), true)) < fit.terms.size()) break;
    if (kept == is_used) break;
    is_used = kept;
  }
  return fit;
}

std::pair<Eigen::Vector2d, double> square_around(const std::vector<Eigen::Vector2d>& places) {
  Eigen::Vector2d low = places.front(), high = low;
  for (const Eigen::Vector2d& place : places) {
    low = low.cwiseMin(place);
    high = high.cwiseMax(place);
  }
  return {0.5 * (low + high), std::max(0.5 * (high - low).maxCoeff(), 1e-9)};
}

void straighten(View& view, const Distortion& distortion) {
  check_view(view);
  const std::string what = "view '" + view.name + "'";
  check_distortion(distortion, what);
  check_size(view.image.pixels, distortion, what);
  const cv::Mat2f map = places(distortion);
  cv::Mat1f taken, grey(map.size(), 0.f);
  view.image.pixels.convertTo(taken, CV_32F);
  tbb::parallel_for(0, map.rows, [&](int v) {
    for (int u = 0; u < map.cols; ++u)
      if (map(v, u)[0] >= 0) grey(v, u) = sample(taken, map(v, u));
  });
  cv::Mat straight;
  grey.convertTo(straight, view.image.pixels.type());  // rounds and saturates
  const cv::Mat1b mask =
      mask_at(map, view.mask.empty() ? cv::Mat1b(map.size(), std::uint8_t(255)) : cv::Mat1b(view.mask));
  view.image.pixels = straight;
  view.mask = mask;
}

cv::Mat1b straightened_mask(const cv::Mat1b& original, const Distortion& distortion) {
  check_distortion(distortion, "the mask");
  check_size(original, distortion, "the mask");
  return mask_at(places(distortion), original);
}

cv::Mat1b original_mask(const cv::Mat1b& straight, const Distortion& distortion) {
  check_distortion(distortion, "the mask");
  check_size(straight, distortion, "the mask");
  const cv::Mat2f map = places(distortion);
  cv::Mat1b original(straight.size(), std::uint8_t(255)), is_known(straight.size(), std::uint8_t(0));
  // An original pixel is zero if any of the pixels that fall on it is zero.
  for (int v = 0; v < map.rows; ++v)
    for (int u = 0; u < map.cols; ++u) {
      std::uint8_t* pixel = pixel_at(original, map(v, u));
      if (!pixel) continue;
      *pixel_at(is_known, map(v, u)) = 255;
      if (straight(v, u) == 0) *pixel = 0;
    }
  // The original pixels on which none falls get the value of the straight pixel that is nearest to their own place.
  tbb::parallel_for(0, original.rows, [&](int v) {
    for (int u = 0; u < original.cols; ++u) {
      if (is_known(v, u)) continue;
      const auto ideal = ideal_pixel(distortion, {u, v});
      if (!ideal) continue;
      const int column = int(std::lround(ideal->x())), row = int(std::lround(ideal->y()));
      if (column < 0 || row < 0 || column >= straight.cols || row >= straight.rows) continue;
      if (straight(row, column) == 0) original(v, u) = 0;
    }
  });
  return original;
}

}  // namespace marrow::distortion
