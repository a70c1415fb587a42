// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "marrow/toolbox/files/view_file.hpp"

namespace {

struct Options {
  std::vector<std::string> names;
  std::vector<std::filesystem::path> images;
  std::vector<std::filesystem::path> cameras;
  std::filesystem::path calibration;
  int frame = 0;
  std::string mirror = "none";
};

marrow::List<marrow::View> views(const marrow::List<marrow::Camera>* cameras, const Options& options) {
  if (!cameras && options.cameras.empty()) throw marrow::Error("the node that is wired to 'camera' gave none");
  marrow::List<marrow::View> views;
  for (std::size_t i = 0; i < options.names.size(); ++i) {
    const std::string& name = options.names[i];
    views.add(name, marrow::files::read_view_files({name, options.images.at(i),
                                                    cameras ? &marrow::files::camera_of(name, *cameras) : nullptr,
                                                    cameras ? std::filesystem::path() : options.cameras.at(i),
                                                    options.calibration, options.frame, options.mirror}));
  }
  return views;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("read.views", views)
      .summary("Reads X-ray views: images and their cameras; a known distortion is removed")
      .in("camera", "one camera per view, with the view's name, if no camera files are given", marrow::over("view"))
      .out("views", "the views", marrow::over("view"))
      .option("names", &Options::names, "one name per view", marrow::required())
      .relation(marrow::at_least_one({"names"}))
      .relation(marrow::distinct("names"))
      .option("images", &Options::images, "one image file (PNG, TIFF, DICOM) per view", marrow::required())
      .relation(marrow::same_length({"names", "images"}))
      .option("cameras", &Options::cameras, "one camera file (XMALab's text or marrow's YAML) per view")
      .relation(marrow::exactly_one({"in.camera", "cameras"}))
      .relation(marrow::as_many_or_none("cameras", "names"))
      .option("calibration", &Options::calibration,
              "calibration file of the device that took all views; its camera matrix replaces those of the cameras, "
              "and its distortion is removed from the images")
      .option("frame", &Options::frame, "frame of a multi-frame file, counted from 1; 0: the file has only one frame",
              marrow::at_least(0))
      .option(
          "mirror", &Options::mirror,
          "turns all images over, if they are seen from the detector or have their rows from below; the cameras must "
          "be those of the images that were turned over, as read.cameras gives them with the same option",
          marrow::one_of({"none", "left_right", "upside_down"}));
}
