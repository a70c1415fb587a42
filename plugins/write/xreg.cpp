// SPDX-License-Identifier: Apache-2.0
// Cameras, and landmarks seen in views, as xReg's projection data in HDF5. The camera frame is the one whose images are
// not turned over. The images themselves are left out.
#include <algorithm>
#include <marrow/plugin.hpp>

#include "marrow/toolbox/exchange/written_files.hpp"
#include "marrow/toolbox/exchange/xreg_file.hpp"
#include "marrow/write/named_cameras.hpp"

namespace {

using namespace marrow;
using exchange::ShownLandmark, exchange::XregFile, exchange::XregProjection;

struct Options {
  std::vector<double> pixel_mm;
};

void check_views(const Landmarks& landmarks, const List<Camera>& cameras) {
  for (const Landmarks::Seen& seen : landmarks.seen)
    if (!cameras.find(seen.view))
      throw Error("landmark '" + seen.name + "' is seen in view '" + seen.view +
                  "', which has no camera here; wire all cameras, or leave the landmark's place in it out");
}

XregFile xreg(const List<Camera>* cameras, const List<View>* views, const Landmarks* landmarks,
              const Options& options) {
  const List<Camera> all = write::named_cameras(cameras, views);
  const Eigen::Vector2d pixel_mm = exchange::pixel_mm(options.pixel_mm, "write.xreg");
  if (landmarks) check_views(*landmarks, all);
  std::vector<XregProjection> projections;
  for (std::size_t i = 0; i < all.size(); ++i) {
    std::vector<ShownLandmark> shown;
    if (landmarks)
      for (const Landmarks::Seen& seen : landmarks->seen)
        if (seen.view == all.name(i)) shown.push_back({seen.name, seen.pixel});
    projections.push_back(exchange::xreg_projection(all[i], pixel_mm, std::move(shown)));
  }
  return {exchange::xreg_bytes(projections)};
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("write.xreg", xreg)
      .summary("Gives cameras, and landmarks seen in views, as projection data of xReg (.h5)")
      .in("cameras", "the cameras", over("view"))
      .in("views", "the views whose cameras they are", over("view"))
      .in("landmarks", "landmarks of one fragment; only those seen in the views are written")
      .out("projections", "a projection for each camera, without its image")
      .option("pixel_mm", &Options::pixel_mm,
              "width and height of a pixel on the detector; one number for square pixels", required())
      .relation(exactly_one({"in.cameras", "in.views"}));
  plugin.writer<XregFile>(".h5", exchange::write_file, "projection data of xReg, without images");
}
