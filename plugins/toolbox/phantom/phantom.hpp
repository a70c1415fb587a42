// SPDX-License-Identifier: Apache-2.0
#pragma once
// Values that the simulation nodes exchange: a bone as closed surfaces, the fragments that a fracture makes of it, and
// what else is in the beam.
#include <Eigen/Core>
#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "marrow/domain/case.hpp"
#include "marrow/runtime/node/value.hpp"

namespace marrow::phantom {

/// A bone in its own frame "bone": +x to the patient's left, +y to the back, +z to the head, the long axis along z with
/// the distal end at low z. Cortical bone lies between the two closed surfaces. Inside the inner one, bone and marrow
/// are mixed.
struct Bone {
  Mesh outer;
  Mesh inner;  ///< endosteal surface; without triangles, the bone is solid cortical bone
  /// Volume fraction of bone inside the inner surface, piecewise linear over z and constant beyond the ends.
  std::vector<double> fill_z_mm{0};
  std::vector<double> fill_fraction{0};
  /// The thigh: a cylinder of muscle along z with a layer of fat around it; radius 0: no soft tissue.
  Eigen::Vector2d thigh_centre_mm = Eigen::Vector2d::Zero();
  double thigh_radius_mm = 0;
  double fat_mm = 0;

  using fields = Fields<&Bone::outer, &Bone::inner, &Bone::fill_z_mm, &Bone::fill_fraction, &Bone::thigh_centre_mm,
                        &Bone::thigh_radius_mm, &Bone::fat_mm>;
};

/// One piece of a bone, and its poses in the CT and in the images. The soft tissue keeps its place: its world frame is
/// the bone's own frame.
struct Fragment {
  std::string name;
  int side = 0;  ///< -1: inside Phantom::fracture (distal); +1: outside it (proximal); 0: the whole bone
  RigidTransform ct_from_bone{"ct", "bone"};
  RigidTransform world_from_ct{"world", "ct"};  ///< the exact truth
  FragmentFrame frame;                          ///< the axes of its motion, in CT coordinates
  std::vector<Eigen::Vector3d> seeds_mm;        ///< points inside its bone, in CT coordinates
  Mesh outer;  ///< its part of the bone's outer surface, in CT coordinates; open at the fracture

  RigidTransform world_from_bone() const { return world_from_ct * ct_from_bone; }
  using fields = Fields<&Fragment::name, &Fragment::side, &Fragment::ct_from_bone, &Fragment::world_from_ct,
                        &Fragment::frame, &Fragment::seeds_mm, &Fragment::outer>;
};

struct Phantom {
  Bone bone;
  Mesh fracture;  ///< closed surface around the distal side, in frame "bone"; without triangles if the bone is whole
  std::vector<Fragment> fragments;
  using fields = Fields<&Phantom::bone, &Phantom::fracture, &Phantom::fragments>;
};

/// Anything else in the beam: a closed surface that is filled with one material.
struct Body {
  std::string name;
  std::string material;                         ///< one of materials()
  Mesh surface;                                 ///< in the images, frame "world"
  bool in_ct = false;                           ///< whether the CT shows it too
  RigidTransform ct_from_world{"ct", "world"};  ///< where it lies in the CT
  std::string moves_with;                       ///< the fragment that it is fixed to; empty: none
  using fields =
      Fields<&Body::name, &Body::material, &Body::surface, &Body::in_ct, &Body::ct_from_world, &Body::moves_with>;
};

/// A phantom with what else is in the beam.
struct ClutteredPhantom {
  Phantom phantom;
  /// Soft tissue. A later one counts where it overlaps another. Without any, the thigh is the bone's cylinder.
  std::vector<Body> tissues;
  /// Where bodies overlap, the later one counts. All of them replace bone and soft tissue.
  std::vector<Body> bodies;
  using fields = Fields<&ClutteredPhantom::phantom, &ClutteredPhantom::tissues, &ClutteredPhantom::bodies>;
};

/// Throw Error, naming `what`, unless the surfaces are closed and oriented outward and the other values are finite and
/// consistent.
void check_bone(const Bone& bone, const std::string& what);
void check_phantom(const Phantom& phantom, const std::string& what);
void check_phantom(const ClutteredPhantom& phantom, const std::string& what);

/// The fragment at the knee; the whole bone if it is not broken. `phantom` has at least one fragment.
const Fragment& distal_fragment(const Phantom& phantom);

/// Moves a body in the images, by a motion in frame "world". Its place in the CT stays the same.
void move(Body& body, const RigidTransform& by);

/// The fragment of this name. Throws Error, naming `what` and the names that there are, if there is none.
const Fragment& fragment_named(const Phantom& phantom, const std::string& name, const std::string& what);

/// Moves the surfaces, the thigh and the fill. Then the lowest point lies `depth_mm` below the origin, and the middle
/// of the bone's lowest 100 mm lies on the z axis. The origin is the isocentre of the views.
void place_distal_end(Bone& bone, double depth_mm);

/// The points that lie in the grid, at least two voxels from its border.
std::vector<Eigen::Vector3d> points_within(const Grid& grid, const std::vector<Eigen::Vector3d>& points_mm);

/// The volume fraction of bone at positions along z, and its exact mean along straight lines.
class Fill {
 public:
  explicit Fill(const Bone& bone);
  double at(double z_mm) const;
  /// Mean over the straight line from one z to another.
  double mean(double from_z_mm, double to_z_mm) const;

