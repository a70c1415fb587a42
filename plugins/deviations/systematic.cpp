// SPDX-License-Identifier: Apache-2.0
// Adds to a predicted covariance what the residuals of one frame cannot show, because it is alike all along an outline:
// the edges of an image lie beside the model's outline by an offset that differs from view to view and with the
// direction of the border, and the cameras are a little off.
#include <cmath>
#include <marrow/plugin.hpp>

#include "marrow/deviations/outline_errors.hpp"

namespace {

using namespace marrow;
using deviations::OutlineError, deviations::OutlineRow;

struct Options {
  double offset_px = 0.3;
  double camera_px = 0.5;
  double camera_depth_percent = 0;
};

struct Result {
  Pose pose;
  List<Pose> stages;
};

/// The offset of the edges has a constant part and two that change with the border's direction, as those of upright and
/// level borders differ. A camera shifts and scales the whole image.
std::vector<OutlineError> errors_of(const Options& options) {
  const double of_direction_px = options.offset_px / std::sqrt(2.0);
  const auto cos2 = [](const OutlineRow& r) { return r.normal_u * r.normal_u - r.normal_v * r.normal_v; };
  return {{options.offset_px, [](const OutlineRow&) { return 1.0; }},
          {of_direction_px, cos2},
          {of_direction_px, [](const OutlineRow& r) { return 2 * r.normal_u * r.normal_v; }},
          {options.camera_px, [](const OutlineRow& r) { return r.normal_u; }},
          {options.camera_px, [](const OutlineRow& r) { return r.normal_v; }},
          {0.01 * options.camera_depth_percent,
           [](const OutlineRow& r) { return r.normal_u * r.from_middle_u + r.normal_v * r.from_middle_v; }}};
}

Result systematic(const List<Pose>& stages, const Mesh& model, const OutlineProjector& projector,
                  const List<View>& views, const Options& options, Context& context) {
  if (stages.empty()) throw Error("there is no pose; wire the stages of a registration");
  check_mesh(model, "model");
  const auto errors = [&](std::size_t) { return errors_of(options); };
  Result result;
  for (std::size_t i = 0; i < stages.size(); ++i) {
    check_pose(stages[i], "the pose of stage '" + stages.name(i) + "'");
    Pose pose = stages[i];
    if (pose.covariance && pose.covariance->allFinite()) {
      if (const auto more = deviations::covariance_by_errors(views, projector, pose, errors))
        *pose.covariance += *more;
      else
        context.warn("the outline of stage '" + stages.name(i) +
                     "' does not determine the pose, so its deviations are left as they are");
    }
    result.stages.add(stages.name(i), pose);
  }
  result.pose = result.stages[result.stages.size() - 1];
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("deviations.systematic", systematic)
      .summary(
          "Adds to predicted deviations what all of an outline has in common: an offset between edges and outline that "
          "differs from view to view, and errors of the cameras")
      .in("stages", "poses of a search", over("stage"))
      .in("model", "surface of the bone or implant")
      .in("projector", "draws its outline")
      .in("views", "X-ray views; only their cameras are used", over("view"))
      .out("pose", &Result::pose, "the last pose; a covariance that is absent or not finite stays as it is")
      .out("stages", &Result::stages, "all poses", over("stage"))
      .option(
          "offset_px", &Options::offset_px,
          "standard deviation of the offset of the edges in a view from the offset that all views share, and of its "
          "change with the border's direction",
          at_least(0), at_most(50))
      .option("camera_px", &Options::camera_px,
              "standard deviation of the place of a camera's whole image, along each of its sides: the residual of its "
              "calibration where the bone lies",
              at_least(0), at_most(100))
      .option("camera_depth_percent", &Options::camera_depth_percent,
              "standard deviation of a camera's magnification; in one view it is that of the depth", at_least(0),
              at_most(50), unit("%"));
}
