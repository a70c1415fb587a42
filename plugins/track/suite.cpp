// SPDX-License-Identifier: Apache-2.0
// Checks for nodes that follow a bone. A bone moves smoothly, or not at all, and its pose is measured in each frame
// with noise of a known deviation. A node that gives a pose for each frame must know the bone no worse than the
// measurements do. It takes the measured poses themselves, or the states of a filter that saw them, or it is such a
// filter.
#include <algorithm>
#include <cmath>
#include <marrow/plugin.hpp>

#include "marrow/domain/random.hpp"
#include "marrow/toolbox/track/motion_model.hpp"

namespace marrow::conformance {
namespace {

using track::TrackState;

constexpr int kFrames = 40;
constexpr double kRate_hz = 60, kNoise_deg = 0.4, kNoise_mm = 0.4;

FragmentFrame fragment() {
  FragmentFrame frame;
  frame.origin_mm = {5, -3, 20};
  return frame;
}

/// The mean distance of the corners of a cube about the fragment.
double apart_mm(const RigidTransform& one, const RigidTransform& other) {
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d side(corner & 1 ? 30 : -30, corner & 2 ? 30 : -30, corner & 4 ? 30 : -30);
    const Eigen::Vector3d point = fragment().origin_mm + side;
    sum += (one * point - other * point).norm() / 8;
  }
  return sum;
}

/// What a sequence shows: where the bone is, and where it was measured in the frames in which it was found.
struct Sequence {
  std::vector<RigidTransform> truth;
  std::vector<std::optional<RigidTransform>> measured;
};

RigidTransform place_of(double moves, int frame) {
  const double phase = moves * M_PI * frame / (1.5 * kRate_hz);
  Vector6d motion;
  motion << 0.05 * std::sin(phase), 0, 0.3 * std::sin(phase), 10 * std::sin(phase), 0, 4 * (std::cos(phase) - 1);
  RigidTransform middle{"world", "ct", rotation_from_vector({0.3, -0.2, 0.5}), {10, 20, -30}};
  return moved(middle, fragment(), motion);
}

/// `moves`: 0 for a still bone, 1 for one that moves. `noise`: a factor on the deviations.
Sequence sequence(double moves, double noise, std::uint64_t seed) {
  Random random(seed);
  Sequence result;
  for (int i = 0; i < kFrames; ++i) {
    result.truth.push_back(place_of(moves, i));
    Vector6d error;
    for (int k = 0; k < 6; ++k) error[k] = noise * random.normal() * (k < 3 ? radians(kNoise_deg) : kNoise_mm);
    result.measured.emplace_back(moved(result.truth.back(), fragment(), error));
  }
  return result;
}

Matrix6d covariance() {
  Vector6d deviation;
  deviation << Eigen::Vector3d::Constant(radians(kNoise_deg)), Eigen::Vector3d::Constant(kNoise_mm);
  return deviation.cwiseAbs2().asDiagonal();
}

Pose pose_at(const RigidTransform& world_from_model) {
  Pose pose;
  pose.world_from_model = world_from_model;
  pose.frame = fragment();
  pose.covariance = covariance();
  pose.cost = 1;
  return pose;
}

TrackState before_first(const RigidTransform& near) {
  TrackState state;
  state.frame_rate_hz = kRate_hz;
  state.acceleration_per_s2 << Eigen::Vector3d::Constant(radians(400)), Eigen::Vector3d::Constant(400);
  state.fragment = fragment();
  state.now.world_from_model = near;
  track::Vector12d deviation;
  deviation << Eigen::Vector3d::Constant(radians(3)), Eigen::Vector3d::Constant(3),
      Eigen::Vector3d::Constant(radians(60)), Eigen::Vector3d::Constant(60);
  state.now.covariance = deviation.cwiseAbs2().asDiagonal();
  state.predicted = state.now;
  return state;
}

/// The states of a filter; a pose that is far from the prediction counts as lost.
List<TrackState> states_of(const Sequence& seen) {
  constexpr double kGate = 38;
  List<TrackState> states;
  TrackState state = before_first(seen.truth[0]);
  for (std::size_t i = 0; i < seen.truth.size(); ++i) {
    state = track::predicted(state);
    const bool is_found = seen.measured[i].has_value();
    if (is_found && track::surprise(state, {*seen.measured[i], covariance()}) <= kGate)
      state = track::updated(state, {*seen.measured[i], covariance()});
    else
      ++state.frames_lost;
    states.add(track::frame_name(i + 1), state);
  }
  return states;
}

List<Pose> poses_of(const Sequence& seen) {
  List<Pose> poses;
  for (std::size_t i = 0; i < seen.measured.size(); ++i)
    if (seen.measured[i]) poses.add(track::frame_name(i + 1), pose_at(*seen.measured[i]));
  return poses;
}

/// A tetrahedron about the fragment, for nodes that take its axes from a surface.
Mesh model() {
  Mesh mesh;
  mesh.vertices_mm = {{5, -3, 60}, {15, -3, -20}, {0, 5, -20}, {0, -12, -20}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}};
  return mesh;
}

