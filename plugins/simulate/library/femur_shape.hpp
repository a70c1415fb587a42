// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>

#include "marrow/simulate/shape_functions.hpp"

namespace marrow::phantom {

/// Parameters of a femur. Defaults are means from the literature. Anteversion: the angle between the neck's axis and
/// the line that touches both condyles at the back, seen along the shaft. Bicondylar width: across both condyles and
/// epicondyles, along this line.
struct FemurShape {
  double length_mm = 446;
  double head_diameter_mm = 46.6;
  double neck_length_mm = 50;  ///< from the shaft's axis to the head's centre
  double neck_shaft_rad = 122 * 3.14159265358979323846 / 180;
  double anteversion_rad = 14 * 3.14159265358979323846 / 180;
  double bow_radius_mm = 930;
  double bicondylar_width_mm = 82;
  double shaft_ml_mm = 28;
  double shaft_ap_mm = 30;
  double canal_mm = 12.3;
  double linea_aspera_mm = 3.5;
  double shell_mm = 1.6;  ///< thickness of the cortex at both ends
  double medial_x = -1;   ///< -1: a left femur (its head points to the patient's right); +1: a right femur
  double ripple_mm = 0;   ///< amplitude of smooth irregularities of the surface
  std::uint64_t seed = 1;
};

/// The femur as two continuous fields, negative inside. Near the surface they are about the distance in mm. Points are
/// in frame "bone", with the distal end at z = 0 and the shaft's axis near x = y = 0. Safe to use from several threads.
class FemurField {
 public:
  explicit FemurField(const FemurShape& shape);
  double outer(const Eigen::Vector3d& point_mm) const;
  /// The endosteal surface: a narrow canal along the shaft, and shell_mm inside the outer surface at the ends.
  double inner(const Eigen::Vector3d& point_mm) const;

  /// Corners of a box that contains the femur.
  Eigen::Vector3d low_mm() const;
  Eigen::Vector3d high_mm() const;

 private:
  Eigen::Vector3d anatomical(const Eigen::Vector3d& point) const;  ///< (medial, back, up)
  double outer_at(const Eigen::Vector3d& p) const;
  double shaft(const Eigen::Vector3d& p) const;
  double distal(const Eigen::Vector3d& p) const;
  double proximal(const Eigen::Vector3d& p) const;
  double bow(double z) const;
  double distal_width_mm() const;  ///< across both condyles and epicondyles

  FemurShape shape_;
  double scale_;  ///< of the distal end, for the bicondylar width that is asked for
  Eigen::Vector3d head_, neck_base_;
  Ripple ripple_;
};

}  // namespace marrow::phantom
