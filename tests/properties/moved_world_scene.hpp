// SPDX-License-Identifier: Apache-2.0
#pragma once
// Values as they are after the world was moved, the CT got another frame or the images were cut, the numbers in which
// two values may differ, and a bone in two X-ray views, for any node that takes ordinary values. Only the definitions
// of the frames are used (docs/method.md), no node.
#include <marrow/toolbox/track/track_state.hpp>

#include "shipped.hpp"

namespace moved_world {

constexpr int kWidth_px = 385, kHeight_px = 417;  ///< of all images; every 32nd pixel stays one when they are mirrored

/// A point X of the world goes to world * X, one of the CT to ct * X, and a pixel to pixel - cut_px.
struct Change {
  std::string name;
  marrow::RigidTransform world{"world", "world"}, ct{"ct", "ct"};
  Eigen::Vector2i cut_px = Eigen::Vector2i::Zero();  ///< columns left out at the left and right, rows above and below
  bool is_mirrored = false;  ///< before: x of the world, of the CT and of the images changes its sign

  Eigen::Vector3d mirrored(Eigen::Vector3d point_mm) const {
    if (is_mirrored) point_mm.x() *= -1;
    return point_mm;
  }
  Eigen::Matrix3d mirror() const { return Eigen::Vector3d(is_mirrored ? -1 : 1, 1, 1).asDiagonal(); }
  Eigen::Vector3d in_ct(const Eigen::Vector3d& point_mm) const { return ct * mirrored(point_mm); }
};

inline marrow::RigidTransform changed(marrow::RigidTransform world_from_ct, const Change& change) {
  world_from_ct.rotation = change.mirror() * world_from_ct.rotation * change.mirror();
  world_from_ct.translation_mm = change.mirrored(world_from_ct.translation_mm);
  return change.world * world_from_ct * inverse(change.ct);
}

/// The frontal axis points to the CT's +x, and the lateral one follows as the last of a right-handed system. So of a
/// mirrored fragment the frontal axis is turned round.
inline marrow::FragmentFrame changed(marrow::FragmentFrame frame, const Change& change) {
  frame.origin_mm = change.in_ct(frame.origin_mm);
  frame.axes = change.ct.rotation * change.mirror() * frame.axes * change.mirror();
  return frame;
}
/// (r, t) along these axes: a mirrored rotation keeps its part about the axis that was turned round.
inline marrow::Vector6d changed(marrow::Vector6d motion, const Change& change) {
  if (change.is_mirrored) motion[1] *= -1, motion[2] *= -1, motion[3] *= -1;
  return motion;
}
inline marrow::Matrix6d changed(const marrow::Matrix6d& covariance, const Change& change) {
  const marrow::Vector6d sign = changed(marrow::Vector6d(marrow::Vector6d::Ones()), change);
  return sign.asDiagonal() * covariance * sign.asDiagonal();
}

inline marrow::Camera changed(marrow::Camera camera, const Change& change) {
  marrow::RigidTransform& pose = camera.camera_from_world;
  pose.rotation = change.mirror() * pose.rotation * change.mirror();
  pose.translation_mm = change.mirrored(pose.translation_mm);
  if (change.is_mirrored) camera.intrinsics(0, 2) = camera.width_px - 1 - camera.intrinsics(0, 2);
  pose = pose * inverse(change.world);
  camera.intrinsics.col(2).head<2>() -= change.cut_px.cast<double>();
  camera.width_px -= 2 * change.cut_px.x();
  camera.height_px -= 2 * change.cut_px.y();
  return camera;
}

inline marrow::View changed(marrow::View view, const Change& change) {
  view.camera = changed(view.camera, change);
  view.image.pixels = view.image.pixels.clone();  // copies of a picture share its pixels
  if (change.is_mirrored) cv::flip(view.image.pixels, view.image.pixels, 1);
  const cv::Rect kept(change.cut_px.x(), change.cut_px.y(), view.camera.width_px, view.camera.height_px);
  view.image.pixels = view.image.pixels(kept).clone();
  return view;
}

inline marrow::EdgeMap changed(const marrow::EdgeMap& edges, const Change& change) {
  marrow::EdgeMap cut{edges.width_px - 2 * change.cut_px.x(), edges.height_px - 2 * change.cut_px.y(), {}};
  for (marrow::EdgePixel edge : edges.pixels) {
    if (change.is_mirrored) edge.u_px = float(edges.width_px - 1) - edge.u_px, edge.direction_u *= -1;
    edge.u_px -= float(change.cut_px.x()), edge.v_px -= float(change.cut_px.y());
    const bool is_inside = edge.u_px >= -0.5f && edge.v_px >= -0.5f && edge.u_px < float(cut.width_px) - 0.5f &&
                           edge.v_px < float(cut.height_px) - 0.5f;
    if (is_inside) cut.pixels.push_back(edge);
  }
  std::stable_sort(cut.pixels.begin(), cut.pixels.end(), [](const auto& a, const auto& b) {
    return std::pair(std::lround(a.v_px), std::lround(a.u_px)) < std::pair(std::lround(b.v_px), std::lround(b.u_px));
  });
  return cut;
}

inline Eigen::Vector2d changed(Eigen::Vector2d pixel, const Change& change) {
  if (change.is_mirrored) pixel.x() = kWidth_px - 1 - pixel.x();
  return pixel - change.cut_px.cast<double>();
}
inline marrow::LineSegment changed(const marrow::LineSegment& segment, const Change& change) {
  return {changed(segment.from_px, change), changed(segment.to_px, change)};
}

inline marrow::ShaftLines changed(marrow::ShaftLines lines, const Change& change) {
  lines.left = changed(lines.left, change), lines.right = changed(lines.right, change);
  if (change.is_mirrored) std::swap(lines.left, lines.right);
  return lines;
}

inline marrow::Mesh changed(marrow::Mesh mesh, const Change& change) {
  for (Eigen::Vector3d& vertex : mesh.vertices_mm) vertex = change.in_ct(vertex);
  if (change.is_mirrored)
    for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  return mesh;
}

/// Voxels keep right-handed axes, so those of a mirrored grid are counted from the other side.
inline void change_grid(marrow::Grid& grid, std::vector<float>& values, const Change& change) {
  if (change.is_mirrored) {
    grid.origin_mm = grid.point_from_index({grid.size[0] - 1.0, 0, 0});
    for (auto row = values.begin(); row != values.end(); row += grid.size[0]) std::reverse(row, row + grid.size[0]);
  }
  grid.origin_mm = change.in_ct(grid.origin_mm);
  grid.direction = change.ct.rotation * change.mirror() * grid.direction * change.mirror();
}
inline marrow::Volume changed(marrow::Volume volume, const Change& change) {
  change_grid(volume.grid, volume.values, change);
  return volume;
}
inline marrow::SignedField changed(marrow::SignedField field, const Change& change) {
  change_grid(field.grid, field.values_mm, change);
  return field;
}

inline marrow::Landmarks changed(marrow::Landmarks landmarks, const Change& change) {
  for (auto& point : landmarks.points) point.model_mm = change.in_ct(point.model_mm);
  for (auto& seen : landmarks.seen) seen.pixel = changed(seen.pixel, change);
  for (auto& tracked : landmarks.tracked) tracked.world_mm = change.world * change.mirrored(tracked.world_mm);
  return landmarks;
}

inline marrow::Pose changed(marrow::Pose pose, const Change& change) {
  pose.world_from_model = changed(pose.world_from_model, change);
  pose.frame = changed(pose.frame, change);
  if (pose.covariance) pose.covariance = changed(*pose.covariance, change);  // along the fragment's own axes
  return pose;
}
inline marrow::Truth changed(marrow::Truth truth, const Change& change) {
  truth.world_from_model = changed(truth.world_from_model, change);
  return truth;
}

inline marrow::track::TrackState changed(marrow::track::TrackState state, const Change& change) {
  state.fragment = changed(state.fragment, change);
  for (auto* kinematics : {&state.now, &state.predicted}) {
    kinematics->world_from_model = changed(kinematics->world_from_model, change);
    kinematics->velocity_per_s = changed(kinematics->velocity_per_s, change);
    const marrow::Vector6d half = changed(marrow::Vector6d(marrow::Vector6d::Ones()), change);
    marrow::track::Vector12d sign;
    sign << half, half;
    kinematics->covariance = sign.asDiagonal() * kinematics->covariance * sign.asDiagonal();
  }
  if (state.measured) {
    state.measured->world_from_model = changed(state.measured->world_from_model, change);
    state.measured->covariance = changed(state.measured->covariance, change);
  }
  return state;
}
inline marrow::track::AutoscoperTrack changed(marrow::track::AutoscoperTrack track, const Change& change) {
  for (auto& pose : track.world_from_bone)
    if (pose) pose = changed(*pose, change);
  return track;
}
inline marrow::track::Trajectory changed(marrow::track::Trajectory trajectory, const Change& change) {
  for (auto& state : trajectory.states) state = changed(std::move(state), change);
  return trajectory;
}
inline marrow::track::SequenceFrame changed(marrow::track::SequenceFrame frame, const Change& change) {
  for (auto& view : frame.views) view = changed(std::move(view), change);
  return frame;
}

/// Along an axis that is turned round, offsets change their signs.
inline marrow::Landscape changed(marrow::Landscape landscape, const Change& change) {
  const marrow::Vector6d sign = changed(marrow::Vector6d(marrow::Vector6d::Ones()), change);
  for (std::size_t axis = 0; axis < landscape.profiles.size(); ++axis)
    if (sign[int(axis)] < 0) std::reverse(landscape.profiles[axis].costs.begin(), landscape.profiles[axis].costs.end());
  return landscape;
}
// What is the same in every frame.
inline marrow::Metrics changed(const marrow::Metrics& metrics, const Change&) { return metrics; }
inline marrow::Verdict changed(const marrow::Verdict& verdict, const Change&) { return verdict; }

/// A number, and the span that it may be off by a millionth of. A figure of merit may have the other sign in a mirrored
/// world. A covariance comes from blocks of the images.
struct Number {
  double value, span;
  bool is_figure = false;
  bool is_of_blocks = false;
};
using Numbers = std::vector<Number>;

/// The images of four points 100 mm apart, within a search of 10 mm.
inline void add(Numbers& numbers, const marrow::RigidTransform& world_from_ct, const marrow::FragmentFrame& frame) {
  constexpr double kSpan_mm = 10;
  for (int corner = 0; corner < 4; ++corner) {
    Eigen::Vector3d point = frame.origin_mm;
    if (corner < 3) point += 100 * frame.axes.col(corner);
    for (const double place_mm : world_from_ct* point) numbers.push_back({place_mm, kSpan_mm});
  }
}
template <class Matrix>
void add(Numbers& numbers, const Matrix& matrix) {
  const double span = matrix.cwiseAbs().maxCoeff() + 1e-12;
  for (const double one : matrix.reshaped()) numbers.push_back({one, span});
}

inline void add(Numbers& numbers, const marrow::Pose& pose) {
  add(numbers, pose.world_from_model, pose.frame);
  const std::size_t before = numbers.size();
  if (pose.covariance) add(numbers, *pose.covariance);
  for (std::size_t i = before; i < numbers.size(); ++i) numbers[i].is_of_blocks = true;
  numbers.push_back({pose.cost, std::abs(pose.cost) + 1});
}
inline void add(Numbers& numbers, const marrow::track::TrackState& state) {
  for (const auto* kinematics : {&state.now, &state.predicted}) {
    add(numbers, kinematics->world_from_model, state.fragment);
    add(numbers, kinematics->velocity_per_s);
    add(numbers, kinematics->covariance);
  }
  if (state.measured) add(numbers, state.measured->world_from_model, state.fragment);
}
inline void add(Numbers& numbers, const marrow::track::AutoscoperTrack& track) {
  for (const auto& pose : track.world_from_bone)
    if (pose) add(numbers, *pose, {});
}
inline void add(Numbers& numbers, const marrow::track::Trajectory& trajectory) {
  for (const auto& state : trajectory.states) add(numbers, state);
}
inline void add(Numbers& numbers, const marrow::track::SequenceFrame& frame) {
  for (const marrow::View& view : frame.views) add(numbers, view.camera.camera_from_world, {});
}
inline void add(Numbers& numbers, const marrow::View& view) { add(numbers, view.camera.camera_from_world, {}); }
inline void add(Numbers& numbers, const marrow::ShaftLines& lines) {
  constexpr double kImage_px = 300;
  for (const marrow::LineSegment* border : {&lines.left, &lines.right})
    for (const Eigen::Vector2d* end : {&border->from_px, &border->to_px})
      for (const double px : *end) numbers.push_back({px, kImage_px});
  for (const double one : {lines.width_mm, lines.width_deviation_mm, lines.log_likelihood})
    numbers.push_back({one, std::abs(one) + 1});
}
inline void add(Numbers& numbers, const marrow::Metrics& metrics) {
  for (const marrow::Metric& metric : metrics.items)
    numbers.push_back({metric.value, std::abs(metric.value) + 1, true});
}
inline void add(Numbers& numbers, const marrow::Landscape& landscape) {
  for (const auto& profile : landscape.profiles)
    add(numbers, Eigen::VectorXd(Eigen::Map<const Eigen::VectorXd>(profile.costs.data(), int(profile.costs.size()))));
}

/// Everything that a node may ask for, after a change.
class Scene {
 public:
  Scene(const Change& change, int views);
  /// The value for an input: by its name, else by its type. Absent if the scene has none.
  marrow::Value value_for(const marrow::PortInfo& port) const;

 private:
  void add_projectors_and_costs();

  std::map<std::string, marrow::Value> values_;  ///< by "type", "type list", "type name" and "type list name"
};

/// Poses within some degrees and mm of the true one, at which costs are compared.
std::vector<marrow::RigidTransform> poses_to_compare();

}  // namespace moved_world
