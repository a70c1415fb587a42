// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "marrow/toolbox/files/view_file.hpp"

namespace {

struct Options {
  std::string name = "view";
  std::filesystem::path image;
  std::filesystem::path camera;
  std::filesystem::path calibration;
  int frame = 0;
  std::string mirror = "none";
};

marrow::View view(const marrow::Camera* camera, const Options& options) {
  if (!camera && options.camera.empty())
    throw marrow::Error("view '" + options.name + "': the node that is wired to 'camera' gave none");
  return marrow::files::read_view_files(
      {options.name, options.image, camera, options.camera, options.calibration, options.frame, options.mirror});
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("read.view", view)
      .summary("Reads one X-ray view: an image and its camera; a known distortion is removed")
      .in("camera", "the camera, if no camera file is given")
      .out("view", "the view")
      .option("name", &Options::name, "name of the view")
      .option("image", &Options::image, "image file (PNG, TIFF, DICOM)", marrow::required())
      .option("camera", &Options::camera, "camera file (XMALab's text or marrow's YAML)")
      .relation(marrow::exactly_one({"in.camera", "camera"}))
      .option("calibration", &Options::calibration,
              "calibration file; its camera matrix replaces that of the camera, and its distortion is removed from the "
              "image")
      .option("frame", &Options::frame, "frame of a multi-frame file, counted from 1; 0: the file has only one frame",
              marrow::at_least(0))
      .option("mirror", &Options::mirror,
              "turns the image over, if it is seen from the detector or has its rows from below; the camera must be "
              "that of the image that was turned over, as read.camera gives it with the same option",
              marrow::one_of({"none", "left_right", "upside_down"}));
}
