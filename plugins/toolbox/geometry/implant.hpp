// SPDX-License-Identifier: Apache-2.0
#pragma once
// An implant with holes for locking screws.
#include <Eigen/Core>
#include <string>
#include <vector>

#include "marrow/domain/mesh.hpp"
#include "marrow/runtime/node/types.hpp"

namespace marrow::geometry {

/// A straight hole through an implant, in the implant's frame.
struct Hole {
  std::string name;
  Eigen::Vector3d centre_mm = Eigen::Vector3d::Zero();  ///< in the middle of the implant
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();      ///< of length 1; both directions mean the same
  double diameter_mm = 5;
  using fields = Fields<&Hole::name, &Hole::centre_mm, &Hole::axis, &Hole::diameter_mm>;
};

/// A solid body of metal in a frame of its own, called "implant". The z axis of a nail runs along it, from the tip in
/// the knee upwards.
struct Implant {
  Mesh surface;  ///< closed
  std::vector<Hole> holes;
  using fields = Fields<&Implant::surface, &Implant::holes>;
};

/// Throws Error, naming `what`, unless the surface is closed and oriented outward, there is a hole, the holes have
/// different names, and each has an axis of length 1 and a diameter above 0.
void check_implant(const Implant& implant, const std::string& what);

/// The axis with length 1. Throws Error, naming `what` and the hole, if its length is 0 or not finite.
Eigen::Vector3d unit_axis(const Eigen::Vector3d& axis, const std::string& what, const std::string& hole);

}  // namespace marrow::geometry

MARROW_VALUE_TYPE(marrow::geometry::Implant, "implant", 1)
