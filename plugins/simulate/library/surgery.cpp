// SPDX-License-Identifier: Apache-2.0
#include "marrow/simulate/surgery.hpp"

#include "marrow/simulate/knee.hpp"

namespace marrow::phantom {
namespace {

using Eigen::Vector2d, Eigen::Vector3d;

constexpr double kReachMm = 220;  // half the length of bodies that reach beyond the images

Body outside(const std::string& name, const std::string& material, Mesh surface) {
  return {.name = name, .material = material, .surface = std::move(surface), .moves_with = {}};
}

double between(Random& random, double low, double high) { return low + (high - low) * random.uniform(); }

/// How far the bone reaches to each side in x near a point of (y, z): the largest and the smallest of `lateral_x` * x.
std::pair<double, double> sides_at(const Mesh& outer, double lateral_x, double y, double z) {
  constexpr double kNearMm = 5;
  double farthest = -std::numeric_limits<double>::max(), nearest = -farthest;
  for (const auto& vertex : outer.vertices_mm)
    if (std::abs(vertex.z() - z) < kNearMm && std::abs(vertex.y() - y) < kNearMm) {
      farthest = std::max(farthest, lateral_x * vertex.x());
      nearest = std::min(nearest, lateral_x * vertex.x());
    }
  return {farthest, nearest};
}

/// The middle of the bone in y at a height.
double middle_y(const Mesh& outer, double z) {
  double low = std::numeric_limits<double>::max(), high = -low;
  for (const auto& vertex : outer.vertices_mm)
    if (std::abs(vertex.z() - z) < 4) {
      low = std::min(low, vertex.y());
      high = std::max(high, vertex.y());
    }
  return 0.5 * (low + high);
}

/// A screw with thread and head. It points from its head to its tip.
Mesh screw(const Vector3d& head, const Vector3d& tip, double diameter) {
  constexpr double kHeadMm = 4, kPitchMm = 1.75, kStepMm = kPitchMm / 6;
  const Vector3d along = (tip - head).normalized();
  const double length = (tip - head).norm();
  Points curve{head - along * kHeadMm};
  std::vector<double> radii{0.8 * diameter};
  curve.push_back(head);
  radii.push_back(0.9 * diameter);
  for (double at = 0.2; at < length - 2; at += kStepMm) {
    const double phase = std::fmod(at, kPitchMm) / kPitchMm;
    curve.push_back(head + at * along);
    radii.push_back(diameter * (0.39 + 0.11 * std::max(0.0, 1 - std::abs(phase - 0.5) * 4)));
  }
  curve.push_back(tip);
  radii.push_back(0.1 * diameter);
  return tube(curve, radii, 24);
}

}  // namespace

std::vector<Body> make_pins(const Mesh& outer, const Fragment& fragment, const std::vector<double>& diameters,
                            double half_length, Random& random) {
  const DistalEnd end = distal_end(outer);
  double height = end.lowest_z + between(random, 32, 48);
  std::vector<Body> pins;
  for (double diameter : diameters) {
    const double tilt = radians(between(random, -8, 8)), turn = radians(between(random, -8, 8));
    const Vector3d middle(end.middle_mm.x(), middle_y(outer, height), height),
        along(std::cos(tilt) * std::cos(turn), std::cos(tilt) * std::sin(turn), std::sin(tilt));
    Body pin = fixed_to(fragment, "pin", "steel",
                        tube(middle - half_length * along, middle + half_length * along, 0.5 * diameter));
    pin.in_ct = false;
    pins.push_back(std::move(pin));
    height += between(random, 22, 34);
  }
  return pins;
}

std::vector<Body> make_plate(const Mesh& outer, const Fragment& fragment, const PlateShape& shape, double highest_z,
                             Random& random) {
  constexpr double kStepMm = 3, kShortestMm = 40, kFromEndMm = 26, kBorderMm = 8;
  const DistalEnd end = distal_end(outer);
  const double low = end.lowest_z + kFromEndMm + between(random, 0, 8),
               high = std::min(low + shape.length_mm, highest_z);
  if (high - low < kShortestMm) return {};
  // The plate is bent to the bone, but it bridges narrow hollows.
  std::vector<double> heights, lateral, y;
  for (double z = low; z <= high; z += kStepMm) {
    heights.push_back(z);
    y.push_back(middle_y(outer, z));
    lateral.push_back(sides_at(outer, end.lateral_x, y.back(), z).first);
  }
  for (int pass = 0; pass < 12; ++pass)
    for (std::size_t i = 1; i + 1 < heights.size(); ++i) {
      lateral[i] = std::max(lateral[i], 0.5 * (lateral[i - 1] + lateral[i + 1]));
      y[i] = 0.5 * y[i] + 0.25 * (y[i - 1] + y[i + 1]);
    }
  Points curve;
  for (std::size_t i = 0; i < heights.size(); ++i)
    curve.emplace_back(end.lateral_x * (lateral[i] + 0.5 * shape.thickness_mm), y[i], heights[i]);
  std::vector<Body> bodies{fixed_to(fragment, "plate", shape.material,
                                    bar(curve, end.lateral_x * Vector3d::UnitX(), shape.width_mm, shape.thickness_mm))};
  for (double z = low + kBorderMm; z <= high - kBorderMm + 1e-6; z += shape.screw_distance_mm) {
    const std::size_t i = std::min(heights.size() - 1, std::size_t((z - low) / kStepMm + 0.5));
    const double outer_side = lateral[i] + 0.5 * shape.thickness_mm,
                 inner_side = sides_at(outer, end.lateral_x, y[i], z).second;
    const bool is_in_condyle = z < end.lowest_z + 60;
    // Through the far cortex in the shaft; short of it in the condyles.
    const double tip_side = is_in_condyle ? inner_side + 6 : inner_side - 2;
    const Vector3d head(end.lateral_x * outer_side, y[i], z),
        tip(end.lateral_x * tip_side, y[i] + between(random, -3, 3), z + between(random, -3, 3));
    bodies.push_back(fixed_to(fragment, "screw", shape.material, screw(head, tip, shape.screw_diameter_mm)));
  }
  return bodies;
}

std::vector<Body> make_cables(const Vector2d& centre, double skin_radius, int count, Random& random) {
  constexpr double kSheathMm = 1.8, kCopperMm = 0.45, kStepMm = 4;
  std::vector<Body> cables;
  for (int i = 0; i < count; ++i) {
    // Around the front of the thigh, from one side to the other, with loose bends.
    const double from_z = between(random, -80, 80), to_z = between(random, -80, 80), bend = between(random, 4, 14),
                 wave = between(random, 50, 110), phase = 2 * kPi * random.uniform();
    const double radius = skin_radius + kSheathMm + 0.5;
    Points curve;
    const double length = 0.7 * kPi * radius;
    for (double at = 0; at <= length; at += kStepMm) {
      const double share = at / length, angle = -kPi * (0.15 + 0.7 * share);
      const double lift = 3 + 3 * std::sin(2 * kPi * at / 70 + phase);
      curve.emplace_back(centre.x() + (radius + lift) * std::cos(angle), centre.y() + (radius + lift) * std::sin(angle),
                         from_z + share * (to_z - from_z) + bend * std::sin(2 * kPi * at / wave + phase));
    }
    // Beyond the thigh the lead runs on, out of the image.
    const auto onward = [](const Vector3d& from, const Vector3d& to) {
      return Vector3d(to + kReachMm * (to - from).normalized());
    };
    curve.insert(curve.begin(), onward(curve[1], curve[0]));
    curve.push_back(onward(curve[curve.size() - 2], curve.back()));
    cables.push_back(outside("cable", "plastic", tube(curve, std::vector<double>(curve.size(), kSheathMm), 16)));
    cables.push_back(outside("cable's core", "copper", tube(curve, std::vector<double>(curve.size(), kCopperMm), 16)));
  }
  return cables;
}

std::vector<Body> make_clamp(const Vector2d& centre, double skin_radius, double rod_diameter, double block,
                             Random& random) {
  const double rod_radius = 0.5 * rod_diameter, distance = skin_radius + 0.6 * block + between(random, 5, 15);
  // In front of the thigh, to one side: both views show it beside or across the bone.
  const double angle = -0.5 * kPi + (random.uniform() < 0.5 ? -1 : 1) * radians(between(random, 15, 40));
  const Vector3d middle(centre.x() + distance * std::cos(angle), centre.y() + distance * std::sin(angle), 0);
  const Vector3d along = Vector3d(between(random, -0.15, 0.15), between(random, -0.1, 0.1), 1).normalized();
  const double block_z = between(random, -50, 70);
  const Vector3d outward(std::cos(angle), std::sin(angle), 0);
  const Vector3d at_block = middle + along * block_z;
  std::vector<Body> bodies;
  bodies.push_back(outside(
      "clamp", "steel",
      bar({at_block - 0.5 * block * along, at_block + 0.5 * block * along}, outward, 0.8 * block, 0.6 * block)));
  bodies.push_back(outside("rod", "carbon", tube(middle - kReachMm * along, middle + kReachMm * along, rod_radius)));
  // A bolt through the clamp.
  const Vector3d side = along.cross(outward).normalized();
  bodies.push_back(outside("bolt", "steel",
                           tube(at_block + 0.3 * block * along - 0.8 * block * side,
                                at_block + 0.3 * block * along + 0.8 * block * side, 0.16 * block)));
  return bodies;
}

std::vector<Body> make_table(const Vector2d& centre, double skin_radius, double shell, bool rail, Random& random) {
  constexpr double kThickMm = 40, kRailMm = 25, kRailThickMm = 10, kRailGapMm = 12;
  const double side = random.uniform() < 0.5 ? -1 : 1;
  const double edge = centre.x() + side * between(random, 35, 70), far = edge - side * 2 * kReachMm;
  const double top = centre.y() + skin_radius + 3, middle_x = 0.5 * (edge + far), width = std::abs(edge - far);
  const auto slab = [&](double x, double y, double wide, double thick) {
    return bar({{x, y, -kReachMm}, {x, y, kReachMm}}, Vector3d::UnitY(), wide, thick);
  };
  std::vector<Body> table;
  table.push_back(outside("table's top", "carbon", slab(middle_x, top + 0.5 * shell, width, shell)));
  table.push_back(outside("table's floor", "carbon", slab(middle_x, top + kThickMm, width, shell)));
  table.push_back(outside("table's edge", "carbon",
                          slab(edge - side * shell, top + 0.5 * (kThickMm + shell), 2 * shell, kThickMm + shell)));
  if (rail)
    table.push_back(
        outside("table's rail", "steel", slab(edge + side * kRailGapMm, top + 0.5 * kThickMm, kRailThickMm, kRailMm)));
  return table;
}

}  // namespace marrow::phantom
