// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/analytic/functions.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace marrow::analytic {
namespace {

constexpr int kOutlineBlocks = 8, kRadiographBlocks = 4;
constexpr double kPixel_mm = 0.5;

/// The distance from a ray to the nearest ellipsoid, to first order; negative if the ray passes through it.
double ray_to_surface_mm(const Body& body, const Eigen::Vector3d& start_mm, const Eigen::Vector3d& direction) {
  double least = std::numeric_limits<double>::infinity();
  for (const Ellipsoid& e : body) {
    // In units of the radii the ellipsoid is a ball.
    const Eigen::Vector3d from = (e.axes.transpose() * (start_mm - e.centre_mm)).cwiseQuotient(e.radii_mm),
                          along = (e.axes.transpose() * direction).cwiseQuotient(e.radii_mm),
                          nearest = from - along * (from.dot(along) / along.squaredNorm());
    const double distance = nearest.norm(), slope_per_mm = nearest.cwiseQuotient(e.radii_mm).norm();
    least = std::min(least, slope_per_mm > 1e-9 ? (distance - 1) * distance / slope_per_mm : -e.radii_mm.minCoeff());
  }
  return least;
}

/// Every n-th pixel of a radiograph, in both directions.
SeenBody thinned(const SeenBody& whole, int pixel_step) {
  SeenBody view = whole;
  const int step = std::max(1, pixel_step);
  view.grid = {whole.grid.u_px, whole.grid.v_px, step * whole.grid.step_px, (whole.grid.columns + step - 1) / step,
               (whole.grid.rows + step - 1) / step};
  view.radiograph.clear();
  for (int row = 0; row < whole.grid.rows; row += step)
    for (int column = 0; column < whole.grid.columns; column += step)
      view.radiograph.push_back(
          whole.radiograph[std::size_t(row) * std::size_t(whole.grid.columns) + std::size_t(column)]);
  return view;
}

}  // namespace

SeenBody seen(const Body& body, const Camera& camera, const RigidTransform& world_from_model, double spacing_px,
              double step_px) {
  const BodyProjector projector(body);
  SeenBody view{camera, {}, {}, {}};
  for (const OutlinePoint& point : projector.outline(camera, world_from_model, spacing_px))
    view.outline_px.emplace_back(point.u_px, point.v_px);
  view.grid = {0, 0, step_px, int((camera.width_px - 1) / step_px) + 1, int((camera.height_px - 1) / step_px) + 1};
  view.radiograph = projector.radiograph(camera, world_from_model, view.grid);
  return view;
}

OutlineCost::OutlineCost(Body body, std::vector<SeenBody> views, double reach_px)
    : body_(std::move(body)), views_(std::move(views)), reach_mm_(reach_px * kPixel_mm) {}

std::vector<OutlineCost::Sum> OutlineCost::blocks_of(std::size_t view, const RigidTransform& world_from_model) const {
  const SeenBody& seen = views_[view];
  const RigidTransform model_from_camera = inverse(seen.camera.camera_from_world * world_from_model);
  const Eigen::Matrix3d ray_from_pixel = model_from_camera.rotation * seen.camera.intrinsics.inverse();
  std::vector<Sum> blocks(kOutlineBlocks);
  for (std::size_t i = 0; i < seen.outline_px.size(); ++i) {
    const Eigen::Vector3d direction = (ray_from_pixel * seen.outline_px[i].homogeneous()).normalized();
    const double off_mm = ray_to_surface_mm(body_, model_from_camera.translation_mm, direction),
                 squared = off_mm * off_mm;
    Sum& block = blocks[i * kOutlineBlocks / seen.outline_px.size()];
    block.loss += std::isfinite(squared) ? squared / (squared + reach_mm_ * reach_mm_) : 1;
    block.count += 1;
  }
  return blocks;
}

double OutlineCost::value_in_view(std::size_t view, const RigidTransform& world_from_model) const {
  Sum sum;
  for (const Sum& block : blocks_of(view, world_from_model)) sum.loss += block.loss, sum.count += block.count;
  return sum.mean();
}

double OutlineCost::value(const RigidTransform& world_from_model) const {
  double sum = 0;
  for (std::size_t view = 0; view < views_.size(); ++view) sum += value_in_view(view, world_from_model);
  return sum / double(views_.size());
}

