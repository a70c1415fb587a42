// SPDX-License-Identifier: Apache-2.0
// The cost about a pose, along each of the six axes of the fragment (the chapter's Fig. 7b): shows how wide the valley
// is, where its floor lies, and which direction is poorly determined.
#include <cmath>
#include <cstdio>
#include <marrow/plugin.hpp>

#include "canvas.hpp"
#include "plot.hpp"

namespace {

using namespace marrow::render;

struct Options {
  double range_deg = 10;
  double range_mm = 10;
  int samples = 81;
};

constexpr std::array<const char*, 6> kTitles{"rotation about the frontal axis",    "rotation about the lateral axis",
                                             "rotation about the long axis",       "translation along the frontal axis",
                                             "translation along the lateral axis", "translation along the long axis"};

/// The cost along one axis; offsets in degrees for the first three axes and in mm for the others.
struct Profile {
  std::vector<double> offsets, costs;
  /// Where the cost is least; nothing where no cost is finite.
  std::optional<cv::Point2d> least;
};

Profile sample(const marrow::Cost& cost, const marrow::Pose& pose, int axis, const Options& options) {
  const double range = axis < 3 ? options.range_deg : options.range_mm;
  Profile profile;
  std::vector<marrow::RigidTransform> poses;
  for (int i = 0; i < options.samples; ++i) {
    const double offset = range * (2.0 * i / (options.samples - 1) - 1);
    marrow::Vector6d motion = marrow::Vector6d::Zero();
    motion[axis] = axis < 3 ? marrow::radians(offset) : offset;
    profile.offsets.push_back(offset);
    poses.push_back(marrow::moved(pose.world_from_model, pose.frame, motion));
  }
  profile.costs = cost.values(poses);
  for (std::size_t i = 0; i < poses.size(); ++i)
    if (std::isfinite(profile.costs[i]) && (!profile.least || profile.costs[i] < profile.least->y))
      profile.least = {profile.offsets[i], profile.costs[i]};
  return profile;
}

std::string title(int axis, const Profile& profile) {
  const std::string name = kTitles[std::size_t(axis)];
  if (!profile.least) return name + ": no finite cost";
  char text[32];
  std::snprintf(text, sizeof text, ": least at %+.2f ", profile.least->x);
  return name + text + (axis < 3 ? "deg" : "mm");
}

marrow::Picture landscape(const marrow::Cost& cost, const marrow::Pose& pose, const marrow::Truth* truth,
                          const Options& options, marrow::Context& context) {
  marrow::check_rigid(pose.world_from_model, "pose");
  constexpr int kWidth = 500, kHeight = 300;
  cv::Mat canvas(2 * kHeight, 3 * kWidth, CV_8UC3, kWhite);
  std::optional<marrow::Vector6d> to_truth;
  if (truth) to_truth = marrow::motion_between(pose.world_from_model, truth->world_from_model, pose.frame);
  for (int axis = 0; axis < 6; ++axis) {
    context.check_cancelled();
    context.progress(axis / 6.0, kTitles[std::size_t(axis)]);
    const Profile profile = sample(cost, pose, axis, options);
    Plot plot{title(axis, profile),
              axis < 3 ? "offset from the pose [deg]" : "offset from the pose [mm]",
              "cost",
              profile.offsets,
              profile.costs,
              {{0, kSkyBlue}},
              profile.least};
    if (to_truth) plot.marks.push_back({axis < 3 ? marrow::degrees((*to_truth)[axis]) : (*to_truth)[axis], kOrange});
    draw_plot(canvas, {axis % 3 * kWidth, axis / 3 * kHeight, kWidth, kHeight}, plot);
  }
  std::vector<LegendItem> legend{{"cost", kBlue}, {"pose", kSkyBlue}, {"least cost (dot)", kVermilion}};
  if (truth) legend.push_back({"truth (its part about or along this axis)", kOrange});
  return {with_legend(canvas, legend)};
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("render.landscape", landscape)
      .summary("The cost about a pose along each of the six axes of the fragment")
      .in("cost", "cost to look at")
      .in("pose", "pose in the middle of the plots; its frame gives the axes")
      .in("truth", "exact pose, marked in the plots")
      .out("picture", "six plots")
      .option("range_deg", &Options::range_deg, "rotations shown to either side", marrow::at_least(1e-3),
              marrow::at_most(180))
      .option("range_mm", &Options::range_mm, "translations shown to either side", marrow::at_least(1e-3),
              marrow::at_most(1000))
      .option("samples", &Options::samples, "points of a curve", marrow::at_least(3), marrow::at_most(2001));
}
