// SPDX-License-Identifier: Apache-2.0
#pragma once
// What an operating theatre adds to the beam. All sizes in mm; places are drawn from `random`.
#include "marrow/domain/random.hpp"
#include "marrow/toolbox/phantom/phantom.hpp"

namespace marrow::phantom {

/// Steel pins across the condyles, as for traction. They are put in after the CT.
std::vector<Body> make_pins(const Mesh& femur_outer, const Fragment& fragment, const std::vector<double>& diameters_mm,
                            double half_length_mm, Random& random);

struct PlateShape {
  double length_mm = 90;
  double width_mm = 14;
  double thickness_mm = 4.5;
  double screw_diameter_mm = 4.5;
  double screw_distance_mm = 18;
  std::string material = "steel";
};
/// An old plate on the lateral side of the femur's distal end, with screws through the bone. The CT shows it too. It
/// does not reach above `highest_z` of frame "bone". Empty if there is no room for 40 mm of it.
std::vector<Body> make_plate(const Mesh& femur_outer, const Fragment& fragment, const PlateShape& shape,
                             double highest_z, Random& random);

/// Leads of copper in plastic that lie on the skin at a radius around the thigh's centre.
std::vector<Body> make_cables(const Eigen::Vector2d& centre_mm, double skin_radius_mm, int count, Random& random);

/// A rod along the thigh with a clamp of steel, as a robot or an external fixator has, outside the skin.
std::vector<Body> make_clamp(const Eigen::Vector2d& centre_mm, double skin_radius_mm, double rod_diameter_mm,
                             double block_mm, Random& random);

/// A table of carbon with a core of foam behind the patient, whose edge runs along the thigh within the frontal view.
/// `rail`: with the steel rail along the edge.
std::vector<Body> make_table(const Eigen::Vector2d& centre_mm, double skin_radius_mm, double shell_mm, bool rail,
                             Random& random);

}  // namespace marrow::phantom
