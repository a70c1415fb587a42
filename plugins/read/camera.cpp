// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "camera_file.hpp"

namespace {

struct Options {
  std::filesystem::path path;
};

marrow::Camera camera(const Options& options) {
  return marrow::read::read_camera_file(options.path);
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("read.camera", camera)
      .summary("Camera from XMALab's text or marrow's YAML")
      .out("camera", "geometry of the view")
      .option("path", &Options::path, "camera file; .yaml is marrow's own, anything else XMALab's text",
              marrow::required());
}
