// SPDX-License-Identifier: Apache-2.0
// Cameras from the angles and distances that a C-arm writes to the headers of X-ray images.
#include <marrow/plugin.hpp>

#include "marrow/base/names.hpp"
#include "marrow/toolbox/files/input_file.hpp"
#include "marrow/toolbox/files/xray_header.hpp"

namespace {

struct Options {
  std::vector<std::filesystem::path> paths;
  std::vector<std::string> names;
  int frame = 0;
  double source_to_detector_mm = 0;
  double source_to_isocentre_mm = 0;
  double pixel_mm = 0;
};

marrow::List<marrow::Camera> dicom(const Options& options, marrow::Context& context) {
  marrow::List<marrow::Camera> cameras;
  for (std::size_t i = 0; i < options.paths.size(); ++i) {
    const std::string name =
        options.names.empty() ? marrow::files::unescaped_name(options.paths[i].stem().string()) : options.names.at(i);
    marrow::check_item_name("view", name);
    if (cameras.find(name)) throw marrow::Error("names: two views are named '" + name + "'; name each differently");
    const auto geometry = marrow::files::read_xray_geometry(
        options.paths[i], options.frame,
        {options.source_to_detector_mm, options.source_to_isocentre_mm, options.pixel_mm});
    for (const std::string& warning : geometry.warnings) context.warn(warning);
    cameras.add(name, geometry.camera);
  }
  return cameras;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("camera.dicom", dicom)
      .summary("Cameras of X-ray images (XA, RF) from the angles and distances in their DICOM headers")
      .out("camera", "camera of each view; the world's origin is the isocentre, its axes are the patient's",
           marrow::over("view"))
      .option("paths", &Options::paths, "DICOM files, the same files that read.views reads as images",
              marrow::required())
      .relation(marrow::at_least_one({"paths"}))
      .option("names", &Options::names, "one name per view; if empty, the file names without extension")
      .relation(marrow::as_many_or_none("names", "paths"))
      .option("frame", &Options::frame,
              "frame of a multi-frame file, counted from 1, the same frame that read.views reads; 0: the file has one "
              "frame, or all frames have the same geometry",
              marrow::at_least(0))
      .option("source_to_detector_mm", &Options::source_to_detector_mm,
              "distance used instead of DistanceSourceToDetector; 0: use the header's value", marrow::at_least(0))
      .option("source_to_isocentre_mm", &Options::source_to_isocentre_mm,
              "distance used instead of DistanceSourceToPatient; 0: use the header's value", marrow::at_least(0))
      .option("pixel_mm", &Options::pixel_mm,
              "size of a pixel on the detector, used instead of ImagerPixelSpacing; 0: use the header's value",
              marrow::at_least(0));
}
