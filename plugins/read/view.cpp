// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "marrow/read/camera_file.hpp"
#include "marrow/toolbox/files/volume_file.hpp"

namespace {

struct Options {
  std::string name = "view";
  std::filesystem::path image;
  std::filesystem::path camera;
  std::filesystem::path calibration, distortion;
  int frame = 0;
  std::string mirror = "none";
  int projection = -1;
  std::vector<double> pixel_mm, corner_mm;
  double scale = 1;
};

marrow::read::ViewAsStated view(const marrow::Camera* camera, const Options& options, marrow::Context& context) {
  if (!camera && options.camera.empty())
    throw marrow::Error("view '" + options.name + "': the node that is wired to 'camera' gave none");
  marrow::read::ViewAsStated view = marrow::read::read_view_files(
      {options.name, options.image, camera, options.camera, options.calibration, options.distortion, options.frame,
       options.mirror, options.projection, options.pixel_mm, options.corner_mm, options.scale},
      context);
  for (const std::string& doubt : marrow::files::doubts_about_sides(options.image, options.frame)) context.warn(doubt);
  marrow::files::warn_of_pixels(options.image, context);
  return view;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("read.view", view)
      .summary("Reads one X-ray view: an image and its camera; a known distortion is removed")
      .in("camera", "the camera, if no camera file is given")
      .out("view", &marrow::read::ViewAsStated::view, "the view")
      .out("camera_deviations", &marrow::read::ViewAsStated::camera_deviations,
           "how exactly its camera is known, as the camera file states it")
      .option("name", &Options::name, "name of the view")
      .option("image", &Options::image, "image file, as read.image reads it", marrow::required())
      .option("camera", &Options::camera,
              "camera file (marrow's YAML, or a file of XMALab, MayaCam, plastimatch, RTK or xReg)")
      .relation(marrow::exactly_one({"in.camera", "camera"}))
      .option("calibration", &Options::calibration,
              "calibration file; its camera matrix replaces that of the camera, and its distortion is removed from the "
              "image")
      .option("distortion", &Options::distortion,
              "distortion file of camera.distortion_plate; the image is straightened by it and masked out where it was "
              "not measured")
      .option("frame", &Options::frame, "frame of a multi-frame file, counted from 1; 0: the file has only one frame",
              marrow::at_least(0))
      .option("mirror", &Options::mirror,
              "turns the image over, if it is seen from the detector or has its rows from below, and with it the "
              "camera in a file of RTK or xReg; any other camera must already be that of the turned image, as "
              "read.camera gives it with the same option",
              marrow::one_of({"none", "left_right", "upside_down"}))
      .option(
          "projection", &Options::projection,
          "RTK and xReg: number of the view's projection in the camera file, counted from 0; -1: the file has only one",
          marrow::at_least(-1))
      .option("pixel_mm", &Options::pixel_mm,
              "RTK: width and height of a pixel on the detector; one number for square pixels")
      .option("corner_mm", &Options::corner_mm,
              "RTK: the place (u, v) of the first pixel's centre on the detector; if empty, the image is centred")
      .option(
          "scale", &Options::scale,
          "factor that converts the unit of the camera file to mm: 10 for cm, 1000 for metres; not for marrow's YAML",
          marrow::at_least(1e-6));
}
