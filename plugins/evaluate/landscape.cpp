// SPDX-License-Identifier: Apache-2.0
// Profiles of the cost around a pose, along each of the six axes of the fragment (Fig. 7b of the chapter). They show
// how wide the minimum is, where it lies, and which direction is poorly determined.
#include <array>
#include <marrow/plugin.hpp>

#include "marrow/toolbox/geometry/targets.hpp"

namespace {

struct Options {
  double max_rotation_deg = 10;
  double max_shift_mm = 10;
  int profile_points = 81;
};

using Axes = std::array<const char*, 6>;
constexpr Axes kOfBone{"rotation about the frontal axis",    "rotation about the lateral axis",
                       "rotation about the long axis",       "translation along the frontal axis",
                       "translation along the lateral axis", "translation along the long axis"};
constexpr Axes kOfModel{"rotation about the x axis",    "rotation about the y axis",    "rotation about the z axis",
                        "translation along the x axis", "translation along the y axis", "translation along the z axis"};

marrow::Landscape landscape(const marrow::Cost& cost, const marrow::Pose& found, const marrow::Mesh* model,
                            const marrow::Truth* truth, const Options& options, marrow::Context& context) {
  marrow::Pose pose = found;
  if (model) {
    marrow::geometry::check_model(pose.world_from_model, *model);
    pose.frame = marrow::fragment_frame(*model);
  }
  const Axes& axes = pose.frame.is_anatomical ? kOfBone : kOfModel;
  marrow::check_pose(pose, "pose");
  marrow::Landscape landscape;
  for (int axis = 0; axis < 6; ++axis) {
    context.check_cancelled();
    context.progress(axis / 6.0, axes[std::size_t(axis)]);
    const bool turns = axis < 3;
    const auto motion_of = [&](double offset) {
      marrow::Vector6d motion = marrow::Vector6d::Zero();
      motion[axis] = turns ? marrow::radians(offset) : offset;
      return motion;
    };
    marrow::Landscape::Profile profile{axes[std::size_t(axis)], turns ? "deg" : "mm", {}, {}, {}};
    std::vector<marrow::RigidTransform> poses;
    for (int i = 0; i < options.profile_points; ++i) {
      profile.offsets.push_back((turns ? options.max_rotation_deg : options.max_shift_mm) *
                                (2.0 * i / (options.profile_points - 1) - 1));
      poses.push_back(marrow::moved(pose.world_from_model, pose.frame, motion_of(profile.offsets.back())));
    }
    profile.costs = cost.values(poses);
    if (truth) {
      const double part = marrow::motion_between(pose.world_from_model, truth->world_from_model, pose.frame)[axis];
      profile.truth = turns ? marrow::degrees(part) : part;
    }
    landscape.profiles.push_back(std::move(profile));
  }
  return landscape;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("evaluate.landscape", landscape)
      .summary("Profiles of the cost around a pose, along each of the six axes of the fragment")
      .in("cost", "cost to evaluate")
      .in("pose", "pose in the middle; its frame gives the axes, unless there is a model")
      .in("model", "surface of the fragment: it gives the axes")
      .in("truth", "exact pose; its offset from the pose is noted in each profile")
      .out("landscape", "six profiles: costs at offsets from the pose, in degrees or mm")
      .option("max_rotation_deg", &Options::max_rotation_deg, "largest rotation to either side", marrow::at_least(1e-3),
              marrow::at_most(180))
      .option("max_shift_mm", &Options::max_shift_mm, "largest translation to either side", marrow::at_least(1e-3),
              marrow::at_most(1000))
      .option("profile_points", &Options::profile_points, "number of points of a profile", marrow::at_least(3),
              marrow::at_most(2001));
}
