// SPDX-License-Identifier: Apache-2.0
// Cameras from the headers of X-ray images: what a C-arm writes of its angles and distances.
#include <marrow/plugin.hpp>

#include "marrow/domain/names.hpp"
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
  if (options.paths.empty()) throw marrow::Error("paths: no image is named; name at least one");
  marrow::List<marrow::Camera> cameras;
  for (std::size_t i = 0; i < options.paths.size(); ++i) {
    const std::string name = options.names.empty() ? options.paths[i].stem().string() : options.names.at(i);
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
      .out("camera", "geometry of each view; the isocentre is the world's origin, its axes are the patient's",
           marrow::over("view"))
      .option("paths", &Options::paths, "DICOM files, the same that read.views takes as images", marrow::required())
      .option("names", &Options::names, "one name per view; without names, the files' names without extension")
      .relation(marrow::as_many_or_none("names", "paths"))
      .option("frame", &Options::frame,
              "frame of a multi-frame file, from 1, the one that read.views takes; 0 = there is only one, or all were "
              "taken alike",
              marrow::at_least(0))
      .option("source_to_detector_mm", &Options::source_to_detector_mm,
              "instead of DistanceSourceToDetector; 0 = as the header says", marrow::at_least(0))
      .option("source_to_isocentre_mm", &Options::source_to_isocentre_mm,
              "instead of DistanceSourceToPatient; 0 = as the header says", marrow::at_least(0))
      .option("pixel_mm", &Options::pixel_mm,
              "size of a pixel on the detector, instead of ImagerPixelSpacing; 0 = as the header says",
              marrow::at_least(0));
}
