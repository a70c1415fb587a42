// SPDX-License-Identifier: Apache-2.0
// A camera from its matrices: Eq 1-3 of the chapter, with v = (f / z) y, K 3x3 and [R|t] 3x4. As printed, Eq 1 has x
// also in the formula for v, and the size of K does not fit [R|t].
#include <marrow/plugin.hpp>

namespace {

struct Options {
  int width_px = 512;
  int height_px = 512;
  std::array<double, 9> intrinsics{1706.5, 0, 255.5, 0, 1706.5, 255.5, 0, 0, 1};
  std::array<double, 9> rotation{1, 0, 0, 0, 1, 0, 0, 0, 1};
  std::array<double, 3> translation_mm{0, 0, 600};
};

using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

marrow::Camera pinhole(const Options& options) {
  marrow::Camera camera;
  camera.width_px = options.width_px;
  camera.height_px = options.height_px;
  camera.intrinsics = Eigen::Map<const RowMajor>(options.intrinsics.data());
  camera.camera_from_world.rotation = Eigen::Map<const RowMajor>(options.rotation.data());
  camera.camera_from_world.translation_mm = Eigen::Map<const Eigen::Vector3d>(options.translation_mm.data());
  marrow::check_camera(camera, "camera.pinhole");
  return camera;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("camera.pinhole", pinhole)
      .summary(
          "Pinhole camera from its matrices (Eq 1-3): pixel = K (R x_world + t); z points to the detector, u to the "
          "right, v down")
      .out("camera", "the camera")
      .option("width_px", &Options::width_px, "image width", marrow::at_least(1), marrow::at_most(16384))
      .option("height_px", &Options::height_px, "image height", marrow::at_least(1), marrow::at_most(16384))
      .option("intrinsics", &Options::intrinsics, "camera matrix K, 9 numbers row by row", marrow::unit("px"))
      .option("rotation", &Options::rotation, "rotation R of camera_from_world, 9 numbers row by row",
              marrow::unit("1"))
      .option("translation_mm", &Options::translation_mm, "translation t of camera_from_world");
}
