// SPDX-License-Identifier: Apache-2.0
// A nail that slides along its own axis changes its image only at its tip and its holes. A cost that looks at these
// places alone shows whether the holes are where the pose says.
#include <marrow/plugin.hpp>

#include "marrow/toolbox/geometry/implant.hpp"

namespace {

struct Options {
  double reach_mm = 4.5;
};

/// Marks the pixels of a disc about a point, parallel to the detector. In an image whose pixels are not square it is
/// an ellipse.
void mark_disc(const marrow::Camera& camera, const Eigen::Vector3d& centre, const Eigen::Vector2d& pixel,
               double radius_mm, cv::Mat1b& marked) {
  for (int v = 0; v < marked.rows; ++v)
    for (int u = 0; u < marked.cols; ++u)
      if (offset_at_mm(camera, centre, Eigen::Vector2d(u, v) - pixel).norm() <= radius_mm) marked(v, u) = 255;
}

marrow::View near_holes(const marrow::View& view, const marrow::geometry::Implant& implant, const marrow::Pose& pose,
                        const Options& options) {
  marrow::check_view(view);
  marrow::geometry::check_implant(implant, "mask.near_holes");
  marrow::check_rigid(pose.world_from_model, "mask.near_holes: the pose of the implant");
  const marrow::Camera& camera = view.camera;
  cv::Mat1b near(camera.height_px, camera.width_px, std::uint8_t(0));
  for (const marrow::geometry::Hole& hole : implant.holes) {
    const Eigen::Vector3d centre = pose.world_from_model * hole.centre_mm;
    const Eigen::Vector2d pixel = project(camera, centre);
    if (!pixel.allFinite() || pixel.cwiseAbs().maxCoeff() > 1e6) continue;
    mark_disc(camera, centre, pixel, options.reach_mm, near);
  }
  marrow::View result = view;
  if (!view.mask.empty()) near.setTo(0, view.mask == 0);
  result.mask = near;
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("mask.near_holes", near_holes)
      .summary("Leaves out all pixels that are not near a hole of an implant whose pose is known")
      .in("view", "X-ray view")
      .in("implant", "implant with its holes")
      .in("pose", "pose of the implant")
      .out("view", "the same view; its mask is 0 except near the holes, and where it was 0 before")
      .option("reach_mm", &Options::reach_mm, "pixels this near to a hole's centre count", marrow::at_least(0.1),
              marrow::at_most(1000));
}
