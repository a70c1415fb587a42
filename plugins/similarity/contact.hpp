// SPDX-License-Identifier: Apache-2.0
#pragma once
// What is known about a bone beside others: it does not lie in them, and the gap of a joint may be known.
#include <memory>
#include <string>
#include <vector>

#include "marrow/domain/list.hpp"
#include "marrow/domain/volume.hpp"

namespace marrow::similarity {

/// See the help texts of similarity.with_contact.
struct ContactOptions {
  double penetration_deviation_mm = 0.2;
  std::vector<std::string> joint;
  double joint_width_mm = 0;
  double joint_deviation_mm = 0.5;
};

/// Another bone: its signed field, which must outlive this, and where it is.
struct Neighbour {
  std::string name;
  const SignedField* bone = nullptr;
  RigidTransform world_from_bone;
  bool is_joined = false;  ///< whether the gap to it is known
};

/// A bone's surface among its neighbours.
class Contact {
 public:
  Contact(std::vector<Eigen::Vector3d> surface_mm, std::vector<Neighbour> neighbours, const ContactOptions& options)
      : surface_mm_(std::make_shared<const std::vector<Eigen::Vector3d>>(std::move(surface_mm))),
        neighbours_(std::move(neighbours)),
        options_(options) {}

  /// For each neighbour the penetration, and for a joined one the gap minus the joint's width, both in units of their
  /// deviations. Half the sum of their squares is minus the logarithm of a normal density, without a constant.
  std::vector<double> residuals(const RigidTransform& world_from_model) const;
  /// The same with the neighbours in other poses; one that is not in the list stays where it is.
  Contact with_others(const List<RigidTransform>& world_from_others) const;

 private:
  std::shared_ptr<const std::vector<Eigen::Vector3d>> surface_mm_;
  std::vector<Neighbour> neighbours_;
  ContactOptions options_;
};

}  // namespace marrow::similarity
