// SPDX-License-Identifier: Apache-2.0
#include "scene.hpp"

#include <cmath>

#include "marrow/domain/camera.hpp"
#include "marrow/domain/functions.hpp"
#include "marrow/domain/random.hpp"
#include "marrow/runtime/node/types.hpp"
#include "marrow/toolbox/analytic/body.hpp"

namespace marrow::conformance {

using namespace analytic;

namespace {

constexpr int kSize_px = 240;
constexpr double kPixel_mm = 0.8;

/// A shaft and two condyles of different size.
Body bone() { return {{{0, 0, 60}, {13, 12, 90}}, {{24, -5, -38}, {11, 15, 13}}, {{-22, 8, -32}, {13, 11, 15}}}; }

/// A vector of random direction that is between half as long and as long as `most`.
Eigen::Vector3d drawn(Random& random, double most) {
  const Eigen::Vector3d direction(random.normal(), random.normal(), random.normal());
  return direction.normalized() * most * (0.5 + 0.5 * random.uniform());
}

RigidTransform turn_of_world(const LandmarkScene& scene) {
  RigidTransform turn{"world", "world"};
  if (!scene.is_turned) return turn;
  turn.rotation = rotation_from_vector({1.1, -0.7, 2.0});
  turn.translation_mm = {130, -40, 75};
  return turn;
}

Landmarks points() {
  Landmarks landmarks;
  landmarks.points = {{"lateral", {35, -5, -38}}, {"medial", {-35, 8, -32}}, {"front", {24, -20, -38}},
                      {"back", {-22, 19, -32}},   {"end", {-22, 8, -47}},    {"low", {24, -5, -51}}};
  return landmarks;
}

View view_of(const LandmarkScene& scene, const std::string& name, double angle_deg, bool shows_bone, Random& random) {
  constexpr double kBright = 50000, kPerMm = 0.02, kNoise = 250;
  View view;
  view.name = name;
  view.camera = c_arm(angle_deg, kSize_px, kSize_px, kPixel_mm);
  view.camera.camera_from_world = view.camera.camera_from_world * inverse(turn_of_world(scene));
  const std::vector<float> chords =
      BodyProjector(bone()).radiograph(view.camera, truth(scene), PixelGrid{0, 0, 1, kSize_px, kSize_px});
  view.image.pixels.create(kSize_px, kSize_px, CV_16U);
  for (int i = 0; i < kSize_px * kSize_px; ++i) {
    const double tissue_mm = 40 + 30 * std::sin(0.02 * (i % kSize_px)) * std::cos(0.017 * (i / kSize_px));
    const double chord_mm = shows_bone ? chords[std::size_t(i)] : 0;
    view.image.pixels.ptr<std::uint16_t>()[i] =
        std::uint16_t(kBright * std::exp(-kPerMm * (chord_mm + 0.4 * tissue_mm)) + kNoise * random.normal() + 2000);
  }
  return view;
}

Inputs made(const LandmarkScene& scene, bool shows_bone) {
  Random random(std::uint64_t(200 + scene.seed));
  List<View> views;
  for (const auto& [name, angle_deg] : {std::pair("frontal", 0.0), std::pair("lateral", 80.0)})
    views.add(name, view_of(scene, name, angle_deg, shows_bone, random));
  Vector6d off;
  off << drawn(random, 6) * radians(1), drawn(random, 6);
  Pose start;
  start.world_from_model = moved(truth(scene), FragmentFrame(), off);
  return {{"points", item(points())},
          {"views", Value::of(views, "view")},
          {"projector", Value::of<RadiographProjector>(std::make_shared<const BodyProjector>(bone()))},
          {"start", item(start)}};
}

}  // namespace

RigidTransform truth(const LandmarkScene& scene) {
  Random random(std::uint64_t(scene.seed));
  const Eigen::Vector3d turn_rad = drawn(random, 0.2), shift_mm = drawn(random, 10);
  return turn_of_world(scene) * moved_by(turn_rad, shift_mm);
}

Inputs inputs_of(const LandmarkScene& scene) { return made(scene, true); }
Inputs without_bone(const LandmarkScene& scene) { return made(scene, false); }

}  // namespace marrow::conformance
