// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/distortion/distortion.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "catmull_rom.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"

namespace marrow::distortion {
namespace {

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

Eigen::Matrix2d seen_derivative(const Distortion& d, const Eigen::Vector2d& ideal_px) {
  constexpr double kHalf = 0.5;
  Eigen::Matrix2d derivative;
  for (int axis : {0, 1}) {
    const Eigen::Vector2d step = kHalf * Eigen::Vector2d::Unit(axis);
    derivative.col(axis) = (seen_pixel(d, ideal_px + step) - seen_pixel(d, ideal_px - step)) / (2 * kHalf);
  }
  return derivative;
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

}  // namespace marrow::distortion
