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
      .summary("Camera from XMALab's text or marrow's YAML")
      .out("camera", "geometry of the view")
      .option("path", &Options::path, "camera file; .yaml is marrow's own, anything else XMALab's text",
              marrow::required());
}
