// SPDX-License-Identifier: Apache-2.0
// A plain check of cameras against points, five that are wrong in one way each, and a camera that is none: the suite
// must catch each.
#include <cstdio>
#include <fstream>

#include "wrong.hpp"

namespace {

struct Options {
  std::filesystem::path points = "";
};

/// The largest distance, in px, between where a view should show a point and where it is; infinite behind the source.
double worst_px(const marrow::View& view, const std::filesystem::path& file, bool second, wrong::Fault fault) {
  std::ifstream stream(file);
  double worst = 0;
  for (std::string line; std::getline(stream, line);) {
    Eigen::Vector3d at;
    Eigen::Vector2d seen[2];
    if (std::sscanf(line.c_str(), " - {at_mm: [%lf, %lf, %lf], seen_px: {a: [%lf, %lf], b: [%lf, %lf]}}", &at[0],
                    &at[1], &at[2], &seen[0][0], &seen[0][1], &seen[1][0], &seen[1][1]) != 7)
      continue;
    const double off = (marrow::project(view.camera, at) - seen[second]).norm();
    worst = std::max(worst, std::isfinite(off) || fault == "trusting" ? off : INFINITY);
  }
  return worst;
}

template <wrong::Fault fault>
marrow::Metrics check(const marrow::List<marrow::View>& views, const Options& options) {
  double error = 0, warnings = 0;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (!(fault == "careless")) marrow::check_camera(views[i].camera, "view " + views[i].name);
    const double worst = worst_px(views[i], options.points, i == 1, fault);
    warnings += worst > 2;
    error += worst;
  }
  if (fault == "careless" && !std::isfinite(error)) error = NAN;
  if (fault == "silent") warnings = 0;
  if (fault == "anxious") ++warnings;
  if (fault == "changing") error += wrong::next_call();
  return {{{"warnings", warnings, ""}, {"error", error, "px"}}};
}

marrow::Camera left_handed() {
  marrow::Camera camera{512, 512, {}, {"camera", "world"}};
  camera.intrinsics << 1700, 0, 255.5, 0, 1700, 255.5, 0, 0, 1;
  camera.camera_from_world.rotation(0, 0) = -1;
  return camera;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  wrong::declare<"plain", "silent", "anxious", "careless", "changing", "trusting">(
      plugin, "camera", []<wrong::Fault fault>() { return &check<fault>; },
      [](auto&& node) {
        node.in("views", "images with the cameras to check", marrow::over("view"))
            .out("metrics", "figures")
            .option("points", &Options::points, "points and where they are seen");
      });
  plugin.node("camera.left_handed", left_handed).summary("For a test of the suite").out("camera", "geometry");
}
