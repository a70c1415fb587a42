// SPDX-License-Identifier: Apache-2.0
#include "scene.hpp"

#include <Eigen/Dense>
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
constexpr double kPixel_mm = 0.8;

Eigen::Vector3d normal(Random& random, double deviation) {
  return deviation * Eigen::Vector3d{random.normal(), random.normal(), random.normal()};
}
/// A vector of random direction that is between half as long and as long as `most`.
Eigen::Vector3d drawn(Random& random, double most) {
  return normal(random, 1).normalized() * most * (0.5 + 0.5 * random.uniform());
}

/// turned_from_world: where the world's axes and origin are after the change.
RigidTransform turn_of_world(const Scene& scene) {
  RigidTransform turn{"world", "world"};
  if (!scene.is_turned) return turn;
  turn.rotation = rotation_from_vector({1.1, -0.7, 2.0});
  turn.translation_mm = {130, -40, 75};
  return turn;
}

Camera camera_of(const Scene& scene, double angle_deg) {
  Camera camera = c_arm(angle_deg, kSize_px, kSize_px, kPixel_mm);
  camera.camera_from_world = camera.camera_from_world * inverse(turn_of_world(scene));
  return camera;
}

/// A view whose image is wide enough for the whole bone, and whose mask is where it sees the bone.
View silhouette_of(const Body& body, const RigidTransform& world_from_ct, const std::string& name, Camera camera) {
  constexpr int kWide_px = 520;
  constexpr double kWide_mm = 1.5;
  camera.intrinsics.topLeftCorner<2, 2>() *= kPixel_mm / kWide_mm;
  camera.intrinsics.topRightCorner<2, 1>().setConstant(0.5 * (kWide_px - 1));
  camera.width_px = camera.height_px = kWide_px;
  const std::vector<float> lengths_mm =
      BodyProjector(body).radiograph(camera, world_from_ct, PixelGrid{0, 0, 1, kWide_px, kWide_px});
  View view{name, {cv::Mat(kWide_px, kWide_px, CV_16U, cv::Scalar(1000))}, camera, {}};
  view.mask = cv::Mat(kWide_px, kWide_px, CV_32F, const_cast<float*>(lengths_mm.data())) > 0;
  return view;
}

/// The straight line through outline points, between the first and the last of them along the image's columns.
LineSegment line_through(const std::vector<Eigen::Vector2d>& pixels) {
  Eigen::MatrixX2d terms(Eigen::Index(pixels.size()), 2);
  Eigen::VectorXd u(Eigen::Index(pixels.size()));
  double low = kSize_px, high = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    terms.row(Eigen::Index(i)) << 1, pixels[i].y();
    u[Eigen::Index(i)] = pixels[i].x();
    low = std::min(low, pixels[i].y()), high = std::max(high, pixels[i].y());
  }
  const Eigen::Vector2d line = terms.colPivHouseholderQr().solve(u);
  return {{line[0] + line[1] * low, low}, {line[0] + line[1] * high, high}};
}

/// The borders of the shaft in the upper part of the image, where nothing lies beside it.
ShaftLines lines_of(const Scene& scene, const Camera& camera) {
  std::vector<Eigen::Vector2d> sides[2];
  for (const OutlinePoint& point : BodyProjector({bone(scene)[0]}).outline(camera, truth(scene), 2))
    if (point.v_px < 0.45 * kSize_px) sides[point.normal_u > 0].emplace_back(point.u_px, point.v_px);
  ShaftLines lines;
  lines.left = line_through(sides[1]);  // seen down the image, left is at larger u
  lines.right = line_through(sides[0]);
  lines.width_mm = 25;
  lines.width_deviation_mm = 1;
  return lines;
}

Landmarks landmarks_of(const Scene& scene, const List<View>& views, Random& random) {
  const Body body = bone(scene);
  const double side = scene.is_mirrored ? -1 : 1;
  const std::pair<const char*, Eigen::Vector3d> points[] = {
      {"lateral", body[1].centre_mm + Eigen::Vector3d(8 * side, 0, 0)},
      {"medial", body[2].centre_mm - Eigen::Vector3d(7 * side, 0, 0)},
      {"front", body[1].centre_mm - Eigen::Vector3d(0, 10, 0)},
      {"end", body[2].centre_mm - Eigen::Vector3d(0, 0, 9)},
      {"shaft", Eigen::Vector3d(0, 12, 45)}};
  Landmarks landmarks;
  for (const auto& [name, model_mm] : points) {
    const Eigen::Vector3d world_mm = truth(scene) * model_mm;
    landmarks.points.push_back({name, model_mm});
    landmarks.tracked.push_back({name, world_mm + normal(random, 0.5)});
    for (const View& view : views)
      landmarks.seen.push_back({name, view.name, project(view.camera, world_mm) + normal(random, 1).head<2>()});
  }
  return landmarks;
}

