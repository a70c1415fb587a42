// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "marrow/toolbox/files/camera_file.hpp"

namespace {

struct Options {
  std::filesystem::path path;
};

marrow::Camera camera(const Options& options, marrow::Context& context) {
  const marrow::DistortedCamera file = marrow::files::read_camera_file(options.path);
  if (!file.distortion.is_none())
    context.warn(
        options.path.string() +
        ": the images of this camera are distorted, which only read.view, read.views and read.case remove, with the "
        "camera file as their option; the camera is that of the image without distortion");
  return file.camera;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("read.camera", camera)
      .summary("Reads a camera from a text file of XMALab or from marrow's YAML")
      .out("camera", "the camera")
      .option("path", &Options::path,
              "camera file; .yaml: marrow's own format, any other extension: XMALab's text format", marrow::required());
}
