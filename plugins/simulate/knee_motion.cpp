// SPDX-License-Identifier: Apache-2.0
// A knee that bends again and again: femur and lower leg frame by frame, for studies of following bones.

#include "marrow/simulate/knee.hpp"
#include "marrow/simulate/photograph.hpp"
#include "marrow/simulate/posture.hpp"
#include "marrow/toolbox/track/track_state.hpp"

namespace {

using namespace marrow;
using phantom::Body, phantom::ClutteredPhantom, phantom::Fragment, phantom::Posture;

struct Options {
  int frames = 100;
  double frame_rate_hz = 62;
  double period_s = 0.8;
  double flexion_deg = 60;
  double axial_deg = 10;
  double swing_deg = 8;
  double shift_mm = 8;
  std::vector<double> blank;
  bool crossing = false;
};

/// A rotation by a vector about a point, in the frame of both.
RigidTransform turned_about(const Eigen::Vector3d& point_mm, const Eigen::Vector3d& rotation_rad,
                            const std::string& frame) {
  RigidTransform turn{frame, frame};
  turn.rotation = rotation_from_vector(rotation_rad);
  turn.translation_mm = point_mm - turn.rotation * point_mm;
  return turn;
}

bool is_of_lower_leg(const Body& body) { return body.name.starts_with("tibia") || body.name.starts_with("fibula"); }

constexpr const char* kShutter = "shutter";

/// A closed shutter: steel that fills the field of view.
Body shutter() {
  constexpr double kHalf_mm = 170;
  const Eigen::Vector3d corner_mm = Eigen::Vector3d::Constant(kHalf_mm);
  return {.name = kShutter,
          .material = "steel",
          .surface = phantom::box(RigidTransform{"world", "world"}, -corner_mm, corner_mm),
          .moves_with = {}};
}

struct Motion {
  ClutteredPhantom phantom;
  List<Posture> postures;
};

/// The lower leg of the other side, at the place of this one. Only the images show it.
std::vector<Body> other_leg(const ClutteredPhantom& phantom) {
  std::vector<Body> bodies;
  for (Body body : phantom.bodies) {
    if (!is_of_lower_leg(body)) continue;
    body.name = "other " + body.name;
    body.moves_with.clear();
    body.in_ct = false;
    bodies.push_back(std::move(body));
  }
  return bodies;
}

class Knee {
 public:
  Knee(const ClutteredPhantom& phantom, const Options& options)
      : phantom_(phantom),
        options_(options),
        fragment_(phantom::distal_fragment(phantom.phantom)),
        lateral_x_(phantom::distal_end(phantom.phantom.bone.outer).lateral_x) {}

  Posture at(int frame) const {
    const double phase = 2 * kPi * frame / options_.frame_rate_hz / options_.period_s;
    const double bent = 0.5 * (1 - std::cos(phase));
    const RigidTransform world_from_bone = fragment_.world_from_bone();
    const Eigen::Vector3d knee_mm = world_from_bone * phantom::knee_axis_at(phantom_.phantom.bone.outer);
    const Eigen::Matrix3d& axes = world_from_bone.rotation;
    RigidTransform femur = turned_about(
        knee_mm, axes * turn(radians(options_.swing_deg) * Eigen::Vector3d(-bent, 0.2 * bent, 0.4 * bent)), "world");
    femur.translation_mm +=
        options_.shift_mm * Eigen::Vector3d(lateral_x_ * 0.3 * std::sin(phase), 0.5 * bent, std::sin(phase));
    const RigidTransform bend =
        turned_about(knee_mm, axes * turn({radians(options_.flexion_deg) * bent, 0, 0}), "world");
    const RigidTransform inwards =
        turned_about(knee_mm, axes * turn({0, 0, -radians(options_.axial_deg) * bent}), "world");
    const RigidTransform stays{"world", "world"}, lower_leg = femur * bend * inwards;

    Posture posture;
    for (const Fragment& fragment : phantom_.phantom.fragments)
      posture.world_from_ct.push_back((fragment.name == fragment_.name ? femur : stays) * fragment.world_from_ct);
    for (const Body& body : phantom_.bodies)
      if (body.name == kShutter)
        posture.bodies.push_back(is_blank(frame) ? std::optional(stays) : std::nullopt);
      else if (body.name.starts_with("other "))
        posture.bodies.push_back(crossing(frame));
      else
        posture.bodies.push_back(is_of_lower_leg(body) ? lower_leg : body.moves_with == fragment_.name ? femur : stays);
    return posture;
  }