 private:
  double integral(double z_mm) const;  ///< from the first position
  std::vector<double> z_, fraction_, integral_;
};

/// The energies at which attenuation is given: 40, 50, 60, 70 keV.
using Spectrum = std::array<double, 4>;

/// Linear attenuation of tissue per mm (ICRP 110 materials of the MC-GPU tables).
constexpr Spectrum kBonePerMm{0.1235, 0.07937, 0.05934, 0.04871};
constexpr Spectrum kMarrowPerMm{0.02649, 0.02277, 0.02082, 0.01959};
constexpr Spectrum kMusclePerMm{0.02840, 0.02390, 0.02161, 0.02020};
constexpr Spectrum kFatPerMm{0.02299, 0.02032, 0.01886, 0.01789};

struct Material {
  std::string_view name;
  Spectrum per_mm;
  double hu;  ///< in a CT; metal is far beyond the largest value of a scanner and is cut to it
  bool is_metal = false;
};

/// The largest value of a CT of 12 bits.
constexpr double kLargestHu = 3071;

const std::vector<Material>& materials();
/// Throws Error if there is no material of this name.
const Material& material(const std::string& name);

using Points = std::vector<Eigen::Vector3d>;

/// A closed surface through rings of points, all of the same number. Each ring runs counter-clockwise if seen from the
/// next one. Both ends are closed by fans around their middle.
Mesh loft(const std::vector<Points>& rings);

/// A tube along a curve, with one radius for each of its points. The corners lie on the radius.
Mesh tube(const Points& curve_mm, const std::vector<double>& radii_mm, int sides = 48);
Mesh tube(const Eigen::Vector3d& from_mm, const Eigen::Vector3d& to_mm, double radius_mm, int sides = 48);

/// A bar of rectangular section along a curve. Its flat side points to `up`, which must not be parallel to the curve.
/// `width_mm` is measured across `up` and the curve.
Mesh bar(const Points& curve_mm, const Eigen::Vector3d& up, double width_mm, double thickness_mm);

/// A case as it is to be written, with the way in which it gives its fragments. `labels` and `surfaces` are empty for
/// seeds.
struct CaseFolder {
  Case parts;
  Volume labels;        ///< 1 in the first fragment of Case::seeds, 2 in the second and so on; 0 outside
  List<Mesh> surfaces;  ///< of each fragment of Case::seeds; then there is no CT
  using fields = Fields<&CaseFolder::parts, &CaseFolder::labels, &CaseFolder::surfaces>;
};

}  // namespace marrow::phantom

MARROW_VALUE_TYPE(marrow::phantom::Bone, "simulated_bone", 1)
MARROW_VALUE_TYPE(marrow::phantom::Phantom, "phantom", 2)
MARROW_VALUE_TYPE(marrow::phantom::ClutteredPhantom, "cluttered_phantom", 1)

MARROW_VALUE_TYPE(marrow::phantom::CaseFolder, "case_folder", 1)
