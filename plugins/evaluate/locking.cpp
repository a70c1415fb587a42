// SPDX-License-Identifier: Apache-2.0
// Errors of a locking plan against the true pose of the nail.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <marrow/plugin.hpp>

#include "marrow/toolbox/geometry/implant.hpp"

namespace {

using namespace marrow;
using Eigen::Vector3d;

struct Options {
  double max_angle_deg = 1;
  double max_offset_mm = 0.5;
};

struct Result {
  List<Metrics> holes;
  Metrics metrics;
};

/// Angle between two lines, whatever their senses.
double angle_deg(const Vector3d& a, const Vector3d& b) {
  return degrees(std::atan2(a.cross(b).norm(), std::abs(a.dot(b))));
}

Result locking(const geometry::LockingPlan& plan, const geometry::Implant& implant, const Truth& truth,
               const Options& options) {
  geometry::check_implant(implant, "evaluate.locking");
  check_rigid(truth.world_from_model, "evaluate.locking: the true pose of the nail");
  Result result;
  double worst_deg = 0, worst_mm = 0, worst_view_deg = 0;
  bool is_flagged = false, is_off = false, is_silent = false;
  for (const auto& drill : plan.drills) {
    const auto hole = std::find_if(implant.holes.begin(), implant.holes.end(),
                                   [&](const geometry::Hole& one) { return one.name == drill.hole; });
    if (hole == implant.holes.end())
      throw Error("evaluate.locking: the plan has a drill for hole '" + drill.hole +
                  "', but the implant has no such hole; give the implant of the plan");
    const Vector3d centre = truth.world_from_model * hole->centre_mm,
                   axis = truth.world_from_model.rotation * hole->axis;
    const Vector3d off = drill.centre_mm - centre;
    const double turn = angle_deg(drill.direction, axis), offset = (off - off.dot(axis) * axis).norm();
    // The ray from the source of the planned view through the true hole.
    const Eigen::Matrix3d arm = world_from_camera_rotation(radians(drill.alpha_deg), radians(drill.beta_deg));
    const Vector3d source = plan.isocentre_mm - plan.source_to_isocentre_mm * arm.col(2);
    const double view = angle_deg(centre - source, axis);
    const bool flagged = !drill.doubts.empty(), beyond = turn > options.max_angle_deg || offset > options.max_offset_mm;
    result.holes.add(drill.hole, Metrics{{{"angle_deg", turn, "deg"},
                                          {"offset_mm", offset, "mm"},
                                          {"view_deg", view, "deg"},
                                          {"predicted_angle_deg", drill.deviation_deg, "deg"},
                                          {"predicted_offset_mm", drill.deviation_mm, "mm"},
                                          {"flagged", double(flagged), ""}}});
    worst_deg = std::max(worst_deg, turn);
    worst_mm = std::max(worst_mm, offset);
    worst_view_deg = std::max(worst_view_deg, view);
    is_flagged |= flagged;
    is_off |= beyond;
    is_silent |= beyond && !flagged;
  }
  result.metrics.items = {{"angle_deg", worst_deg, "deg"},     {"offset_mm", worst_mm, "mm"},
                          {"view_deg", worst_view_deg, "deg"}, {"flagged", double(is_flagged), ""},
                          {"off", double(is_off), ""},         {"silent", double(is_silent), ""}};
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("evaluate.locking", locking)
      .summary("Errors of a locking plan: angle and offset of each planned axis, and angle of the planned view")
      .in("plan", "plan of plan.locking")
      .in("implant", "the nail with its holes")
      .in("truth", "exact pose of the nail")
      .out("holes", &Result::holes,
           "angle between planned and true axis; distance between the axes at the hole's centre; angle between the ray "
           "of the planned view through the true hole and its axis; the predicted deviations; 1 if the plan doubts the "
           "hole",
           over("hole"))
      .figures({"angle_deg", "offset_mm", "view_deg", "predicted_angle_deg", "predicted_offset_mm", "flagged"})
      .out("metrics", &Result::metrics,
           "largest figures of all holes; 1 if the plan doubts a hole (flagged), if a hole is off by more than "
           "max_angle_deg or max_offset_mm (off), and if such a hole is not doubted by the plan (silent), else 0")
      .figures({"angle_deg", "offset_mm", "view_deg", "flagged", "off", "silent"})
      .option("max_angle_deg", &Options::max_angle_deg, "a hole is off if its axis is turned by more than this",
              at_least(0))
      .option("max_offset_mm", &Options::max_offset_mm, "a hole is off if its axis is farther away than this",
              at_least(0));
}
