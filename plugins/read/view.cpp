// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "camera_file.hpp"
#include "volume_file.hpp"

namespace {

struct Options {
  std::string name = "view";
  std::filesystem::path image;
  std::filesystem::path camera;
};

marrow::View view(const marrow::Camera* camera, const Options& options) {
  if (bool(camera) == !options.camera.empty())
    throw marrow::Error("view '" + options.name +
                        "': give its camera either as the option (a file) or as the input (a value)");
  marrow::View view;
  view.name = options.name;
  view.image = marrow::read::read_image_file(options.image);
  view.camera = camera ? *camera : marrow::read::read_camera_file(options.camera);
  check_view(view);
  return view;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("read.view", view)
      .summary("One X-ray view: an image and its camera")
      .in("camera", "geometry, where no camera file is given")
      .out("view", "the view")
      .option("name", &Options::name, "name of the view")
      .option("image", &Options::image, "image file (PNG, TIFF)", marrow::required())
      .option("camera", &Options::camera, "camera file (XMALab text, or marrow's YAML)");
}
