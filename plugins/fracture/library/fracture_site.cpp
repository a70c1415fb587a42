// SPDX-License-Identifier: Apache-2.0
#include "marrow/fracture/fracture_site.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "marrow/base/error.hpp"

namespace marrow::fracture {
namespace {

using Points = std::vector<Eigen::Vector3d>;

constexpr double kReachMm = 20;

Points points_on(const Mesh& mesh) {
  constexpr std::size_t kPoints = 20000;
  return sample_surface(mesh, kPoints);
}

/// The points that may lie within reach of the others, so that few distances are computed.
Points points_near(const Points& points, const Points& others) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& other : others) box.extend(other);
  Points near;
  for (const Eigen::Vector3d& point : points)
    if (box.squaredExteriorDistance(point) < kReachMm * kReachMm) near.push_back(point);
  return near;
}

/// The mean of the points of a face.
Eigen::Vector3d centre_of_face(const Points& points, const Points& others) {
  constexpr double kRimMm = 3;
  const std::vector<double> squared = nearest_squared_mm2(points, others);
  const double farthest = std::sqrt(*std::min_element(squared.begin(), squared.end())) + kRimMm;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double count = 0;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (squared[i] <= farthest * farthest) sum += points[i], ++count;
  return sum / count;
}

}  // namespace

std::vector<double> nearest_squared_mm2(const Points& points_mm, const Points& others_mm) {
  std::vector<double> nearest;
  nearest.reserve(points_mm.size());
  for (const Eigen::Vector3d& point : points_mm) {
    double least = std::numeric_limits<double>::infinity();
    for (const Eigen::Vector3d& other : others_mm) least = std::min(least, (other - point).squaredNorm());
    nearest.push_back(least);
  }
  return nearest;
}

Eigen::Vector3d middle_of_fracture_mm(const Mesh& moved, const std::string& moved_name, const Mesh& reference,
                                      const std::string& reference_name) {
  check_mesh(moved, "the surface of '" + moved_name + "'");
  check_mesh(reference, "the surface of '" + reference_name + "'");
  const std::string both = "the surfaces of '" + moved_name + "' and '" + reference_name + "'";
  if (moved.frame != reference.frame)
    throw Error(both + " are in the frames '" + moved.frame + "' and '" + reference.frame +
                "'; both must be of one CT");
  const Points all_moved = points_on(moved), all_reference = points_on(reference);
  const Points on_moved = points_near(all_moved, all_reference), on_reference = points_near(all_reference, all_moved);
  const auto are_apart = [&] {
    const std::vector<double> squared = nearest_squared_mm2(on_moved, on_reference);
    return *std::min_element(squared.begin(), squared.end()) > kReachMm * kReachMm;
  };
  if (on_moved.empty() || on_reference.empty() || are_apart())
    throw Error(both +
                " are nowhere within 20 mm of each other in the CT, so they show no fracture between them; are they "
                "two sides of one fracture?");
  return 0.5 * (centre_of_face(on_moved, on_reference) + centre_of_face(on_reference, on_moved));
}

}  // namespace marrow::fracture
