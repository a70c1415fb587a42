// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <marrow/plugin.hpp>

#include "marrow/toolbox/geometry/fragments.hpp"
#include "marrow/toolbox/geometry/targets.hpp"

namespace {

using marrow::geometry::of_fragment;

struct Options : marrow::geometry::FragmentPair {
  double border_mm = 3;
};

/// Points on the fracture: points of the moved fragment's surface that lie within `border_mm` of the other fragment in
/// the CT.
std::vector<Eigen::Vector3d> fracture_points(const marrow::Mesh& moved, const marrow::Mesh& reference,
                                             double border_mm) {
  constexpr std::size_t kPoints = 20000;
  const std::vector<Eigen::Vector3d> others = marrow::sample_surface(reference, kPoints);
  std::vector<Eigen::Vector3d> near;
  for (const Eigen::Vector3d& point : marrow::sample_surface(moved, kPoints))
    if (std::any_of(others.begin(), others.end(), [&](const Eigen::Vector3d& other) {
          return (other - point).squaredNorm() < border_mm * border_mm;
        }))
      near.push_back(point);
  return near;
}

/// Computes the reduction from the found poses and applies it to the fragment at its true pose.
marrow::Metrics reduction_gap(const marrow::List<marrow::Pose>& poses, const marrow::List<marrow::Truth>& truths,
                              const marrow::List<marrow::Mesh>& models, const Options& options) {
  const marrow::Pose &moved = of_fragment(poses, options.moved, "pose"),
                     &reference = of_fragment(poses, options.reference, "pose");
  const marrow::RigidTransform &true_moved = of_fragment(truths, options.moved, "exact pose").world_from_model,
                               &true_reference = of_fragment(truths, options.reference, "exact pose").world_from_model;
  marrow::geometry::check_poses(moved.world_from_model, true_moved);
  marrow::geometry::check_poses(reference.world_from_model, true_reference);
  const marrow::RigidTransform reduction = reference.world_from_model * marrow::inverse(moved.world_from_model);
  const marrow::RigidTransform reduced = reduction * true_moved;
  const marrow::Mesh& model = of_fragment(models, options.moved, "surface");
  const std::vector<Eigen::Vector3d> points_mm =
      fracture_points(model, of_fragment(models, options.reference, "surface"), options.border_mm);
  if (points_mm.empty())
    throw marrow::Error(
        "the surfaces of '" + options.moved + "' and '" + options.reference +
        "' are nowhere within border_mm of each other; are they the two sides of one fracture? If so, raise border_mm");
  const Eigen::Vector3d centre_mm = marrow::fragment_frame(model).origin_mm;
  const std::vector<double> before = marrow::geometry::target_errors_mm(true_moved, true_reference, points_mm),
                            after = marrow::geometry::target_errors_mm(reduced, true_reference, points_mm);
  return {
      {{"before_mm", marrow::geometry::mean(before), "mm"},
       {"gap_mm", marrow::geometry::mean(after), "mm"},
       {"largest_gap_mm", *std::max_element(after.begin(), after.end()), "mm"},
       {"rotation_deg", marrow::degrees(marrow::geodesic_angle_rad(reduced.rotation, true_reference.rotation)), "deg"},
       {"translation_mm", (reduced * centre_mm - true_reference * centre_mm).norm(), "mm"}}};
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("evaluate.reduction_gap", reduction_gap)
      .summary(
          "Remaining gap of a fracture after a reduction that is computed from the found poses and applied to the "
          "fragment at its true pose")
      .in("poses", "poses found", marrow::over("fragment"))
      .in("truths", "exact poses", marrow::over("fragment"))
      .in("models", "surfaces of both fragments", marrow::over("fragment"))
      .out("metrics",
           "for points on the fracture: mean distance from their place in the restored bone before and after the "
           "reduction, and the largest distance after it; the remaining rotation and the remaining shift of the "
           "centroid, which are the errors of the misalignment")
      .figures({"before_mm", "gap_mm", "largest_gap_mm", "rotation_deg", "translation_mm"})
      .option("moved", &Options::moved, "fragment that is moved")
      .option("reference", &Options::reference, "fragment that stays")
      .option("border_mm", &Options::border_mm,
              "points of the moved surface belong to the fracture if they are closer than this to the other surface in "
              "the CT",
              marrow::at_least(0.1));
}
