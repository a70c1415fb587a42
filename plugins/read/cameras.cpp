// SPDX-License-Identifier: Apache-2.0
// The cameras of all views from one file of RTK or xReg.
#include <algorithm>
#include <marrow/base/names.hpp>
#include <marrow/plugin.hpp>
#include <numeric>

#include "marrow/read/camera_file.hpp"

namespace {

using namespace marrow;

struct Options {
  std::filesystem::path path;
  std::vector<std::string> names;
  std::vector<double> projections, image_size_px, pixel_mm, corner_mm;
  std::string mirror = "none";
  double scale = 1;
};

/// The projections' numbers; without them the first ones, as many as there are names.
std::vector<int> numbers_of(const Options& options) {
  std::vector<int> numbers(options.names.size());
  std::iota(numbers.begin(), numbers.end(), 0);
  for (std::size_t i = 0; i < options.projections.size(); ++i) {
    numbers.at(i) = read::projection_number(options.projections[i], options.path.string());
  }
  return numbers;
}

List<Camera> cameras(const Options& options, Context& context) {
  if (read::projections_in(options.path) == read::Projections::xreg &&
      !(options.image_size_px.empty() && options.pixel_mm.empty() && options.corner_mm.empty()))
    throw Error(options.path.string() +
                ": says itself how large its images are; leave out image_size_px, pixel_mm and corner_mm, which are "
                "for RTK's geometry");
  const std::vector<Camera> read = read::read_projections(options.path, numbers_of(options),
                                                          {options.image_size_px, options.pixel_mm, options.corner_mm},
                                                          exchange::mirror_of(options.mirror), options.scale);
  List<Camera> cameras;
  for (std::size_t i = 0; i < read.size(); ++i) {
    check_item_name("view", options.names.at(i));
    if (const std::string doubt = read::doubt_about_unit(options.path, read[i], options.scale); !doubt.empty())
      context.warn("view '" + options.names[i] + "': " + doubt);
    cameras.add(options.names[i], read[i]);
  }
  return cameras;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("read.cameras", cameras)
      .summary("Reads the cameras of several views from one file of RTK or xReg")
      .out("cameras", "one camera per view", over("view"))
      .option("path", &Options::path, "camera file; .xml: RTK's geometry, .h5: xReg's projection data", required())
      .option("names", &Options::names, "one name per view", required())
      .relation(at_least_one({"names"}))
      .relation(distinct("names"))
      .option("projections", &Options::projections,
              "number of each view's projection, counted from 0; if empty, the first ones in their order")
      .relation(as_many_or_none("projections", "names"))
      .option("image_size_px", &Options::image_size_px, "RTK: width and height of the images")
      .option("pixel_mm", &Options::pixel_mm,
              "RTK: width and height of a pixel on the detector; one number for square pixels")
      .option("corner_mm", &Options::corner_mm,
              "RTK: the origin of its images: the place (u, v) of the first pixel's centre on the detector; empty: the "
              "images are centred")
      .option("mirror", &Options::mirror,
              "how the program's images are turned over before use, as by the same option of read.views; they are seen "
              "from the detector, or have their rows from below",
              one_of({"none", "left_right", "upside_down"}))
      .option("scale", &Options::scale,
              "factor that converts the unit of the camera file to mm: 10 for cm, 1000 for metres", at_least(1e-6));
}
