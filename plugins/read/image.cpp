// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "marrow/toolbox/files/volume_file.hpp"

namespace {

struct Options {
  std::filesystem::path path;
  int frame = 0;
};

marrow::Image image(const Options& options) { return marrow::files::read_image_file(options.path, options.frame); }

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("read.image", image)
      .summary("Grey image from PNG or TIFF (8 or 16 bit, or float) or DICOM")
      .out("image",
           "grey values; of DICOM scaled as its header says, and of X-ray images mirrored and inverted to what "
           "the camera of their header sees, bright = air")
      .option("path", &Options::path, "image file", marrow::required())
      .option("frame", &Options::frame, "frame of a multi-frame file, from 1; 0 = there is only one",
              marrow::at_least(0));
}
