// SPDX-License-Identifier: Apache-2.0
#include "tests/properties/moved_world_scene.hpp"

namespace moved_world {
namespace {

using marrow::EdgeMap, marrow::List, marrow::Pose, marrow::RigidTransform, marrow::View;

constexpr double kRadius_mm = 11;

RigidTransform posed(const Eigen::Vector3d& turn_rad, const Eigen::Vector3d& shift_mm) {
  return {"world", "ct", marrow::rotation_from_vector(turn_rad), shift_mm};
}
RigidTransform truth() { return posed({0.15, -0.1, 0.4}, {12, -18, 25}); }

/// A rod along z with bumps, which has no symmetry.
double distance_mm(const Eigen::Vector3d& p) {
  const auto ball = [&](double x, double y, double z, double radius) {
    return (p - Eigen::Vector3d(x, y, z)).norm() - radius;
  };
  const Eigen::Vector3d on_axis(0, 0, std::clamp(p.z(), -45.0, 45.0));
  return std::clamp(
      std::min({(p - on_axis).norm() - kRadius_mm, ball(10, 4, -42, 11), ball(-9, -6, -38, 8), ball(6, -5, 46, 8)}),
      -6.0, 6.0);
}

marrow::Grid grid() {
  marrow::Grid grid;
  grid.size = {46, 40, 104};
  grid.spacing_mm = {1.17, 1.19, 1.21};
  grid.origin_mm = {-25, -23, -62};
  return grid;
}

marrow::SignedField field() {
  marrow::SignedField field{grid(), {}};
  for (int z = 0; z < field.grid.size[2]; ++z)
    for (int y = 0; y < field.grid.size[1]; ++y)
      for (int x = 0; x < field.grid.size[0]; ++x)
        field.values_mm.push_back(float(distance_mm(field.grid.point_from_index({double(x), double(y), double(z)}))));
  return field;
}

/// A wall 3 to 5 mm thick about marrow, in air.
marrow::Volume volume_of(const marrow::SignedField& field) {
  marrow::Volume volume{field.grid, {}};
  for (const float d : field.values_mm)
    volume.values.push_back(d > 1 ? -1000.0f : d > -4 ? std::min(1400.0f, 200.0f - 800 * d) : 300.0f);
  return volume;
}

marrow::Camera camera(int number) {
  const marrow::CArm arm{kWidth_px, kHeight_px, {1.0, 1.0}, 1000, 600, Eigen::Vector3d::Zero()};
  Eigen::Matrix3d world_from_camera;
  world_from_camera << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  return marrow::carm_camera(arm, marrow::rotation_from_vector({0, 0, 1.4 * number}) * world_from_camera);
}

/// The bone at its true pose in tissue that gets thicker to one side, in 16 bits.
View view_of(const std::string& name, const marrow::Camera& camera, const marrow::RadiographProjector& projector) {
  View view{name, {}, camera, {}};
  const std::vector<float> bone =
      projector.radiograph(camera, truth(), marrow::PixelGrid{0, 0, 1, camera.width_px, camera.height_px});
  view.image.pixels.create(camera.height_px, camera.width_px, CV_16U);
  for (int v = 0; v < camera.height_px; ++v)
    for (int u = 0; u < camera.width_px; ++u) {
      const double water_mm =
          bone[std::size_t(v * camera.width_px + u)] + 60 + 0.05 * std::abs(u - 120) + 0.03 * std::abs(v - 200);
      view.image.pixels.at<std::uint16_t>(v, u) = std::uint16_t(60000 * std::exp(-0.02 * water_mm));
    }
  return view;
}

/// To 1/64 px, so that a shift by whole pixels changes no digit of a position; none in the parts that are cut off.
EdgeMap edges_of(const View& view) {
  EdgeMap edges = shipped::output<EdgeMap>("edges.canny", "edges", {{"view", shipped::item(view)}});
  constexpr float kRim_px = 40;
  std::erase_if(edges.pixels, [&](const marrow::EdgePixel& edge) {
    return std::min({edge.u_px, edge.v_px, kWidth_px - edge.u_px, kHeight_px - edge.v_px}) < kRim_px;
  });
  for (marrow::EdgePixel& edge : edges.pixels)
    for (float* px : {&edge.u_px, &edge.v_px}) *px = std::round(*px * 64) / 64;
  return edges;
}

/// The borders of the rod, where planes along its axis through the source nearly touch it.
marrow::ShaftLines lines_of(const marrow::Camera& camera) {
  const RigidTransform pose = truth();
  const Eigen::Vector3d across =
      kRadius_mm * pose.rotation.col(2).cross(pose.translation_mm - source_position_mm(camera)).normalized();
  const auto pixel = [&](double z, double side) {
    return project(camera, pose * Eigen::Vector3d(0, 0, z) + side * across);
  };
  marrow::ShaftLines lines;
  lines.left = {pixel(20, 1), pixel(-20, 1)}, lines.right = {pixel(20, -1), pixel(-20, -1)};
  const Eigen::Vector2d along = lines.left.to_px - lines.left.from_px,
                        between = lines.left.from_px - lines.right.from_px;
  if (along.x() * between.y() - along.y() * between.x() > 0) std::swap(lines.left, lines.right);
  lines.width_mm = 2 * kRadius_mm, lines.width_deviation_mm = 1;
  return lines;
}

Pose pose_of(const marrow::Mesh& mesh, const Eigen::Vector3d& turn_deg, const Eigen::Vector3d& shift_mm) {
  Pose pose;
  pose.frame = marrow::fragment_frame(mesh);
  marrow::Vector6d motion;
  motion << turn_deg * (marrow::kPi / 180), shift_mm;
  pose.world_from_model = moved(truth(), pose.frame, motion);
  marrow::Vector6d variance;
  variance << 1e-4, 2e-4, 9e-4, 0.25, 0.5, 1;
  pose.covariance = variance.asDiagonal();
  return pose;
}

marrow::Landmarks landmarks_of(const marrow::Mesh& mesh, const List<View>& views) {
  marrow::Landmarks landmarks;
  for (int i = 0; i < 7; ++i) {
    const std::string name = "point " + std::to_string(i);
    const Eigen::Vector3d point = mesh.vertices_mm[mesh.vertices_mm.size() * std::size_t(i) / 7];
    const Eigen::Vector3d off(0.3 * std::sin(3 * i), 0.3 * std::cos(5 * i), 0.2 * std::sin(7 * i + 1));
    landmarks.points.push_back({name, point});
    landmarks.tracked.push_back({name, truth() * point + off});
    for (const View& view : views)
      landmarks.seen.push_back({name, view.name, project(view.camera, truth() * point) + off.head<2>()});
  }
  return landmarks;
}

/// A bone that turns and drifts, seen in each of four frames.
List<marrow::track::TrackState> states_of(const marrow::Mesh& mesh, double side) {
  List<marrow::track::TrackState> states;
  for (int i = 0; i < 4; ++i) {
    marrow::track::TrackState state;
    state.frame = i;
    state.frame_rate_hz = 30;
    state.acceleration_per_s2 << 30, 30, 30, 4000, 4000, 4000;
    const Pose now = pose_of(mesh, {1.0 * i, side - 0.5 * i, 2.0 * i}, {2.0 * i, side, 3.0 - i}),
               before = pose_of(mesh, {1.0 * i, side, 2.1 * i}, {2.1 * i, side, 3.0 - i});
    state.fragment = now.frame;
    state.now.world_from_model = now.world_from_model;
    state.now.velocity_per_s << 0.3, -0.2, 0.6, 60, 0, -30;
    state.now.covariance *= 0.01;
    state.predicted = state.now;
    state.predicted.world_from_model = before.world_from_model;
    state.measured = marrow::track::Measurement{now.world_from_model, *now.covariance};
    state.usual_cost = 1;
    states.add(marrow::track::frame_name(std::size_t(i)), state);
  }
  return states;
}

marrow::Mesh in_world(marrow::Mesh mesh, const RigidTransform& world_from_ct) {
  for (Eigen::Vector3d& vertex : mesh.vertices_mm) vertex = world_from_ct * vertex;
  mesh.frame = "world";
  return mesh;
}

template <class T>
marrow::Value changed_item(const T& value, const Change& change) {
  return shipped::item(changed(value, change));
}
template <class T>
marrow::Value changed_list(const List<T>& values, const Change& change, const std::string& axis) {
  List<T> all;
  for (std::size_t i = 0; i < values.size(); ++i) all.add(values.name(i), changed(values[i], change));
  return shipped::list(all, axis);
}

/// What does not depend on the change, made once: it takes the longest.
struct Base {
  marrow::SignedField field = moved_world::field();
  marrow::Volume volume = volume_of(field);
  marrow::Mesh mesh = shipped::output<marrow::Mesh>("mesh.marching_cubes", "mesh", {{"field", shipped::item(field)}});
  List<View> views;
  List<EdgeMap> edges;
  List<marrow::ShaftLines> lines;

