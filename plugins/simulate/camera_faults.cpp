// SPDX-License-Identifier: Apache-2.0
// Views with the cameras that a calibration would state: off by errors of known size. The images stay as the true
// cameras took them.
#include <marrow/plugin.hpp>

#include "marrow/base/names.hpp"
#include "marrow/simulate/vectors.hpp"

namespace {

using namespace marrow;

struct Options {
  std::string severity = "usual";
  double shift_mm = 1;
  double turn_deg = 0.5;
  double focal_percent = 1;
  double centre_px = 5;
  int camera_seed = 1;
  std::vector<std::string> only;
};

double factor_of(const std::string& level) {
  return level == "off" ? 0 : level == "mild" ? 0.5 : level == "usual" ? 1 : 2;
}

/// A length that is uniform in 0 to sqrt(3), so that the mean of its square is 1.
double length(marrow::Random& random) { return std::sqrt(3.0) * random.uniform(); }

List<View> camera_faults(const List<View>& views, const Options& options) {
  for (const std::string& name : options.only)
    if (!views.find(name)) throw Error("only: there is no view '" + name + "'; " + suggestion(name, views.names()));
  const double factor = factor_of(options.severity);
  return views.changed([&](View& view, std::size_t i) {
    Camera& camera = view.camera;
    const bool is_off = options.only.empty() || std::count(options.only.begin(), options.only.end(), views.name(i)) > 0;
    if (is_off && factor > 0) {
      marrow::Random random(std::uint64_t(options.camera_seed), i);
      RigidTransform off{"world", "world"};
      const double angle = radians(factor * options.turn_deg) * length(random);
      off.rotation = rotation_from_vector(angle * phantom::random_direction(random));
      const double shift = factor * options.shift_mm * length(random);
      off.translation_mm = shift * phantom::random_direction(random);
      camera.camera_from_world = camera.camera_from_world * off;
      const double longer =
          1 + factor * options.focal_percent / 100 * (random.uniform() < 0.5 ? -1 : 1) * length(random);
      camera.intrinsics(0, 0) *= longer;
      camera.intrinsics(0, 1) *= longer;
      camera.intrinsics(1, 1) *= longer;
      const double apart = factor * options.centre_px * length(random), turn = 2 * kPi * random.uniform();
      camera.intrinsics(0, 2) += apart * std::cos(turn);
      camera.intrinsics(1, 2) += apart * std::sin(turn);
    }
  });
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("simulate.camera_faults", camera_faults)
      .summary("Gives views cameras as a calibration states them, off by errors whose root mean square is given")
      .in("views", "images with the cameras that took them", over("view"))
      .out("views", "the same images; each error of a camera is at most 1.73 times its root mean square", over("view"))
      .option("severity", &Options::severity, "off: no error; mild, usual, bad: half, once or twice the errors below",
              one_of({"off", "mild", "usual", "bad"}))
      .option("shift_mm", &Options::shift_mm, "shift of the camera against the world", at_least(0))
      .option("turn_deg", &Options::turn_deg, "rotation of the camera about the origin of the world", at_least(0),
              at_most(30))
      .option("focal_percent", &Options::focal_percent, "change of the focal length", at_least(0), at_most(20))
      .option("centre_px", &Options::centre_px, "shift of the principal point", at_least(0))
      .option("camera_seed", &Options::camera_seed, "seed of the errors", at_least(0))
      .option("only", &Options::only, "names of the views whose cameras are off; empty: all");
}
