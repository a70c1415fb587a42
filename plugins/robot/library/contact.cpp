// SPDX-License-Identifier: Apache-2.0
#include "marrow/robot/contact.hpp"

namespace marrow::robot {
namespace {

constexpr double kReach_mm = 70;     // of the model to either side of the fracture
constexpr double kSlice_mm = 2;      // thickness of a slice
constexpr std::size_t kAngles = 60;  // radii in a slice
constexpr double kRaster_mm = 1;     // of the heights
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

std::size_t angle_of(const Eigen::Vector2d& from_middle) {
  const double turn = std::atan2(from_middle.y(), from_middle.x()) / (2 * kPi) + 1;
  return std::size_t(turn * double(kAngles)) % kAngles;
}

}  // namespace

Contact::Contact(const phantom::Phantom& phantom, const std::string& what) {
  if (phantom.fracture.vertices_mm.empty())
    throw Error(what + ": the phantom is of a whole bone; a broken one is needed");
  // The fracture as heights: the highest vertex in each cell of a raster. Its surface is closed far below.
  Eigen::Vector3d low = phantom.fracture.vertices_mm[0], high = low;
  for (const Eigen::Vector3d& vertex : phantom.fracture.vertices_mm)
    low = low.cwiseMin(vertex), high = high.cwiseMax(vertex);
  first_xy_ = low.head<2>();
  columns_ = int((high.x() - low.x()) / kRaster_mm) + 1, rows_ = int((high.y() - low.y()) / kRaster_mm) + 1;
  heights_.assign(std::size_t(columns_) * std::size_t(rows_), kNone);
  for (const Eigen::Vector3d& vertex : phantom.fracture.vertices_mm) {
    double& height = heights_[std::size_t((vertex.y() - low.y()) / kRaster_mm) * std::size_t(columns_) +
                              std::size_t((vertex.x() - low.x()) / kRaster_mm)];
    height = std::isnan(height) ? vertex.z() : std::max(height, vertex.z());
  }
  // The outer surface: middles of slices, then the largest radius in each angle; gaps take their neighbour's.
  double sum = 0, count = 0;
  for (const Eigen::Vector3d& vertex : phantom.bone.outer.vertices_mm)
    if (const double height = height_mm(vertex); std::abs(vertex.z() - height) < 3) sum += height, ++count;
  if (count == 0) throw Error(what + ": the phantom's fracture does not meet its bone");
  first_z_ = sum / count - kReach_mm;
  const std::size_t slices = std::size_t(2 * kReach_mm / kSlice_mm);
  std::vector<std::vector<Eigen::Vector3d>> inside(slices);
  for (const Eigen::Vector3d& vertex : phantom.bone.outer.vertices_mm)
    if (vertex.z() >= first_z_ && vertex.z() < first_z_ + 2 * kReach_mm)
      inside[std::min(slices - 1, std::size_t((vertex.z() - first_z_) / kSlice_mm))].push_back(vertex);
  for (const auto& slice : inside) {
    if (slice.empty()) throw Error(what + ": the bone's surface has no vertices near the fracture");
    Eigen::Vector2d least = slice[0].head<2>(), most = least;
    for (const Eigen::Vector3d& vertex : slice)
      least = least.cwiseMin(vertex.head<2>()), most = most.cwiseMax(vertex.head<2>());
    middles_.push_back(0.5 * (least + most));
    std::vector<double> radii(kAngles, 0);
    for (const Eigen::Vector3d& vertex : slice) {
      const Eigen::Vector2d from_middle = vertex.head<2>() - middles_.back();
      double& radius = radii[angle_of(from_middle)];
      radius = std::max(radius, from_middle.norm());
    }
    for (std::size_t i = 0; i < 2 * kAngles; ++i)
      if (radii[(i + 1) % kAngles] == 0) radii[(i + 1) % kAngles] = radii[i % kAngles];
    radii_.insert(radii_.end(), radii.begin(), radii.end());
  }
  // Points on both fragments.
  for (const auto& slice : inside)
    for (const Eigen::Vector3d& vertex : slice)
      (vertex.z() < height_mm(vertex) ? distal_ : proximal_).push_back(vertex);
  for (const Eigen::Vector3d& vertex : phantom.fracture.vertices_mm)
    if ((vertex.head<2>() - middle_at(vertex.z())).norm() < radius_mm(vertex)) {
      distal_.push_back(vertex);
      proximal_.push_back(vertex);
    }
}

Eigen::Vector2d Contact::middle_at(double z) const {
  const double slice = std::clamp((z - first_z_) / kSlice_mm, 0.0, double(middles_.size()) - 1);
  return middles_[std::size_t(slice)];
}

/// 0 beyond the model.
double Contact::radius_mm(const Eigen::Vector3d& point) const {
  const double slice = (point.z() - first_z_) / kSlice_mm;
  if (!(slice >= 0) || slice >= double(middles_.size())) return 0;
  return radii_[std::size_t(slice) * kAngles + angle_of(point.head<2>() - middles_[std::size_t(slice)])];
}

/// Not a number beyond the raster.
double Contact::height_mm(const Eigen::Vector3d& point) const {
  const Eigen::Vector2d cell = (point.head<2>() - first_xy_) / kRaster_mm;
  if (!(cell.minCoeff() >= 0) || cell.x() >= columns_ || cell.y() >= rows_) return kNone;
  return heights_[std::size_t(cell.y()) * std::size_t(columns_) + std::size_t(cell.x())];
}

double Contact::overlap_mm(const RigidTransform& bone_from_distal) const {
  double deepest = 0;
  const auto visit = [&](const std::vector<Eigen::Vector3d>& points, const RigidTransform& place, double side) {
    for (const Eigen::Vector3d& point : points) {
      const Eigen::Vector3d at = place * point;
      const double within = radius_mm(at) - (at.head<2>() - middle_at(at.z())).norm();
      if (!(within > deepest)) continue;
      const double beyond = side * (at.z() - height_mm(at));
      if (beyond > deepest) deepest = std::min(within, beyond);
    }
  };
  RigidTransform place = bone_from_distal;
  place.target = place.source = "bone";
  visit(distal_, place, 1);
  visit(proximal_, inverse(place), -1);
  return deepest;
}

}  // namespace marrow::robot