/// A placement off the truth by up to these numbers of degrees and mm, without axes.
Value placed(const Scene& scene, Random& random, double most) {
  Vector6d motion;
  motion << drawn(random, most) * radians(1), drawn(random, most);
  Pose pose;
  FragmentFrame middle;
  pose.world_from_model = moved(truth(scene), middle, motion);
  return item(pose);
}

}  // namespace

Body bone(const Scene& scene) {
  Body body{{{0, 0, 60}, {13, 12, 160}}, {{25, -6, -38}, {8, 10, 12}}, {{-22, 9, -32}, {7, 9, 9}}};
  if (scene.is_mirrored)
    for (Ellipsoid& one : body) one.centre_mm.x() *= -1;
  return body;
}

RigidTransform truth(const Scene& scene) {
  Random random(std::uint64_t(scene.seed));
  const Eigen::Vector3d turn_rad = drawn(random, 0.15), shift_mm = drawn(random, 8);
  return turn_of_world(scene) * moved_by(turn_rad, shift_mm);
}

Inputs inputs_of(const Scene& scene) {
  Random random(std::uint64_t(100 + scene.seed));
  List<View> views, silhouettes;
  List<ShaftLines> lines;
  std::vector<SeenBody> seen_bodies;
  for (const auto& [name, angle_deg] : {std::pair("frontal", 0.0), std::pair("lateral", 80.0)}) {
    const Camera camera = camera_of(scene, angle_deg);
    views.add(name, View{name, {cv::Mat(kSize_px, kSize_px, CV_16U, cv::Scalar(1000))}, camera, {}});
    silhouettes.add(name, silhouette_of(bone(scene), truth(scene), name, camera));
    lines.add(name, lines_of(scene, camera));
    seen_bodies.push_back(seen(bone(scene), camera, truth(scene), 8, 8));
  }
  return {{"model", item(mesh_of(bone(scene)))},
          {"lines", Value::of(lines, "view")},
          {"views", Value::of(views, "view")},
          {"silhouettes", Value::of(silhouettes, "view")},
          {"landmarks", item(landmarks_of(scene, views, random))},
          {"start", placed(scene, random, 8)},
          {"first", placed(scene, random, 40)},
          {"second", placed(scene, random, 6)},
          {"third", placed(scene, random, 20)},
          {"fourth", placed(scene, random, 30)},
          {"cost", Value::of<Cost>(std::make_shared<const OutlineCost>(bone(scene), seen_bodies))},
          {"optimizer", Value::of<Optimizer>(std::make_shared<const Compass>())}};
}

FreeScene free_scene(int seed) {
  Random random{std::uint64_t(seed)};
  const Body body{{{0, 0, 0}, {16, 12, 30}}, {{26, 4, 18}, {7, 8, 11}}, {{-20, -16, -14}, {9, 6, 7}}};
  FreeScene scene;
  scene.truth = moved_by(drawn(random, 3.1), drawn(random, 25));
  List<View> views;
  List<EdgeMap> edges;
  std::vector<SeenBody> seen_bodies;
  for (const auto& [name, angle_deg] : {std::pair("frontal", 0.0), std::pair("lateral", 80.0)}) {
    const Camera camera = camera_of({}, angle_deg);
    views.add(name, View{name, {cv::Mat(kSize_px, kSize_px, CV_16U, cv::Scalar(1000))}, camera, {}});
    EdgeMap map{kSize_px, kSize_px, {}};
    for (const OutlinePoint& p : BodyProjector(body).outline(camera, scene.truth, 1))
      map.pixels.push_back({p.u_px, p.v_px, p.normal_u, p.normal_v, 10});
    edges.add(name, map);
    seen_bodies.push_back(seen(body, camera, scene.truth, 8, 8));
  }
  scene.inputs = {{"model", item(mesh_of(body))},
                  {"views", Value::of(views, "view")},
                  {"edges", Value::of(edges, "view")},
                  {"projector", Value::of<OutlineProjector>(std::make_shared<const BodyProjector>(body))},
                  {"cost", Value::of<Cost>(std::make_shared<const OutlineCost>(body, seen_bodies))},
                  {"optimizer", Value::of<Optimizer>(std::make_shared<const Compass>())}};
  return scene;
}

}  // namespace marrow::conformance