  Base() {
    const shipped::Inputs inputs{{"volume", shipped::item(volume)}};
    const marrow::Value projector = shipped::call("project.joseph", inputs).at("projector");
    for (const std::string name : {"frontal", "lateral"}) {
      const marrow::Camera device = camera(int(views.size()));
      views.add(name, view_of(name, device, projector.as<marrow::RadiographProjector>()));
      edges.add(name, edges_of(views[views.size() - 1]));
      lines.add(name, lines_of(device));
    }
  }
};
const Base& base() {
  static const Base made;
  return made;
}

template <class T>
List<T> first_of(const List<T>& all, int count) {
  List<T> some;
  for (std::size_t i = 0; i < std::size_t(count); ++i) some.add_shared(all.name(i), all.shared(i));
  return some;
}

}  // namespace

Scene::Scene(const Change& change, int view_count) {
  const marrow::Mesh& mesh = base().mesh;
  const List<View> views = first_of(base().views, view_count);
  const Pose near = pose_of(mesh, {1.5, -1, 3}, {1, -1.2, 2}), prior = pose_of(mesh, {-0.5, 0.5, 1}, {0.5, 0, -0.5}),
             other = pose_of(mesh, {-6, 4, 9}, {5, 7, 30});
  const auto both = [](const auto& one, const auto& two) {
    List<std::remove_cvref_t<decltype(one)>> list;
    list.add("proximal", one);
    list.add("distal", two);
    return list;
  };
  const auto states = states_of(mesh, 0), others = states_of(mesh, 6);
  marrow::track::AutoscoperTrack keyframes;
  for (const auto& state : states) keyframes.world_from_bone.push_back(state.now.world_from_model);
  keyframes.world_from_bone[1].reset();

  values_["view"] = changed_item(views[0], change);
  values_["view list"] = changed_list(views, change, "view");
  values_["edge_map"] = changed_item(base().edges[0], change);
  values_["edge_map list"] = changed_list(first_of(base().edges, view_count), change, "view");
  values_["shaft_lines"] = changed_item(base().lines[0], change);
  values_["shaft_lines list"] = changed_list(first_of(base().lines, view_count), change, "view");
  values_["mesh"] = changed_item(mesh, change);
  values_["mesh list"] = changed_list(both(mesh, mesh), change, "fragment");
  values_["volume"] = changed_item(base().volume, change);
  values_["signed_field"] = changed_item(base().field, change);
  values_["landmarks"] = changed_item(landmarks_of(mesh, views), change);
  values_["pose"] = changed_item(near, change);
  values_["pose prior"] = values_["pose reference"] = values_["pose first"] = changed_item(prior, change);
  values_["pose list"] = changed_list(both(near, other), change, "fragment");
  values_["truth"] = changed_item(marrow::Truth{truth()}, change);
  values_["truth list"] =
      changed_list(both(marrow::Truth{truth()}, marrow::Truth{other.world_from_model}), change, "fragment");
  values_["track_state"] = changed_item(states[2], change);
  values_["track_state list"] = changed_list(states, change, "frame");
  values_["track_state list distal"] = changed_list(others, change, "frame");
  values_["autoscoper_track"] = changed_item(keyframes, change);
  marrow::track::SequenceFrame frame;
  for (const View& view : views) frame.views.push_back(view);
  values_["sequence_frame"] = changed_item(frame, change);
  // A surface in the world is moved with it, and does not know of the CT.
  Change of_world;
  of_world.is_mirrored = change.is_mirrored;
  of_world.ct = change.world;
  values_["mesh target"] = changed_item(in_world(mesh, truth()), of_world);
  marrow::Mesh reference = mesh;
  for (Eigen::Vector3d& vertex : reference.vertices_mm) vertex = 1.02 * vertex + Eigen::Vector3d(0.3, -0.2, 0.1);
  values_["mesh reference"] = changed_item(reference, change);
  add_projectors_and_costs();
}

void Scene::add_projectors_and_costs() {
  const auto made = [&](const std::string& node, const std::vector<std::pair<std::string, std::string>>& wires,
                        const std::string& output) {
    shipped::Inputs inputs;
    for (const auto& [port, value] : wires) inputs[port] = values_.at(value);
    return shipped::call(node, inputs).at(output);
  };
  values_["radiograph_projector"] = made("project.joseph", {{"volume", "volume"}}, "projector");
  values_["outline_projector"] =
      made("project.silhouette_edges", {{"model", "mesh"}, {"volume", "volume"}}, "projector");
  values_["cost"] =
      made("similarity.contour_distance",
           {{"projector", "outline_projector"}, {"views", "view list"}, {"edges", "edge_map list"}}, "cost");
  values_["optimizer"] = made("optimizer.bobyqa", {}, "optimizer");
}

marrow::Value Scene::value_for(const marrow::PortInfo& port) const {
  const std::string type = port.type.id + (port.axis.empty() ? "" : " list");
  for (const std::string& key : {type + " " + port.name, type})
    if (const auto found = values_.find(key); found != values_.end()) return found->second;
  return {};
}

std::vector<RigidTransform> poses_to_compare() {
  std::vector<RigidTransform> poses{truth()};
  for (int axis = 0; axis < 6; ++axis) {
    marrow::Vector6d motion = marrow::Vector6d::Zero();
    motion[axis] = axis < 3 ? 0.05 : -2.5;
    poses.push_back(moved(truth(), marrow::fragment_frame(base().mesh), motion));
  }
  return poses;
}

}  // namespace moved_world
