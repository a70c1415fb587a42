// SPDX-License-Identifier: Apache-2.0
// An intramedullary nail: a curved tube with holes for locking screws near its tip.
#include <marrow/plugin.hpp>

#include "marrow/simulate/polygonise.hpp"
#include "marrow/toolbox/geometry/implant.hpp"

namespace {

using namespace marrow;
using Eigen::Vector3d;
using geometry::Hole, geometry::Implant;

struct NailOptions {
  double length_mm = 300;
  double diameter_mm = 10;
  double bore_mm = 4.8;
  double bow_radius_mm = 1200;
  std::vector<double> hole_at_mm{15, 27.5, 40}, hole_turn_deg{0, 90, 0};
  double hole_diameter_mm = 5;
  double resolution_mm = 0.6;
};

/// A point of the nail's middle line, by its distance from the tip along this line: an arc that begins along z and is
/// convex to the front (-y).
Vector3d on_arc(double radius, double along) {
  return {0, radius * (1 - std::cos(along / radius)), radius * std::sin(along / radius)};
}

/// Negative inside the metal. It changes by 1 per mm at most.
double metal(const NailOptions& nail, const std::vector<Hole>& holes, const Vector3d& p) {
  const double radius = nail.bow_radius_mm, to_centre = std::hypot(p.z(), radius - p.y()),
               along = radius * std::atan2(p.z(), radius - p.y()), across = std::hypot(to_centre - radius, p.x());
  double value =
      std::max({across - 0.5 * nail.diameter_mm, 0.5 * nail.bore_mm - across, -along, along - nail.length_mm});
  for (const Hole& hole : holes) {
    const Vector3d from = p - hole.centre_mm;
    value = std::max(value, 0.5 * hole.diameter_mm - (from - from.dot(hole.axis) * hole.axis).norm());
  }
  return value;
}

std::tuple<Implant, Mesh> nail(const NailOptions& options) {
  if (!(options.bore_mm + 1 < options.diameter_mm))
    throw Error(
        formatted("simulate.nail: a bore of {:f} mm leaves a wall of less than 0.5 mm in a nail of {:f} mm; make the "
                  "bore narrower",
                  options.bore_mm, options.diameter_mm));
  Implant implant;
  const double radius = options.bow_radius_mm;
  for (std::size_t i = 0; i < options.hole_at_mm.size(); ++i) {
    const double at = options.hole_at_mm[i], turn = radians(options.hole_turn_deg.at(i));
    if (!(at > 0.5 * options.hole_diameter_mm && at < options.length_mm - 0.5 * options.hole_diameter_mm))
      throw Error(formatted(
          "simulate.nail: the hole at {:f} mm from the tip does not lie within the nail, which is {:f} mm long", at,
          options.length_mm));
    const Vector3d to_back(0, std::cos(at / radius), -std::sin(at / radius));
    implant.holes.push_back({formatted("hole-{}", i + 1), on_arc(radius, at),
                             std::cos(turn) * Vector3d::UnitX() + std::sin(turn) * to_back, options.hole_diameter_mm});
  }
  const double margin = 0.5 * options.diameter_mm + 2 * options.resolution_mm;
  const Vector3d top = on_arc(radius, options.length_mm);
  implant.surface = phantom::polygonise([&](const Vector3d& p) { return metal(options, implant.holes, p); },
                                        Vector3d(-margin, -margin, -margin),
                                        Vector3d(margin, top.y() + margin, top.z() + margin), options.resolution_mm, 1);
  implant.surface.frame = "implant";
  geometry::check_implant(implant, "simulate.nail");
  return {implant, implant.surface};
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("simulate.nail", nail)
      .summary("Makes an intramedullary nail: a curved tube with holes for locking screws")
      .out("implant",
           "closed surface and holes. z runs along the nail from its tip, at the origin; the bow is convex to the "
           "front (-y)")
      .out("mesh", "the surface alone")
      .option("length_mm", &NailOptions::length_mm, "length along the middle line", at_least(60), at_most(500))
      .option("diameter_mm", &NailOptions::diameter_mm, "outer diameter", at_least(4), at_most(20))
      .option("bore_mm", &NailOptions::bore_mm, "diameter of the bore", at_least(1), at_most(18))
      .option("bow_radius_mm", &NailOptions::bow_radius_mm, "radius of the middle line", at_least(400))
      .option("hole_at_mm", &NailOptions::hole_at_mm, "distance of each hole from the tip, along the middle line")
      .option("hole_turn_deg", &NailOptions::hole_turn_deg,
              "direction of each hole about the nail's axis; 0: from side to side, 90: from front to back")
      .relation(same_length({"hole_at_mm", "hole_turn_deg"}))
      .option("hole_diameter_mm", &NailOptions::hole_diameter_mm, "diameter of the holes", at_least(1), at_most(12))
      .option("resolution_mm", &NailOptions::resolution_mm,
              "edge length of the cubes in which the surface is made into triangles", at_least(0.2), at_most(2));
}
