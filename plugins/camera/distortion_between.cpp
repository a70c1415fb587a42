// SPDX-License-Identifier: Apache-2.0
// The distortion at poses of the arm between those at which a plate was imaged.
#include <cmath>
#include <marrow/plugin.hpp>

#include "marrow/base/names.hpp"
#include "marrow/toolbox/distortion/fit.hpp"

namespace {

using namespace marrow;
using namespace marrow::distortion;

struct Options {
  std::vector<double> measured_at, measured_second_at, wanted_at, wanted_second_at;
  std::vector<std::string> names;
};

std::vector<ArmPose> poses_of(const std::vector<double>& first, const std::vector<double>& second) {
  std::vector<ArmPose> poses;
  for (std::size_t i = 0; i < first.size(); ++i) {
    poses.emplace_back(second.empty() ? 1 : 2);
    poses.back()[0] = first[i];
    if (!second.empty()) poses.back()[1] = second.at(i);
  }
  return poses;
}

std::string text_of(const ArmPose& pose) {
  return pose.size() == 1 ? formatted("{}", pose[0]) : formatted("({}, {})", pose[0], pose[1]);
}

void check_poses(const List<Distortion>& distortions, const std::vector<ArmPose>& measured, const Options& options) {
  if (distortions.size() != measured.size())
    throw Error(
        formatted("{} distortions are wired, but measured_at has {} poses; give one for each, in the same order",
                  distortions.size(), measured.size()));
  if (options.measured_second_at.empty() != options.wanted_second_at.empty())
    throw Error("measured_second_at and wanted_second_at belong together; give both or none");
  for (std::size_t i = 0; i < measured.size(); ++i)
    for (std::size_t k = 0; k < i; ++k)
      if ((measured[i] - measured[k]).norm() < 1e-9)
        throw Error(formatted("'{}' and '{}' were both measured at {}; give one distortion for each pose",
                              distortions.name(k), distortions.name(i), text_of(measured[i])));
}

List<Distortion> distortion_between(const List<Distortion>& distortions, const Options& options, Context& context) {
  const std::vector<ArmPose> measured = poses_of(options.measured_at, options.measured_second_at),
                             wanted = poses_of(options.wanted_at, options.wanted_second_at);
  check_poses(distortions, measured, options);
  List<Distortion> result;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    if (!is_between(measured, wanted[i]))
      context.warn(
          formatted("'{}' at {} lies beyond the poses that were measured; its distortion is a guess. Image the "
                    "plate there, too",
                    options.names.at(i), text_of(wanted[i])));
    check_item_name("view", options.names.at(i));
    result.add(options.names.at(i), mixed(distortions, shares_at(measured, wanted[i])));
  }
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("camera.distortion_between", distortion_between)
      .summary("Distortions at poses of the arm between those at which a plate was imaged")
      .in("distortions", "one distortion for each pose at which the plate was imaged", over("view"))
      .out("distortion", "the distortion of each view", over("view"))
      .option("measured_at", &Options::measured_at,
              "a number for each measured pose, in the order of the distortions, such as the arm's angle in degrees",
              required())
      .option("measured_second_at", &Options::measured_second_at,
              "a second number for each measured pose, if two change")
      .relation(as_many_or_none("measured_second_at", "measured_at"))
      .option("names", &Options::names, "one name per view", required())
      .relation(at_least_one({"names"}))
      .relation(distinct("names"))
      .option("wanted_at", &Options::wanted_at, "the number of each view's pose", required())
      .relation(same_length({"names", "wanted_at"}))
      .option("wanted_second_at", &Options::wanted_second_at, "the second number of each view's pose")
      .relation(as_many_or_none("wanted_second_at", "wanted_at"));
}
