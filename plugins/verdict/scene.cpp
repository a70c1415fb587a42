// SPDX-License-Identifier: Apache-2.0
#include "scene.hpp"

#include <algorithm>
#include <cmath>

#include "marrow/domain/random.hpp"
#include "marrow/runtime/node/types.hpp"
#include "marrow/toolbox/analytic/compass.hpp"
#include "marrow/toolbox/analytic/costs.hpp"

namespace marrow::conformance {

using namespace analytic;

namespace {

constexpr int kSize_px = 240;
constexpr double kPixel_mm = 0.8, kEdges_px = 0.4;

/// Radii and places differ, so that no turn about the long axis looks the same.
Body bone(bool is_mirrored) {
  Body body{{{0, 0, 8}, {9, 13, 32}}, {{20, -5, -22}, {8, 10, 9}}, {{-17, 7, -25}, {6, 9, 8}}};
  if (is_mirrored)
    for (Ellipsoid& one : body) one.centre_mm.x() *= -1;
  return body;
}

/// A pose that is turned and shifted by up to 10 degrees and mm.
RigidTransform truth(const Scene& scene) {
  Random random(std::uint64_t(scene.seed));
  const auto drawn = [&](double most) {
    Eigen::Vector3d vector;
    for (double& one : vector) one = most * (2 * random.uniform() - 1);
    return vector;
  };
  const Eigen::Vector3d turn_rad = drawn(radians(10)), shift_mm = drawn(10);
  return moved_by(turn_rad, shift_mm);
}

struct Drawn {
  std::string name;
  SeenBody seen;
  View view;
  EdgeMap edges;
};

/// An X-ray image of the bone without noise: what the rays pass through, in a device that darkens exponentially.
cv::Mat image_of(const Camera& camera, const RigidTransform& pose) {
  const std::vector<float> bone_mm =
      BodyProjector(bone(false)).radiograph(camera, pose, PixelGrid{0, 0, 1, kSize_px, kSize_px});
  cv::Mat pixels(kSize_px, kSize_px, CV_16U);
  std::transform(bone_mm.begin(), bone_mm.end(), pixels.begin<std::uint16_t>(),
                 [](float mm) { return std::uint16_t(std::lround(40000 * std::exp(-0.02 * double(mm)))); });
  return pixels;
}

/// Edge pixels on the outline, with errors. Their gradients point away from the bone, where the image is brighter.
EdgeMap edges_of(const Camera& camera, const RigidTransform& pose, Random& random) {
  EdgeMap map{kSize_px, kSize_px, {}};
  for (const OutlinePoint& point : BodyProjector(bone(false)).outline(camera, pose, 1))
    map.pixels.push_back({point.u_px + float(kEdges_px * random.normal()),
                          point.v_px + float(kEdges_px * random.normal()), point.normal_u, point.normal_v, 300});
  const auto place = [](const EdgePixel& e) { return std::pair(std::lround(e.v_px), std::lround(e.u_px)); };
  std::stable_sort(map.pixels.begin(), map.pixels.end(),
                   [&](const EdgePixel& a, const EdgePixel& b) { return place(a) < place(b); });
  return map;
}

/// Two views of the bone. If they are swapped, each camera has what the other one saw.
std::vector<Drawn> drawn_views(const Scene& scene) {
  const std::pair<const char*, double> views[] = {{"frontal", 0}, {"lateral", 80}};
  Random random(std::uint64_t(50 + scene.seed));
  std::vector<Drawn> drawn;
  for (std::size_t i = 0; i < 2; ++i) {
    const Camera own = c_arm(views[i].second, kSize_px, kSize_px, kPixel_mm),
                 of_image =
                     c_arm(views[scene.mistake == Mistake::swapped ? 1 - i : i].second, kSize_px, kSize_px, kPixel_mm);
    SeenBody seen_body = seen(bone(false), of_image, truth(scene), 4, 2);
    for (Eigen::Vector2d& pixel : seen_body.outline_px)
      pixel += kEdges_px * Eigen::Vector2d{random.normal(), random.normal()};
    seen_body.camera = own;
    const std::string name = views[i].first;
    drawn.push_back({name, std::move(seen_body), View{name, {image_of(of_image, truth(scene))}, own, {}},
                     edges_of(of_image, truth(scene), random)});
  }
  return drawn;
}

RigidTransform refined(const Cost& cost, const RigidTransform& from, const FragmentFrame& frame) {
  MinimisationProblem problem;
  problem.function = [&](const Eigen::VectorXd& x) { return cost.value(moved(from, frame, Vector6d(x))); };
  problem.start = Eigen::VectorXd::Zero(6);
  problem.initial_step = Eigen::VectorXd::Constant(6, 1);
  problem.initial_step.head<3>() *= radians(1);
  problem.step_tolerance = 0.02;
  return moved(from, frame, Vector6d(Compass().minimise(problem).x));
}

/// The pose after the mistake.
RigidTransform judged_pose(const Scene& scene, const Cost& cost, const FragmentFrame& frame) {
  Vector6d off = Vector6d::Zero();
  RigidTransform pose = truth(scene);
  switch (scene.mistake) {
    case Mistake::depth:
      pose.translation_mm += 5 * c_arm(0, kSize_px, kSize_px, kPixel_mm).camera_from_world.rotation.row(2).transpose();
      return pose;
    case Mistake::axial:
      off[2] = radians(8);
      return moved(pose, frame, off);
    case Mistake::along:
      off[5] = 5;
      return moved(pose, frame, off);
    case Mistake::half_turn:
      off[2] = kPi;
      break;
    default:
      break;
  }
  return refined(cost, moved(pose, frame, off), frame);
}

}  // namespace

Inputs inputs_of(const Scene& scene) {
  const Body body = bone(scene.mistake == Mistake::mirrored);
  const std::vector<Drawn> all = drawn_views(scene);
  std::vector<SeenBody> seen_bodies;
  List<View> views;
  List<EdgeMap> edges;
  for (const Drawn& one : all) {
    seen_bodies.push_back(one.seen);
    views.add(one.name, one.view);
    edges.add(one.name, one.edges);
  }
  const auto cost = std::make_shared<const RadiographCost>(body, seen_bodies);
  const Mesh model = mesh_of(body);
  Pose pose;
  pose.frame = fragment_frame(model);
  pose.world_from_model = judged_pose(scene, *cost->at_level({4, 8, 4}), pose.frame);
  Vector6d deviations;
  deviations << radians(0.2), radians(0.2), radians(0.5), 0.1, 0.1, 0.2;
  pose.covariance = deviations.cwiseAbs2().asDiagonal();
  return {{"pose", item(pose)},
          {"cost", Value::of<Cost>(cost)},
          {"contour_cost", Value::of<Cost>(std::make_shared<const OutlineCost>(body, seen_bodies))},
          {"optimizer", Value::of<Optimizer>(std::make_shared<const Compass>())},
          {"views", Value::of(views, "view")},
          {"edges", Value::of(edges, "view")},
          {"projector", Value::of<OutlineProjector>(std::make_shared<const BodyProjector>(body))},
          {"model", item(model)}};
}

}  // namespace marrow::conformance
