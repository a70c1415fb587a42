// SPDX-License-Identifier: Apache-2.0
// Adds to a predicted covariance what the residuals of one frame cannot show, because it is alike all along an outline:
// the edges of an image lie beside the model's outline by an offset that differs from view to view and with the
// direction of the border, they lie inside where metal is thin, the model's surface is a little off, and so are the
// cameras.
#include <cmath>

#include "marrow/deviations/outline_errors.hpp"
#include "metal_rims.hpp"

namespace {

using namespace marrow;
using deviations::OutlineError, deviations::OutlineFit, deviations::OutlineRow;

struct Options {
  double offset_px = 0.3;
  double camera_px = 0.5;
  double camera_depth_percent = 0;
  double surface_mm = 0;
  double surface_reach_mm = 10;
  double opaque_mm = 0;
  double blur_px = 2;
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

/// The covariance of the pose that errors of the surface make. They belong to the bone, so all views see the same ones,
/// and they are alike where points are near each other: a Gaussian process over the surface (Rasmussen and Williams
/// 2006) with the squared exponential kernel.
Matrix6d covariance_of_surface(const OutlineFit& fit, const Options& options) {
  std::vector<const OutlineRow*> rows;
  std::vector<Vector6d> motions;
  for (std::size_t view = 0; view < fit.rows().size(); ++view)
    for (std::size_t i = 0; i < fit.rows()[view].size(); ++i) {
      const OutlineRow& row = fit.rows()[view][i];
      rows.push_back(&row);
      motions.push_back(fit.motions(view).col(Eigen::Index(i)) * row.by_camera_px_per_mm.norm());
    }
  Matrix6d covariance = Matrix6d::Zero();
  for (std::size_t i = 0; i < rows.size(); ++i) {
    Vector6d alike = Vector6d::Zero();
    for (std::size_t j = 0; j < rows.size(); ++j) {
      const float apart_mm = (rows[i]->point.model_mm - rows[j]->point.model_mm).norm();
      alike += std::exp(-0.5 * std::pow(double(apart_mm) / options.surface_reach_mm, 2)) * motions[j];
    }
    covariance += motions[i] * alike.transpose();
  }
  return options.surface_mm * options.surface_mm * 0.5 * (covariance + covariance.transpose());
}

/// Where the metal's opacity is unknown, its rims may be anything from opaque to as thin as given, in all views alike.
Matrix6d covariance_of_rims(const OutlineFit& fit, const List<View>& views, const Mesh& model, const Pose& pose,
                            const Options& options) {
  Vector6d moved = Vector6d::Zero();
  for (std::size_t view = 0; view < views.size(); ++view) {
    const deviations::PathLengths paths(model, views[view].camera, pose.world_from_model);
    moved += fit.motion(view, [&](const OutlineRow& row) {
      return deviations::edge_inside_px(paths, row.point, {options.opaque_mm, options.blur_px});
    });
  }
  return moved * moved.transpose();
}

/// The covariance of the pose that all these errors make. Nothing if the outline does not determine the pose.
std::optional<Matrix6d> covariance_of(const List<View>& views, const OutlineProjector& projector, const Mesh& model,
                                      const Pose& pose, const Options& options) {
  const auto fit = OutlineFit::of(views, projector, pose);
  if (!fit) return std::nullopt;
  Matrix6d covariance = fit->covariance([&](std::size_t) { return errors_of(options); });
  if (options.surface_mm > 0) covariance += covariance_of_surface(*fit, options);
  if (options.opaque_mm > 0) covariance += covariance_of_rims(*fit, views, model, pose, options);
  return covariance;
}

deviations::Widened systematic(const List<Pose>& stages, const Mesh& model, const OutlineProjector& projector,
                               const List<View>& views, const Options& options, Context& context) {
  check_mesh(model, "model");
  return deviations::widened(
      stages, [&](const Pose& pose) { return covariance_of(views, projector, model, pose, options); },
      "its deviations are left as they are", context);
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("deviations.systematic", systematic)
      .summary(
          "Adds to predicted deviations what all of an outline has in common: an offset between edges and outline that "
          "differs from view to view, errors of the surface, rims of metal that let radiation pass, and errors of the "
          "cameras")
      .in("stages", "poses of a search", over("stage"))
      .in("model", "surface of the bone or implant")
      .in("projector", "draws its outline")
      .in("views", "X-ray views; only their cameras are used", over("view"))
      .out("pose", &deviations::Widened::pose,
           "the last pose; a covariance that is absent or not finite stays as it is")
      .out("stages", &deviations::Widened::stages, "all poses", over("stage"))
      .option("offset_px", &Options::offset_px,
              "standard deviation of the offset of the edges in a view from the offset that all views share, and of "
              "its change with the border's direction",
              at_least(0), at_most(50))
      .option("camera_px", &Options::camera_px,
              "standard deviation of the place of a camera's whole image, along each of its sides: the residual of its "
              "calibration where the bone lies",
              at_least(0), at_most(100))
      .option("camera_depth_percent", &Options::camera_depth_percent,
              "standard deviation of a camera's magnification; in one view it is that of the depth", at_least(0),
              at_most(50), unit("%"))
      .option("surface_mm", &Options::surface_mm,
              "standard deviation of the distance between the model's surface and what the edges in the images show of "
              "it, which is the same in all views and frames: a part of the CT's voxel and of the images' blur",
              at_least(0), at_most(20))
      .option("surface_reach_mm", &Options::surface_reach_mm,
              "how far from each other on the surface such errors are alike: where this far apart, their correlation "
              "is 0.61",
              at_least(0.1), at_most(1000))
      .option("opaque_mm", &Options::opaque_mm,
              "for metal of unknown opacity: the path through it behind which 1 / e of the radiation may arrive, such "
              "as 1.5 for steel and 5 for titanium. Edges then lie inside the outline where the path is short; a "
              "standard deviation. 0: it is opaque, or no metal",
              at_least(0), at_most(50))
      .option("blur_px", &Options::blur_px,
              "with opaque_mm: standard deviation of the blur by the X-ray device and the edge extractor together",
              at_least(0.2), at_most(20));
}
