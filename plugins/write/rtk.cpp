// SPDX-License-Identifier: Apache-2.0
// Cameras as RTK's ThreeDCircularGeometry. RTK's images have their rows from below, so those of marrow's cameras must
// be turned upside down for it, and their origin is minus half of their size.
#include <marrow/plugin.hpp>

#include "marrow/toolbox/exchange/rtk_geometry.hpp"
#include "marrow/toolbox/exchange/written_files.hpp"
#include "marrow/write/named_cameras.hpp"

namespace {

using namespace marrow;
using exchange::RtkFile;

struct Options {
  std::vector<double> pixel_mm;
};

RtkFile rtk(const List<Camera>* cameras, const List<View>* views, const Options& options) {
  std::vector<Camera> all;
  for (const Camera& camera : write::named_cameras(cameras, views)) all.push_back(camera);
  return {exchange::rtk_geometry(all, exchange::pixel_mm(options.pixel_mm, "write.rtk"))};
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("write.rtk", rtk)
      .summary("Gives cameras as a geometry of RTK (.xml)")
      .in("cameras", "the cameras", over("view"))
      .in("views", "the views whose cameras they are", over("view"))
      .out("geometry", "a projection for each camera, for images that are turned upside down and centred")
      .option("pixel_mm", &Options::pixel_mm,
              "width and height of a pixel on the detector; one number for square pixels", required())
      .relation(exactly_one({"in.cameras", "in.views"}));
  plugin.writer<RtkFile>(".xml", exchange::write_file, "geometry of RTK");
}
