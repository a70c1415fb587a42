// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "marrow/read/camera_file.hpp"
#include "marrow/toolbox/files/volume_file.hpp"

namespace {

struct Options {
  std::vector<std::string> names;
  std::vector<std::filesystem::path> images;
  std::vector<std::filesystem::path> cameras;
  std::filesystem::path calibration;
  std::vector<std::filesystem::path> distortions;
  int frame = 0;
  std::string mirror = "none";
  std::vector<double> projections, pixel_mm, corner_mm;
  double scale = 1;
};

struct Result {
  marrow::List<marrow::View> views;
  marrow::List<marrow::geometry::CameraDeviations> camera_deviations;
};

/// The number of the view's projection; -1 if none are named.
int projection_of(const Options& options, std::size_t view) {
  if (options.projections.empty()) return -1;
  return marrow::read::projection_number(options.projections.at(view), "view '" + options.names[view] + "'");
}

Result views(const marrow::List<marrow::Camera>* cameras, const Options& options, marrow::Context& context) {
  if (!cameras && options.cameras.empty()) throw marrow::Error("the node that is wired to 'camera' gave none");
  Result result;
  for (std::size_t i = 0; i < options.names.size(); ++i) {
    const std::string& name = options.names[i];
    if (options.images.at(i).empty()) continue;
    if (!cameras && options.cameras.at(i).empty()) throw marrow::Error("view '" + name + "': its camera is not given");
    marrow::read::ViewAsStated read = marrow::read::read_view_files(
        {name, options.images.at(i), cameras ? &marrow::read::camera_of_view(name, *cameras) : nullptr,
         cameras ? std::filesystem::path() : options.cameras.at(i), options.calibration,
         options.distortions.empty() ? std::filesystem::path() : options.distortions.at(i), options.frame,
         options.mirror, projection_of(options, i), options.pixel_mm, options.corner_mm, options.scale},
        context);
    result.views.add(name, std::move(read.view));
    result.camera_deviations.add(name, read.camera_deviations);
    for (const std::string& doubt : marrow::files::doubts_about_sides(options.images.at(i), options.frame))
      context.warn(doubt);
    marrow::files::warn_of_pixels(options.images.at(i), context);
  }
  if (result.views.empty()) throw marrow::Error("all images are empty, so there is no view; give at least one image");
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("read.views", views)
      .summary("Reads X-ray views: images and their cameras; a known distortion is removed")
      .in("camera", "one camera per view, with the view's name, if no camera files are given", marrow::over("view"))
      .out("views", &Result::views, "the views", marrow::over("view"))
      .out("camera_deviations", &Result::camera_deviations, "how exactly each camera is known, as its file states it",
           marrow::over("view"))
      .option("names", &Options::names, "one name per view", marrow::required())
      .relation(marrow::at_least_one({"names"}))
      .relation(marrow::distinct("names"))
      .option("images", &Options::images,
              "one image file per view, as read.image reads it; a view whose image is empty is left out",
              marrow::required())
      .relation(marrow::same_length({"names", "images"}))
      .option("cameras", &Options::cameras,
              "one camera file (marrow's YAML, or a file of XMALab, MayaCam, plastimatch, RTK, xReg or JointTrack) per "
              "view")
      .relation(marrow::exactly_one({"in.camera", "cameras"}))
      .relation(marrow::as_many_or_none("cameras", "names"))
      .option("calibration", &Options::calibration,
              "calibration file of the device that took all views; its camera matrix replaces those of the cameras, "
              "and its distortion is removed from the images")
      .option(
          "distortions", &Options::distortions,
          "one distortion file of camera.distortion_plate per view; the images are straightened by it and masked out "
          "where it was not measured")
      .relation(marrow::as_many_or_none("distortions", "names"))
      .option("frame", &Options::frame, "frame of a multi-frame file, counted from 1; 0: the file has only one frame",
              marrow::at_least(0))
      .option("mirror", &Options::mirror,
              "turns all images over, if they are seen from the detector or have their rows from below, and with them "
              "the cameras in files of RTK or xReg; any other cameras must already be those of the turned images, as "
              "read.cameras gives them with the same option",
              marrow::one_of({"none", "left_right", "upside_down"}))
      .option("projections", &Options::projections,
              "RTK and xReg: number of each view's projection in its camera file, counted from 0; if empty, each file "
              "must have only one")
      .relation(marrow::as_many_or_none("projections", "names"))
      .option("pixel_mm", &Options::pixel_mm,
              "RTK: width and height of a pixel on the detector; one number for square pixels")
      .option("corner_mm", &Options::corner_mm,
              "RTK: the place (u, v) of the first pixel's centre on the detector; if empty, the images are centred")
      .option(
          "scale", &Options::scale,
          "factor that converts the unit of the camera files to mm: 10 for cm, 1000 for metres; not for marrow's YAML",
          marrow::at_least(1e-6));
}