 private:
  /// A rotation vector for this leg, from that of a left leg. A right leg moves as the mirror image.
  Eigen::Vector3d turn(const Eigen::Vector3d& of_left) const {
    return {of_left.x(), lateral_x_ * of_left.y(), lateral_x_ * of_left.z()};
  }

  bool is_blank(int frame) const {
    return options_.blank.size() == 2 && frame + 1 >= options_.blank[0] && frame + 1 <= options_.blank[1];
  }

  /// Where the other leg is while it swings past behind the knee.
  RigidTransform crossing(int frame) const {
    constexpr double kBehind_mm = 110, kWay_mm = 240;
    RigidTransform shift{"world", "world"};
    shift.translation_mm = {lateral_x_ * kWay_mm * (double(frame) / std::max(1, options_.frames - 1) - 0.5), kBehind_mm,
                            60};
    return shift;
  }

  const ClutteredPhantom& phantom_;
  const Options& options_;
  Fragment fragment_;
  double lateral_x_;  ///< direction of x that leads to the outer side: +1 for a left leg
};

Motion knee_motion(const ClutteredPhantom& phantom, const Options& options) {
  phantom::check_phantom(phantom, "simulate.knee_motion");
  if (!options.blank.empty() && (options.blank.size() != 2 || options.blank[0] > options.blank[1]))
    throw Error("simulate.knee_motion: 'blank' takes the first and the last blank frame, as [40, 49]");
  const std::vector<Body> other = other_leg(phantom);
  if (other.empty())
    throw Error("simulate.knee_motion: the phantom has no lower leg; add it by simulate.clutter with knee: mild");
  Motion motion{phantom, {}};
  std::vector<Body>& bodies = motion.phantom.bodies;
  if (options.crossing) bodies.insert(bodies.end(), other.begin(), other.end());
  if (!options.blank.empty()) bodies.push_back(shutter());
  const Knee knee(motion.phantom, options);
  for (int i = 0; i < options.frames; ++i) motion.postures.add(track::frame_name(std::size_t(i) + 1), knee.at(i));
  return motion;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("simulate.knee_motion", knee_motion)
      .summary("A knee that bends and stretches: the posture of the phantom in each frame of a sequence")
      .in("phantom", "femur with the lower leg of simulate.clutter")
      .out("phantom", &Motion::phantom, "the same, with the other leg and the shutter, if there are any")
      .out("postures", &Motion::postures, "where it is, frame by frame; the soft tissue keeps its place", over("frame"))
      .option("frames", &Options::frames, "number of frames", at_least(1), at_most(100000))
      .option("frame_rate_hz", &Options::frame_rate_hz, "frames a second", at_least(1e-3), unit("Hz"))
      .option("period_s", &Options::period_s, "time from stretched to bent and back", at_least(1e-3), unit("s"))
      .option("flexion_deg", &Options::flexion_deg, "largest flexion, from the knee's flexion at rest")
      .option("axial_deg", &Options::axial_deg, "internal rotation of the lower leg at the largest flexion")
      .option("swing_deg", &Options::swing_deg, "rotation of the femur at the largest flexion")
      .option("shift_mm", &Options::shift_mm, "how far the femur is shifted on its way")
      .option("blank", &Options::blank, "first and last frame that the closed shutter makes blank; none: no frame")
      .option("crossing", &Options::crossing, "whether the other leg's bones cross the field of view");
}
