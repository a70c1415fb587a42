// SPDX-License-Identifier: Apache-2.0
#include "marrow/initial/outline_shape.hpp"

#include <cmath>

#include "marrow/base/error.hpp"
#include "marrow/domain/transform.hpp"

namespace marrow::initial {
namespace {

constexpr int kPoints = 128;  ///< along an outline
using Complex = std::complex<double>;

/// The roots of unity of the number of points.
const std::array<Complex, kPoints>& roots() {
  static const std::array<Complex, kPoints> all = [] {
    std::array<Complex, kPoints> values;
    for (int i = 0; i < kPoints; ++i)
      values[std::size_t(i)] = {std::cos(2 * kPi * i / kPoints), std::sin(2 * kPi * i / kPoints)};
    return values;
  }();
  return all;
}

/// exp(2 pi i order * at / kPoints).
Complex root(int order, int at) { return roots()[std::size_t(((order * at) % kPoints + kPoints) % kPoints)]; }

/// The order of a term: -kOrders to -1, then 1 to kOrders.
int order_of(int term) {
  return term < OutlineShape::kOrders ? term - OutlineShape::kOrders : term + 1 - OutlineShape::kOrders;
}

/// kPoints points, evenly spaced along the polygon.
std::array<Complex, kPoints> evenly_spaced(const std::vector<Eigen::Vector2d>& polygon) {
  std::vector<double> passed{0};
  for (std::size_t i = 0; i < polygon.size(); ++i)
    passed.push_back(passed.back() + (polygon[(i + 1) % polygon.size()] - polygon[i]).norm());
  if (!(passed.back() > 0) || !std::isfinite(passed.back())) throw Error("an outline has no length");
  std::array<Complex, kPoints> points;
  std::size_t side = 0;
  for (int k = 0; k < kPoints; ++k) {
    const double at = passed.back() * k / kPoints;
    while (side + 1 < polygon.size() && passed[side + 1] <= at) ++side;
    const double length = passed[side + 1] - passed[side];
    const Eigen::Vector2d point = polygon[side] + (length > 0 ? (at - passed[side]) / length : 0) *
                                                      (polygon[(side + 1) % polygon.size()] - polygon[side]);
    points[std::size_t(k)] = {point.x(), point.y()};
  }
  return points;
}

}  // namespace

OutlineShape outline_shape(const std::vector<Eigen::Vector2d>& polygon) {
  const std::array<Complex, kPoints> points = evenly_spaced(polygon);
  OutlineShape shape;
  for (const Complex& point : points) shape.middle += point / double(kPoints);
  double norm = 0;
  for (const Complex& point : points) shape.size += std::norm(point - shape.middle) / kPoints;
  shape.size = std::sqrt(shape.size);
  for (int term = 0; term < 2 * OutlineShape::kOrders; ++term) {
    Complex sum = 0;
    for (int k = 0; k < kPoints; ++k) sum += points[std::size_t(k)] * std::conj(root(order_of(term), k));
    shape.terms[std::size_t(term)] = sum;
    norm += std::norm(sum);
  }
  for (Complex& term : shape.terms) term /= std::sqrt(norm);
  return shape;
}

Likeness likeness(const OutlineShape& seen, const OutlineShape& drawn) {
  std::array<Complex, 2 * OutlineShape::kOrders> products;
  for (std::size_t term = 0; term < products.size(); ++term)
    products[term] = seen.terms[term] * std::conj(drawn.terms[term]);
  Complex best = 0;
  for (int start = 0; start < kPoints; ++start) {
    Complex sum = 0;
    for (int term = 0; term < 2 * OutlineShape::kOrders; ++term)
      sum += products[std::size_t(term)] * root(order_of(term), start);
    if (std::norm(sum) > std::norm(best)) best = sum;
  }
  return {std::abs(best), std::arg(best)};
}

}  // namespace marrow::initial
