// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "marrow/toolbox/files/volume_file.hpp"

namespace {

struct Options {
  std::filesystem::path path;
  int frame = 0;
  std::string mirror = "none";
};

marrow::Image image(const Options& options, marrow::Context& context) {
  marrow::files::warn_of_pixels(options.path, context);
  return marrow::files::turned_over(marrow::files::read_image_file(options.path, options.frame), options.mirror);
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("read.image", image)
      .summary(
          "Reads a grey image from PNG, TIFF, JPEG, BMP, DICOM, MetaImage, NRRD or NIfTI, whatever its file is named")
      .out("image",
           "grey values, bright = air; 8 and 16 bits are kept, others become float; a DICOM image is scaled as its "
           "header says; a DICOM X-ray image is also mirrored and inverted if needed, so that it fits the camera of "
           "its header")
      .option("path", &Options::path, "image file", marrow::required())
      .option("frame", &Options::frame, "frame of a multi-frame file, counted from 1; 0: the file has only one frame",
              marrow::at_least(0))
      .option("mirror", &Options::mirror,
              "turns the image over, if it is seen from the detector or has its rows from below",
              marrow::one_of({"none", "left_right", "upside_down"}));
}
