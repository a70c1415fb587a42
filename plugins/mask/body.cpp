// SPDX-License-Identifier: Apache-2.0
// A body whose pose is known, such as an implant, hides what is searched for next. Its pixels are left out.

#include "marrow/mask/leave_out.hpp"

namespace {

struct Options {
  int margin_px = 4;
};

marrow::View body(const marrow::View& view, const marrow::RadiographProjector& projector, const marrow::Pose& pose,
                  const Options& options) {
  marrow::check_view(view);
  marrow::check_rigid(pose.world_from_model, "mask.body: the pose of the body");
  const marrow::Camera& camera = view.camera;
  cv::Mat1b shadow(camera.height_px, camera.width_px, std::uint8_t(0));
  const marrow::PixelGrid region = projector.region(camera, pose.world_from_model);
  if (region.count() > 0) {
    const std::vector<float> values = projector.radiograph(camera, pose.world_from_model, region);
    for (int row = 0; row < region.rows; ++row)
      for (int column = 0; column < region.columns; ++column)
        if (values[std::size_t(row) * std::size_t(region.columns) + std::size_t(column)] > 0)
          shadow(int(region.v_px) + row, int(region.u_px) + column) = 255;
  }
  return marrow::mask::without(view, shadow, options.margin_px);
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("mask.body", body)
      .summary("Leaves out the pixels that show a body whose pose is known, such as an implant")
      .in("view", "X-ray view")
      .in("projector", "makes radiographs of the body")
      .in("pose", "pose of the body")
      .out("view", "the same view; its mask is 0 where the body is seen, and where it was 0 before")
      .option("margin_px", &Options::margin_px, "pixels this near to the body are left out, too", marrow::at_least(0),
              marrow::at_most(100));
}