std::shared_ptr<const Cost> OutlineCost::at_level(const CostLevel& level) const {
  return std::make_shared<const OutlineCost>(body_, views_, level.reach_px);
}

std::vector<double> OutlineCost::without_each_block(const RigidTransform& world_from_model) const {
  std::vector<std::vector<Sum>> views;
  std::vector<Sum> wholes;
  double all = 0;
  for (std::size_t view = 0; view < views_.size(); ++view) {
    views.push_back(blocks_of(view, world_from_model));
    Sum whole;
    for (const Sum& block : views.back()) whole.loss += block.loss, whole.count += block.count;
    wholes.push_back(whole);
    all += whole.mean();
  }
  std::vector<double> values;
  for (std::size_t view = 0; view < views_.size(); ++view)
    for (const Sum& block : views[view]) {
      const Sum rest{wholes[view].loss - block.loss, wholes[view].count - block.count};
      values.push_back((all - wholes[view].mean() + rest.mean()) / double(views_.size()));
    }
  return values;
}

RadiographCost::RadiographCost(Body body, std::vector<SeenBody> views, int pixel_step)
    : body_(std::move(body)), whole_(std::move(views)) {
  for (const SeenBody& view : whole_) views_.push_back(thinned(view, pixel_step));
}

std::vector<float> RadiographCost::drawn(std::size_t view, const RigidTransform& world_from_model) const {
  return BodyProjector(body_).radiograph(views_[view].camera, world_from_model, views_[view].grid);
}

double RadiographCost::value_without(std::size_t view, const std::vector<float>& drawn, int block) const {
  const std::vector<float>& seen = views_[view].radiograph;
  double count = 0, a = 0, b = 0, aa = 0, bb = 0, ab = 0;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (int(i * kRadiographBlocks / seen.size()) == block) continue;
    const double x = double(seen[i]), y = double(drawn[i]);
    count += 1, a += x, b += y, aa += x * x, bb += y * y, ab += x * y;
  }
  const double spread = std::sqrt(std::max(0.0, aa - a * a / count) * std::max(0.0, bb - b * b / count));
  return spread > 1e-9 ? 1 - (ab - a * b / count) / spread : 1;
}

double RadiographCost::value_in_view(std::size_t view, const RigidTransform& world_from_model) const {
  return value_without(view, drawn(view, world_from_model), -1);
}

double RadiographCost::value(const RigidTransform& world_from_model) const {
  double sum = 0;
  for (std::size_t view = 0; view < views_.size(); ++view) sum += value_in_view(view, world_from_model);
  return sum / double(views_.size());
}

std::shared_ptr<const Cost> RadiographCost::at_level(const CostLevel& level) const {
  return std::make_shared<const RadiographCost>(body_, whole_, level.pixel_step);
}

std::vector<double> RadiographCost::without_each_block(const RigidTransform& world_from_model) const {
  std::vector<std::vector<float>> pictures;
  double all = 0;
  for (std::size_t view = 0; view < views_.size(); ++view) {
    pictures.push_back(drawn(view, world_from_model));
    all += value_without(view, pictures.back(), -1);
  }
  std::vector<double> values;
  for (std::size_t view = 0; view < views_.size(); ++view)
    for (int block = 0; block < kRadiographBlocks; ++block)
      values.push_back((all - value_without(view, pictures[view], -1) + value_without(view, pictures[view], block)) /
                       double(views_.size()));
  return values;
}

MinimisationResult Compass::minimise(const MinimisationProblem& problem) const {
  MinimisationResult result{problem.start, problem.function(problem.start), 1, "steps are below the tolerance"};
  for (double size = 1; size > problem.step_tolerance && result.evaluations < problem.max_evaluations;) {
    bool is_better = false;
    for (Eigen::Index i = 0; i < problem.start.size(); ++i)
      for (const double sense : {1.0, -1.0}) {
        Eigen::VectorXd x = result.x;
        x[i] += sense * size * problem.initial_step[i];
        const double value = problem.function(x);
        ++result.evaluations;
        if (problem.observer) problem.observer(result.evaluations, x, value);
        if (!(value < result.value)) continue;
        result.x = x, result.value = value, is_better = true;
      }
    if (!is_better) size *= 0.5;
  }
  return result;
}

}  // namespace marrow::analytic
