// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/distortion/polynomial.hpp"

#include <Eigen/QR>
#include <algorithm>

#include "marrow/domain/quantile.hpp"

namespace marrow::distortion {
namespace {

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

}  // namespace

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
  const Eigen::MatrixXd solution = design.colPivHouseholderQr().solve(right);
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

}  // namespace marrow::distortion
