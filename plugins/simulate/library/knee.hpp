// SPDX-License-Identifier: Apache-2.0
#pragma once
// The bones next to a femur's distal end.
#include "marrow/domain/random.hpp"
#include "marrow/toolbox/phantom/phantom.hpp"

namespace marrow::phantom {

/// Where a femur's distal end lies, in frame "bone", measured on its outer surface.
struct DistalEnd {
  double lowest_z, half_width_mm, front_y, back_y;
  Eigen::Vector2d middle_mm;  ///< x and y of the middle of its bounds
  double lateral_x;           ///< +1 or -1: the direction of x that leads away from the head
};
DistalEnd distal_end(const Mesh& outer);

/// A point of the axis about which the knee bends, in frame "bone". The axis has the direction x.
Eigen::Vector3d knee_axis_at(const Mesh& femur_outer);

struct KneeShape {
  double gap_mm = 4.5;          ///< between femur and tibia: cartilage
  double flexion_rad = 0.2;     ///< in the images
  double ct_flexion_rad = 0.1;  ///< in the CT
  double patella_up_mm = 0;     ///< how far the patella sits above its usual height
};

/// Tibia, fibula and patella of the size that fits the femur. They move with the fragment, and bend about the middle of
/// the condyles. Each is a body of cortical bone and one of cancellous bone inside.
std::vector<Body> make_knee(const Mesh& femur_outer, const Fragment& fragment, const KneeShape& shape);

/// A body that is fixed to a fragment, in the images and in the CT. `surface` is in the fragment's frame "bone".
Body fixed_to(const Fragment& fragment, const std::string& name, const std::string& material, Mesh surface);

// Soft tissue that is not an even cylinder.

struct ThighShape {
  double unevenness = 0;  ///< largest change of the fat's thickness, as a share of it; 0 to 0.85
  int folds = 0;          ///< of the skin, near the isocentre
  double fold_mm = 4;     ///< height of a fold
};

/// Skin and muscle as closed surfaces in place of the bone's cylinder, 300 mm below the isocentre to 60 mm above the
/// bone. The cross-section of the muscle is the cylinder's at each height, so fat is moved, not added.
std::vector<Body> make_thigh(const Bone& bone, const ThighShape& shape, Random& random);

struct VesselShape {
  double calcified = 0.3;  ///< share of the artery's length with calcium in its wall
  double wall_mm = 0.6;    ///< thickness of the calcified wall
  int veins = 2;           ///< in the fat
};

/// The artery that runs from the inner side of the thigh to the back of the knee, and veins in the fat.
std::vector<Body> make_vessels(const Bone& bone, const VesselShape& shape, Random& random);

}  // namespace marrow::phantom