Inputs inputs_of(const Sequence& seen) {
  const List<TrackState> states = states_of(seen);
  View view;
  view.name = "frontal";
  const Value of_states = Value::of<TrackState>(states, "frame");
  return {{"states", of_states},
          {"proximal", of_states},
          {"distal", of_states},
          {"poses", Value::of<Pose>(poses_of(seen), "frame")},
          {"state", item(track::predicted(before_first(seen.truth[0])))},
          {"pose", item(pose_at(seen.measured[0].value_or(seen.truth[0])))},
          {"start", item(pose_at(seen.truth[0]))},
          {"model", item(model())},
          {"frame", item(track::SequenceFrame{{view}})}};
}
Inputs sample() { return inputs_of(sequence(1, 1, 1)); }

void check_one(const Value& value) {
  if (value.type.id == "pose") check_pose(value.as<Pose>(), "a pose");
  if (value.type.id == "track_state") {
    const track::Kinematics& now = value.as<TrackState>().now;
    check_rigid(now.world_from_model, "the pose of a state");
    expect(now.velocity_per_s.allFinite() && now.covariance.allFinite(), "a state is not finite");
  }
  if (value.type.id == "metrics")
    for (const Metric& figure : value.as<Metrics>().items)
      expect(std::isfinite(figure.value), "its figure " + figure.name + " is not finite");
}

/// Poses and states are rigid and finite; of a list over frames, each has the name of its frame.
void validate(const Inputs& inputs, const std::vector<PortInfo>& ports, const std::vector<Value>& outputs) {
  for (std::size_t i = 0; i < outputs.size(); ++i) try {
      expect(ports[i].optional || !outputs[i].is_absent(), "it does not give '" + ports[i].name + "'");
      if (!outputs[i].is_list() && outputs[i].data) check_one(outputs[i]);
      for (const Value& one : outputs[i].items) check_one(one);
      if (ports[i].axis == "frame")
        expect(outputs[i].names == inputs.at("states").names || outputs[i].names == inputs.at("poses").names,
               "the frames of '" + ports[i].name + "' are not those of its input");
    } catch (const Failure&) {
      throw;
    } catch (const Error& fault) {
      throw Failure(fault.what());
    }
}

const PortInfo* port_of(const std::vector<PortInfo>& ports, const std::string& name, const std::string& axis) {
  for (const PortInfo& port : ports)
    if (port.name == name && port.axis == axis) return &port;
  return nullptr;
}

/// The states and poses of a node that takes one frame after the other.
List<Pose> filtered(const Subject& subject, const Sequence& seen) {
  TrackState state = before_first(seen.truth[0]);
  List<Pose> poses;
  for (std::size_t i = 0; i < seen.measured.size(); ++i) {
    Inputs inputs{{"state", item(track::predicted(state))}};
    if (seen.measured[i]) inputs.set("pose", item(pose_at(*seen.measured[i])));
    state = subject.output(inputs, "state").as<TrackState>();
    poses.add(track::frame_name(i + 1), subject.output(inputs, "pose").as<Pose>());
  }
  return poses;
}

/// The poses that a node gives for the frames.
List<Pose> followed(const Subject& subject, const Sequence& seen) {
  const std::vector<PortInfo>&takes = subject.info().inputs, &gives = subject.info().outputs;
  if (port_of(gives, "poses", "frame") && (port_of(takes, "states", "frame") || port_of(takes, "poses", "frame")))
    return subject.output(inputs_of(seen), "poses").as_list<Pose>();
  if (port_of(takes, "state", "") && port_of(takes, "pose", "") && port_of(gives, "state", "") &&
      port_of(gives, "pose", ""))
    return filtered(subject, seen);
  throw NotApplicable("it does not make poses of frames from measured ones");
}

std::size_t number_of(const std::string& frame) { return std::size_t(std::stoi(frame)) - 1; }

/// The root of the mean square distance from the truth, in mm, of all frames but `without`.
double rms_mm(const List<Pose>& poses, const Sequence& seen, std::size_t without = kFrames) {
  double sum = 0, count = 0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const std::size_t frame = number_of(poses.name(i));
    if (frame == without) continue;
    const double apart = apart_mm(poses[i].world_from_model, seen.truth.at(frame));
    sum += apart * apart;
    ++count;
  }
  return std::sqrt(sum / count);
}

/// The error of the node's poses over five drawn sequences, in percent of that of the measured ones.
double error_percent(const Subject& subject, double moves) {
  double found = 0, measured = 0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Sequence seen = sequence(moves, 1, seed);
    found += std::pow(rms_mm(followed(subject, seen), seen), 2);
    measured += std::pow(rms_mm(poses_of(seen), seen), 2);
  }
  return 100 * std::sqrt(found / measured);
}

/// The farthest way from the place of a still bone that is measured without an error.
double still_mm(const Subject& subject) {
  const Sequence seen = sequence(0, 0, 1);
  double farthest = 0;
  for (const Pose& pose : followed(subject, seen))
    farthest = std::max(farthest, apart_mm(pose.world_from_model, seen.truth[0]));
  return farthest;
}

