// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "marrow/base/names.hpp"
#include "marrow/toolbox/files/input_file.hpp"
#include "marrow/toolbox/files/volume_file.hpp"

namespace {

struct Options {
  std::vector<std::string> names;
  std::vector<std::filesystem::path> paths;
  int frame = 0;
};

marrow::List<marrow::Image> images(const Options& options, marrow::Context& context) {
  marrow::List<marrow::Image> images;
  for (std::size_t i = 0; i < options.paths.size(); ++i) {
    const std::string name =
        options.names.empty() ? marrow::files::unescaped_name(options.paths[i].stem().string()) : options.names.at(i);
    marrow::check_item_name("view", name);
    if (images.find(name)) throw marrow::Error("names: two images are named '" + name + "'; name each differently");
    marrow::files::warn_of_pixels(options.paths[i], context);
    images.add(name, marrow::files::read_image_file(options.paths[i], options.frame));
  }
  return images;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("read.images", images)
      .summary("Reads grey images without cameras, as a calibration needs them")
      .out("images", "grey values, as from read.image", marrow::over("view"))
      .option("paths", &Options::paths, "image files, as read.image reads them", marrow::required())
      .relation(marrow::at_least_one({"paths"}))
      .option("names", &Options::names, "one name per image; if empty, the file names without extension")
      .relation(marrow::as_many_or_none("names", "paths"))
      .option("frame", &Options::frame, "frame of a multi-frame file, counted from 1; 0: the file has only one frame",
              marrow::at_least(0));
}
