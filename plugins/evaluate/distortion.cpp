// SPDX-License-Identifier: Apache-2.0
// Errors of a distortion, compared with points whose places in the straight image are known exactly.
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <marrow/plugin.hpp>

#include "marrow/domain/quantile.hpp"
#include "marrow/toolbox/distortion/distortion.hpp"
#include "marrow/toolbox/geometry/targets.hpp"

namespace {

using namespace marrow;

struct Options {
  std::string up_to = "similarity";
};

using Points = std::vector<Eigen::Vector2d>;

Eigen::Vector2d mean_of(const Points& points) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& point : points) sum += point;
  return sum / double(points.size());
}

/// The linear map of this kind that takes the points, from their mean, nearest to the others, from theirs.
Eigen::Matrix2d best_map(const Points& from, const Points& to, const std::string& kind) {
  if (kind == "shift") return Eigen::Matrix2d::Identity();
  const Eigen::Vector2d from_mean = mean_of(from), to_mean = mean_of(to);
  Eigen::Matrix2d products = Eigen::Matrix2d::Zero(), squares = Eigen::Matrix2d::Zero();
  for (std::size_t i = 0; i < from.size(); ++i) {
    const Eigen::Vector2d a = from[i] - from_mean;
    products += (to[i] - to_mean) * a.transpose();
    squares += a * a.transpose();
  }
  if (kind == "affine") return products * squares.inverse();
  const double cosine = products.trace() / squares.trace(), sine = (products(1, 0) - products(0, 1)) / squares.trace();
  Eigen::Matrix2d similarity;
  similarity << cosine, -sine, sine, cosine;
  return similarity;
}

Metrics distortion_error(const distortion::Distortion& found, const distortion::PlatePoints& truth,
                         const Options& options) {
  if (found.width_px != truth.width_px || found.height_px != truth.height_px)
    throw Error(formatted("the distortion is of images of {} x {} pixels, the true points are of images of {} x {}",
                          found.width_px, found.height_px, truth.width_px, truth.height_px));
  Points straightened, exact, seen;
  for (std::size_t i = 0; i < truth.used.size(); ++i)
    if (const auto ideal = distortion::ideal_pixel(found, truth.seen_px[i])) {
      straightened.push_back(*ideal);
      exact.push_back(truth.ideal_px[i]);
      seen.push_back(truth.seen_px[i]);
    }
  if (straightened.size() < 10)
    throw Error(formatted("{} of {} true points lie in the measured area; at least 10 are needed", straightened.size(),
                          truth.used.size()));
  const auto distances_from = [&](const Points& points) {
    const Eigen::Matrix2d map = best_map(points, exact, options.up_to);
    const Eigen::Vector2d from = mean_of(points), to = mean_of(exact);
    std::vector<double> distances;
    for (std::size_t i = 0; i < points.size(); ++i)
      distances.push_back((exact[i] - to - map * (points[i] - from)).norm());
    return distances;
  };
  std::vector<double> errors = distances_from(straightened);
  const double mean_square = geometry::root_mean_square(errors),
               worst = *std::max_element(errors.begin(), errors.end());
  return {{{"error", mean_square, "px"},
           {"error_99", quantile_in_place(errors, 0.99), "px"},
           {"worst_error", worst, "px"},
           {"uncorrected", geometry::root_mean_square(distances_from(seen)), "px"},
           {"measured_share", 100 * double(straightened.size()) / double(truth.used.size()), "%"},
           {"validated", found.validated_px, "px"}}};
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("evaluate.distortion", distortion_error)
      .summary("Errors of a distortion, compared with points whose places in the straight image are known exactly")
      .in("distortion", "the distortion that was found")
      .in("true_points", "points that it did not see, with their exact places in the straight image")
      .out("metrics",
           "distances of the straightened points from their exact places after the best fit that a plate cannot tell: "
           "root mean square, 99th percentile, worst; the same without correction; share of the points in the measured "
           "area")
      .figures({"error", "error_99", "worst_error", "uncorrected", "measured_share", "validated"})
      .option("up_to", &Options::up_to,
              "what the plate does not tell, and is fitted before: a shift, also turn and size (similarity), also "
              "stretch (affine)",
              one_of({"shift", "similarity", "affine"}));
}