double gap_mm(const Subject& subject) {
  Sequence seen = sequence(1, 1, 7);
  for (std::size_t i = 18; i < 22; ++i) seen.measured[i].reset();
  return rms_mm(followed(subject, seen), seen);
}

double outlier_mm(const Subject& subject) {
  constexpr std::size_t kWrong = 20;
  Sequence seen = sequence(1, 1, 8);
  Vector6d off;
  off << radians(8), 0, radians(-8), 12, -12, 12;
  seen.measured[kWrong] = moved(seen.truth[kWrong], fragment(), off);
  return rms_mm(followed(subject, seen), seen, kWrong);
}

RigidTransform other_world() { return {"world", "world", rotation_from_vector({0.4, 1.1, -0.7}), {150, -200, 90}}; }

/// How far the poses of a moved world are from the moved poses, at most.
double moved_world_mm(const Subject& subject) {
  const Sequence seen = sequence(1, 1, 9);
  Sequence moved = seen;
  for (RigidTransform& one : moved.truth) one = other_world() * one;
  for (std::optional<RigidTransform>& one : moved.measured) one = other_world() * *one;
  const List<Pose> poses = followed(subject, seen), others = followed(subject, moved);
  double farthest = 0;
  for (std::size_t i = 0; i < poses.size(); ++i)
    farthest = std::max(farthest, apart_mm(other_world() * poses[i].world_from_model, others[i].world_from_model));
  return farthest;
}

/// How far the poses of the same frames in the opposite order are from the poses, at most.
double reversed_mm(const Subject& subject) {
  if (!port_of(subject.info().outputs, "poses", "frame")) throw NotApplicable("it does not see all frames at once");
  const Sequence seen = sequence(1, 1, 10);
  Sequence reversed = seen;
  std::reverse(reversed.truth.begin(), reversed.truth.end());
  std::reverse(reversed.measured.begin(), reversed.measured.end());
  const List<Pose> poses = followed(subject, seen), others = followed(subject, reversed);
  double farthest = 0;
  for (std::size_t i = 0; i < poses.size(); ++i)
    farthest = std::max(farthest, apart_mm(poses[i].world_from_model, others[poses.size() - 1 - i].world_from_model));
  return farthest;
}

std::vector<Trial> trials() {
  const auto with_sequence = [](const std::function<void(Sequence&)>& change) {
    return [change] {
      Sequence seen = sequence(1, 1, 1);
      change(seen);
      return inputs_of(seen);
    };
  };
  const auto with_pose = [](const std::function<void(Pose&)>& change) {
    return [change] {
      Inputs inputs = sample();
      Pose pose = inputs.at("pose").as<Pose>();
      change(pose);
      List<Pose> poses = inputs.at("poses").as_list<Pose>(), changed;
      for (std::size_t i = 0; i < poses.size(); ++i) changed.add(poses.name(i), i == 3 ? pose : poses[i]);
      for (const char* port : {"pose", "start"}) inputs.set(port, item(pose));
      inputs.set("poses", Value::of<Pose>(changed, "frame"));
      return inputs;
    };
  };
  return {{"one_frame", with_sequence([](Sequence& seen) { seen.truth.resize(1), seen.measured.resize(1); })},
          {"always_lost", with_sequence([](Sequence& seen) { seen.measured.assign(kFrames, std::nullopt); })},
          {"nan_pose", with_pose([](Pose& pose) { pose.world_from_model.translation_mm.x() = std::nan(""); })},
          {"not_rigid", with_pose([](Pose& pose) { pose.world_from_model.rotation *= 2; })},
          {"deviations_of_0", with_pose([](Pose& pose) { pose.covariance = Matrix6d(Matrix6d::Zero()); })},
          {"no_deviations", with_pose([](Pose& pose) { pose.covariance.reset(); })}};
}

Suite track_suite() {
  Suite suite{sample, validate, trials(), {}};
  const std::string of = "40 frames, noise of 0.4 degrees and mm: ";
  suite.accuracy = {
      {{"no_worse", of + "error of the poses, in percent of that of the measured ones", 100, "%"},
       [](const Subject& subject) { return error_percent(subject, 1); }},
      {{"still_no_worse", of + "the same for a still bone", 100, "%"},
       [](const Subject& subject) { return error_percent(subject, 0); }},
      {{"still", "largest shift of a still bone that is measured exactly", 0.01, "mm"}, still_mm},
      {{"gap", of + "error, where the bone is lost in 4 frames", 1.2, "mm"}, gap_mm},
      {{"outlier", of + "error in the other frames, where one pose is 20 mm off", 1.1, "mm"}, outlier_mm},
      {{"moved_world", of + "largest change, if the world is turned and moved", 1e-6, "mm"}, moved_world_mm},
      {{"reversed", of + "largest change, if the frames come in the opposite order", 1.2, "mm"}, reversed_mm}};
  return suite;
}

}  // namespace
}  // namespace marrow::conformance

MARROW_PLUGIN(plugin) { plugin.suite("track", marrow::conformance::track_suite()); }
