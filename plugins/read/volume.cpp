// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "marrow/toolbox/files/volume_file.hpp"

namespace {

struct Options {
  std::filesystem::path path;
  std::vector<double> voxel_size_mm;
  std::vector<std::string> flip;
  double value_offset_hu = 0;
  std::string series_uid;
};

marrow::Volume volume(const Options& options, marrow::Context& context) {
  marrow::Volume volume = marrow::files::read_volume_file(
      options.path, {options.voxel_size_mm, options.flip, options.value_offset_hu, options.series_uid},
      [&](const std::string& line) { context.info(line); });
  marrow::files::warn_of_offset(volume, options.path, options.value_offset_hu, context);
  return volume;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("read.volume", volume)
      .summary(
          "Reads a CT volume from MHA, NRRD, NIfTI, multi-page TIFF, an enhanced DICOM file of many frames, or a "
          "folder "
          "(DICOM series, MHD or NHDR with its data)")
      .out("volume",
           "CT in Hounsfield units; patient axes are LPS; samples that a DICOM series marks as padding "
           "(PixelPaddingValue) become air, at most -1000 HU")
      .option("path", &Options::path, "file, or folder of a series", marrow::required())
      .option("voxel_size_mm", &Options::voxel_size_mm,
              "size of a voxel [x, y, z]; required for TIFF; replaces the size in the file")
      .option("flip", &Options::flip, "axes of the grid (x, y, z) along which the samples are reversed")
      .option("value_offset_hu", &Options::value_offset_hu,
              "value added to every sample: -1024 if the file holds HU + 1024")
      .option("series_uid", &Options::series_uid,
              "SeriesInstanceUID of the series to read, if a DICOM folder holds several of CT");
}
