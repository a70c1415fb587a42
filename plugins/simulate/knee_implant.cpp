// SPDX-License-Identifier: Apache-2.0
// Parts of a knee implant as closed surfaces: a femoral part with two condyles and a flange, and a tibial tray with a
// keel. x is to the patient's left, y to the back, z to the head. They have the sizes of real parts, but copy none.
#include <marrow/plugin.hpp>

#include "marrow/simulate/polygonise.hpp"

namespace {

using namespace marrow;
using Eigen::Vector3d;
using phantom::capsule, phantom::cut, phantom::disc, phantom::join;

struct Options {
  std::string part = "femoral";
  double knee_width_mm = 66;
  double asymmetry = 0.06;
  double variation = 0;
  double resolution_mm = 0.8;
  int implant_seed = 1;
};

double box(const Vector3d& p, const Vector3d& half, double rim) {
  const Vector3d q = p.cwiseAbs() - half + Vector3d::Constant(rim);
  return q.cwiseMax(0).norm() + std::min(q.maxCoeff(), 0.0) - rim;
}

/// A shell around the cut end of the femur. The condyle on the left is smaller by `asymmetry`, and the flange leans.
double femoral_part(const Vector3d& p, double asymmetry) {
  const double of_left = 1 - asymmetry, rims = 5;
  const double left = disc(p - Vector3d(20, 1, 0), 25 * of_left, 12 * of_left, rims),
               right = disc(p - Vector3d(-20, 1, 0), 25, 12, rims);
  const double flange = box(p - Vector3d(-60 * asymmetry, -21, 12), {17, 4.5, 22}, 4);
  const double whole = join(join(left, right, 4), flange, 6);
  // The cuts of the bone are beveled: else the shell of the smaller condyle would break at its lower corner
  const double bone = box(p - Vector3d(0, 1.5, 22), {60, 18, 37}, 8),
               notch = box(p - Vector3d(0, 14, -8), {7, 20, 25}, 3);
  const double pegs =
      std::min(capsule(p, {20, 1, -14}, {20, 1, 0}, 3, 2.5), capsule(p, {-20, 1, -14}, {-20, 1, 0}, 3, 2.5));
  return join(cut(cut(whole, -bone, 1), -notch, 2), pegs, 1);
}

/// A plate with a notch at its back, and a keel with two wings. Without `asymmetry`, left and right are alike.
double tray(const Vector3d& p, double asymmetry) {
  const double wider = 1 + asymmetry * std::clamp(p.x() / 20, -1.0, 1.0);
  const Vector3d flat(p.x() * 24 / 36, p.y() / wider, p.z());
  const double across = std::hypot(flat.x(), flat.y()) - 24, beside = std::abs(p.z()) - 2.2;
  const double plate = cut(across, beside, 1), notch = std::hypot(p.x(), p.y() - 27) - 9;
  const double stem = capsule(p, {0, -2, 0}, {0, 1, -34}, 6.5, 5),
               wings = std::min(capsule(p, {0, 0, -26}, {24, 3, -2}, 2.2, 2.2),
                                capsule(p, {0, 0, -26}, {-24, 3, -2}, 2.2, 2.2));
  return join(join(cut(plate, -notch, 1), stem, 2), wings, 1.5);
}

Mesh knee_implant(const Options& options) {
  Random random(std::uint64_t(options.implant_seed), 21);
  const auto draw = [&](double part) { return 1 + options.variation * part * std::clamp(random.normal(), -2.0, 2.0); };
  const double size = options.knee_width_mm / 66 * draw(0.08), asymmetry = options.asymmetry * draw(0.3);
  const bool is_femoral = options.part == "femoral";
  const auto field = [&](const Vector3d& at) {
    const Vector3d p = at / size;
    return size * (is_femoral ? femoral_part(p, asymmetry) : tray(p, asymmetry));
  };
  constexpr double kSteepest = 2.5;
  const Vector3d half = size * Vector3d(50, 50, 55);
  Mesh mesh = phantom::polygonise(field, -half, half, options.resolution_mm, kSteepest);
  mesh.frame = "ct";
  return mesh;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("simulate.knee_implant", knee_implant)
      .summary("Makes a part of a knee implant as a closed surface: a femoral part, or a tibial tray with a keel")
      .out("mesh", "the surface, in mm")
      .option("part", &Options::part, "which part", one_of({"femoral", "tray"}))
      .option("knee_width_mm", &Options::knee_width_mm, "width of the knee for which it is made", at_least(40),
              at_most(100))
      .option(
          "asymmetry", &Options::asymmetry,
          "by which part of their size left and right differ; 0: a symmetric part, which has a mirror pose in one view",
          at_least(0), at_most(0.2))
      .option("variation", &Options::variation,
              "0: this size and shape; 1: random ones around them, with about the steps between sizes on the market",
              at_least(0), at_most(2))
      .option("implant_seed", &Options::implant_seed, "seed of the random size and shape", at_least(0))
      .option("resolution_mm", &Options::resolution_mm, "distance between points of the grid on which it is made",
              at_least(0.2), at_most(3));
}
