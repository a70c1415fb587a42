// SPDX-License-Identifier: Apache-2.0
// Adds to a phantom what real images show beside the bone: the knee, soft tissue of uneven shape, metal, the table.
#include <marrow/plugin.hpp>

#include "marrow/simulate/knee.hpp"
#include "marrow/simulate/surgery.hpp"
#include "marrow/simulate/vectors.hpp"

namespace {

using namespace marrow;
using phantom::Body, phantom::ClutteredPhantom, phantom::Fragment, phantom::Phantom;

struct ClutterOptions {
  std::string knee = "off", fat = "off", folds = "off", vessels = "off", pin = "off", plate = "off", cable = "off",
              clamp = "off", table = "off", lag = "off";
  int clutter_seed = 1;
};

// The figures of the levels mild, usual and bad (docs/simulation.md).
constexpr std::array<double, 3> kKneeGapMm{5.5, 4.5, 2.5}, kKneeFlexionDeg{10, 20, 40}, kFatUnevenness{0.3, 0.55, 0.8},
    kFoldMm{2, 4, 7}, kCalcified{0, 0.3, 0.7}, kCalcifiedWallMm{0.4, 0.6, 0.9}, kPlateLengthMm{50, 80, 110},
    kRodMm{8, 11, 16}, kClampMm{14, 26, 40}, kTableShellMm{1, 2, 2}, kLagMm{1, 3, 6};
constexpr std::array<int, 3> kFolds{1, 2, 4}, kCables{1, 2, 4};

/// 0, 1, 2 for mild, usual and bad; nothing for off.
std::optional<std::size_t> level_of(const std::string& name) {
  if (name == "off") return std::nullopt;
  return name == "mild" ? 0 : name == "usual" ? 1 : 2;
}

void add(std::vector<Body>& bodies, const std::vector<Body>& more) {
  bodies.insert(bodies.end(), more.begin(), more.end());
}

/// The height in frame "bone" below which the bone is whole.
double whole_below(const Phantom& phantom) {
  constexpr double kFromFractureMm = 8;
  const Eigen::Vector2d axis = phantom::distal_end(phantom.bone.outer).middle_mm;
  double height = phantom::bounds_of(phantom.bone.outer.vertices_mm).max().z();
  // The block below the fracture is wider than the bone. Only what lies above the shaft counts, so its floor does not.
  for (const auto& t : phantom.fracture.triangles) {
    const Eigen::Vector3d &a = phantom.fracture.vertices_mm[t[0]], &b = phantom.fracture.vertices_mm[t[1]],
                          &c = phantom.fracture.vertices_mm[t[2]];
    const bool faces_up = (b - a).cross(c - a).z() > 0;
    if (faces_up && ((a + b + c).head<2>() / 3 - axis).norm() < 22) height = std::min(height, a.z());
  }
  return height - kFromFractureMm;
}

void add_plate(ClutteredPhantom& cluttered, std::size_t level, std::uint64_t seed, Context& context) {
  marrow::Random random(seed, 6);
  phantom::PlateShape shape;
  shape.length_mm = kPlateLengthMm[level];
  shape.material = level == 0 ? "titanium" : "steel";
  const Phantom& phantom = cluttered.phantom;
  std::vector<Body> plate =
      phantom::make_plate(phantom.bone.outer, phantom::distal_fragment(phantom), shape, whole_below(phantom), random);
  if (plate.empty()) context.warn("the fracture is too near to the knee for a plate below it; it is left out");
  add(cluttered.bodies, plate);
}

/// Soft tissue of its own shape. The levels of fat, folds and vessels do not change each other's random numbers.
void add_tissue(ClutteredPhantom& cluttered, const ClutterOptions& options, std::uint64_t seed) {
  const phantom::Bone& bone = cluttered.phantom.bone;
  const auto fat = level_of(options.fat), folds = level_of(options.folds), vessels = level_of(options.vessels);
  if (!fat && !folds && !vessels) return;
  if (!(bone.thigh_radius_mm > 0))
    throw Error(
        "simulate.clutter: fat, folds and vessels need soft tissue, but the bone has none; set "
        "thigh_radius_mm of the bone, or these three to 'off'");
  marrow::Random random(seed, 1);
  phantom::ThighShape shape;
  shape.unevenness = fat ? kFatUnevenness[*fat] : 0;
  shape.folds = folds ? kFolds[*folds] : 0;
  shape.fold_mm = folds ? kFoldMm[*folds] : 0;
  cluttered.tissues = phantom::make_thigh(bone, shape, random);
  if (!vessels) return;
  marrow::Random other(seed, 2);
  phantom::VesselShape vessel;
  vessel.calcified = kCalcified[*vessels];
  vessel.wall_mm = kCalcifiedWallMm[*vessels];
  vessel.veins = 1 + int(*vessels);
  add(cluttered.tissues, phantom::make_vessels(bone, vessel, other));
}

void add_knee(ClutteredPhantom& cluttered, std::size_t level, std::uint64_t seed) {
  marrow::Random random(seed, 3);
  phantom::KneeShape shape;
  shape.gap_mm = kKneeGapMm[level];
  shape.flexion_rad = radians(kKneeFlexionDeg[level] * random.uniform());
  shape.ct_flexion_rad = radians(kKneeFlexionDeg[0] * random.uniform());
  shape.patella_up_mm = 10 * (random.uniform() - 0.5);
  const Phantom& phantom = cluttered.phantom;
  add(cluttered.bodies, phantom::make_knee(phantom.bone.outer, phantom::distal_fragment(phantom), shape));
}

struct Cluttered {
  ClutteredPhantom phantom;
  std::optional<ClutteredPhantom> earlier;
};

/// The phantom of an earlier frame: the fragment at the knee, and what is fixed to it, lie elsewhere.
ClutteredPhantom moved_back(const ClutteredPhantom& now, double distance_mm, std::uint64_t seed) {
  marrow::Random random(seed, 10);
  ClutteredPhantom earlier = now;
  const std::string name = phantom::distal_fragment(now.phantom).name;
  RigidTransform shift{"world", "world"};
  shift.translation_mm = distance_mm * phantom::random_direction(random);
  for (Fragment& fragment : earlier.phantom.fragments)
    if (fragment.name == name) fragment.world_from_ct = shift * fragment.world_from_ct;
  for (Body& body : earlier.bodies)
    if (body.moves_with == name) phantom::move(body, shift);
  return earlier;
}

/// Metal, cables and the table. Each has its own random numbers, so no level changes the place of another.
void add_surgery(ClutteredPhantom& cluttered, const ClutterOptions& options, std::uint64_t seed, Context& context) {
  const Phantom& phantom = cluttered.phantom;
  const Eigen::Vector2d centre = phantom.bone.thigh_centre_mm;
  const double radius = phantom.bone.thigh_radius_mm;
  if (const auto level = level_of(options.table)) {
    marrow::Random random(seed, 4);
    add(cluttered.bodies, phantom::make_table(centre, radius, kTableShellMm[*level], *level == 2, random));
  }
  if (const auto level = level_of(options.plate)) add_plate(cluttered, *level, seed, context);
  if (const auto level = level_of(options.pin)) {
    marrow::Random random(seed, 5);
    const std::vector<double> diameters = *level == 0   ? std::vector{2.0}
                                          : *level == 1 ? std::vector{4.0}
                                                        : std::vector{5.0, 3.0};
    add(cluttered.bodies,
        phantom::make_pins(phantom.bone.outer, phantom::distal_fragment(phantom), diameters, radius + 60, random));
  }
  if (const auto level = level_of(options.cable)) {
    marrow::Random random(seed, 7);
    add(cluttered.bodies, phantom::make_cables(centre, radius, kCables[*level], random));
  }
  if (const auto level = level_of(options.clamp)) {
    marrow::Random random(seed, 8);
    add(cluttered.bodies, phantom::make_clamp(centre, radius, kRodMm[*level], kClampMm[*level], random));
  }
}

Cluttered clutter(const Phantom& given, const ClutterOptions& options, Context& context) {
  phantom::check_phantom(given, "simulate.clutter");
  const std::uint64_t seed = std::uint64_t(options.clutter_seed);
  Cluttered result{{given, {}, {}}, std::nullopt};
  add_tissue(result.phantom, options, seed);
  if (const auto level = level_of(options.knee)) add_knee(result.phantom, *level, seed);
  add_surgery(result.phantom, options, seed, context);
  if (const auto level = level_of(options.lag)) result.earlier = moved_back(result.phantom, kLagMm[*level], seed);
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  auto node = plugin.node("simulate.clutter", clutter);
  node.summary("Adds what real images show beside the bone, each at a level: off, mild, usual or bad")
      .in("phantom", "bone, fracture and fragments")
      .out("phantom", &Cluttered::phantom, "the same with tissues and bodies")
      .out("earlier", &Cluttered::earlier, "with lag: the same at an earlier moment, before the last motion");
  const auto level = [&](const char* name, std::string ClutterOptions::*member, const char* help) {
    node.option(name, member, help, one_of({"off", "mild", "usual", "bad"}));
  };
  level("knee", &ClutterOptions::knee, "tibia, fibula and patella at a flexion of up to 10, 20 or 40 degrees");
  level("fat", &ClutterOptions::fat, "fat whose thickness changes by up to 30, 55 or 80 %");
  level("folds", &ClutterOptions::folds, "folds of the skin: 1, 2 or 4");
  level("vessels", &ClutterOptions::vessels, "artery and veins; 0, 30 or 70 % of the artery is calcified");
  level("pin", &ClutterOptions::pin, "traction pin through the condyles: 2 mm, 4 mm, or 5 and 3 mm");
  level("plate", &ClutterOptions::plate, "an old plate with screws on the distal fragment: 50, 80 or 110 mm");
  level("cable", &ClutterOptions::cable, "leads on the skin: 1, 2 or 4");
  level("clamp", &ClutterOptions::clamp, "rod and clamp of a robot or a fixator: 14, 26 or 40 mm");
  level("table", &ClutterOptions::table, "edge of a carbon table of 1 or 2 mm; bad: with its steel rail");
  level("lag", &ClutterOptions::lag, "motion since the earlier frame: 1, 3 or 6 mm");
  node.option("clutter_seed", &ClutterOptions::clutter_seed, "seed of the places and sizes", at_least(0));
}
