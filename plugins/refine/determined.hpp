// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the images tell about a camera, in figures and in words. A motion m of what the camera shows comes from errors p
// of its parameters, m = G p, with p expected to have the covariance D. If the images leave m with the mean M and the
// covariance S, then p has the mean K M and the covariance D - K (G D G^T - S) K^T, with K = D G^T (G D G^T)^-1
// (Gaussian conditioning): errors that show the same motion share it as their variances tell.
#include <algorithm>
#include <array>
#include <cmath>
#include <marrow/domain/decompositions.hpp>
#include <marrow/plugin.hpp>
#include <string>
#include <vector>

#include "sight.hpp"

#include "marrow/base/number_text.hpp"

namespace marrow::refine {

/// A figure of a camera: a motion, or a parameter that may cause one.
struct Figure {
  const char *name, *unit, *words;
};
constexpr std::array<Figure, 9> kFigures{{{"rotation_u", "deg", "rotation about u"},
                                          {"rotation_v", "deg", "rotation about v"},
                                          {"rotation_depth", "deg", "rotation about the depth"},
                                          {"shift_u", "mm", "shift along u"},
                                          {"shift_v", "mm", "shift along v"},
                                          {"shift_depth", "mm", "shift along the depth"},
                                          {"focal", "percent", "focal length"},
                                          {"centre_u", "px", "principal point along u"},
                                          {"centre_v", "px", "principal point along v"}}};
using Numbers = Eigen::Matrix<double, 9, 1>;

inline std::string unit_of(const Figure& figure) { return std::string(figure.unit) == "percent" ? "%" : figure.unit; }

/// The names of the figures, as cameras.cpp declares them.
inline std::vector<std::string> figures() {
  std::vector<std::string> names;
  for (const std::string before : {"", "predicted_"})
    for (const Figure& figure : kFigures) names.push_back(before + figure.name + "_" + figure.unit);
  for (const Figure& figure : kFigures) names.push_back(std::string("determined_") + figure.name);
  return names;
}

/// The first three parameters: focal length and principal point.
struct Parameters {
  Eigen::Vector3d mean, deviation, expected;
};
inline Parameters parameters_of(const Sight& sight, const Vector6d& motion, const Matrix6d& covariance) {
  const Eigen::MatrixXd expected = sight.parameter_deviations.cwiseAbs2().asDiagonal(),
                        crossed = expected * sight.by_parameters.transpose();
  const Matrix6d of_motion = sight.by_parameters * crossed;
  const Eigen::MatrixXd gain = crossed * inverse_of_symmetric(of_motion);
  const Eigen::MatrixXd left = expected - gain * (of_motion - covariance) * gain.transpose();
  return {(gain * motion).head<3>(), left.diagonal().head<3>().cwiseMax(0).cwiseSqrt(),
          sight.parameter_deviations.head<3>()};
}

/// How much of what was expected the images took away: 0 if a number is as uncertain as before, 1 if it is known.
inline Numbers determined(const Numbers& deviation, const Numbers& expected) {
  Numbers share = Numbers::Zero();
  for (Eigen::Index i = 0; i < share.size(); ++i)
    if (expected[i] > 0) share[i] = std::max(0.0, 1 - std::pow(deviation[i] / expected[i], 2));
  return share;
}

inline Metrics metrics_of(const Sight& sight, const Vector6d& motion, const Matrix6d& covariance) {
  const Parameters parameters = parameters_of(sight, motion, covariance);
  Numbers mean, deviation, expected;
  mean << motion, parameters.mean;
  deviation << covariance.diagonal().cwiseSqrt(), parameters.deviation;
  expected << sight.deviation(), parameters.expected;
  const Numbers share = determined(deviation, expected);
  Metrics metrics;
  const std::vector<std::string> names = figures();
  for (std::size_t i = 0; i < kFigures.size(); ++i)
    metrics.items.push_back({names[i], mean[Eigen::Index(i)], unit_of(kFigures[i])});
  for (std::size_t i = 0; i < kFigures.size(); ++i)
    metrics.items.push_back({names[kFigures.size() + i], deviation[Eigen::Index(i)], unit_of(kFigures[i])});
  for (std::size_t i = 0; i < kFigures.size(); ++i)
    metrics.items.push_back({names[2 * kFigures.size() + i], 100 * share[Eigen::Index(i)], "%"});
  return metrics;
}

/// Which of the expected errors the images determine by at least half of their variance, and which they leave open.
inline std::vector<std::string> words_of(const std::string& view, const Sight& sight, const Matrix6d& covariance) {
  const Parameters parameters = parameters_of(sight, Vector6d::Zero(), covariance);
  Numbers deviation, expected;
  deviation << covariance.diagonal().cwiseSqrt(), parameters.deviation;
  expected << sight.deviation(), parameters.expected;
  const Numbers share = determined(deviation, expected);
  std::string known, open;
  for (std::size_t i = 0; i < kFigures.size(); ++i) {
    if (!(expected[Eigen::Index(i)] > 0)) continue;
    std::string& names = share[Eigen::Index(i)] < 0.5 ? open : known;
    names += (names.empty() ? "" : ", ") + std::string(kFigures[i].words) +
             formatted(" ({:.0f} %)", 100 * share[Eigen::Index(i)]);
  }
  std::vector<std::string> lines;
  if (!known.empty()) lines.push_back("view '" + view + "': the images determine its camera's " + known);
  if (!open.empty())
    lines.push_back("view '" + view + "': the images do not determine its camera's " + open +
                    "; what is expected of them counts in the poses' deviations");
  return lines;
}

}  // namespace marrow::refine
