// SPDX-License-Identifier: Apache-2.0
// Puts a nail into the marrow canal of a broken femur, as it lies after the reduction.
#include <Eigen/Dense>
#include <marrow/plugin.hpp>

#include "marrow/simulate/vectors.hpp"
#include "marrow/toolbox/geometry/implant.hpp"
#include "marrow/toolbox/phantom/phantom.hpp"

namespace {

using namespace marrow;
using Eigen::Vector2d, Eigen::Vector3d;
using phantom::Body, phantom::ClutteredPhantom, phantom::Fragment;

struct NailingOptions {
  std::string material = "titanium";
  double tip_from_distal_end_mm = 35;
  double turn_deg = 10, shift_mm = 0.5;
  double reaming_mm = 1;
  double min_cortex_mm = 1;
  int nail_seed = 1;
};

struct Nailed {
  ClutteredPhantom phantom;
  Truth truth;
  Pose start;
};

constexpr double kStepMm = 10;  // between the heights at which nail and bone are compared

/// The nail's middle line and radius, measured on its surface.
struct MiddleLine {
  std::vector<Vector3d> points_mm;
  double radius_mm = 0;
};

MiddleLine middle_line(const Mesh& surface) {
  constexpr double kNearMm = 1.5;
  const Eigen::AlignedBox3d whole = phantom::bounds_of(surface.vertices_mm);
  const double low = whole.min().z(), high = whole.max().z();
  MiddleLine line;
  std::vector<double> radii;
  for (double z = low + kNearMm; z <= high - kNearMm; z += kStepMm) {
    Eigen::AlignedBox3d box;
    for (const Vector3d& vertex : surface.vertices_mm)
      if (std::abs(vertex.z() - z) < kNearMm) box.extend(vertex);
    if (box.isEmpty()) continue;
    line.points_mm.emplace_back(box.center().x(), box.center().y(), z);
    // Across the plane of the bow, which makes the section longer in this plane.
    radii.push_back(0.5 * box.sizes().head<2>().minCoeff());
  }
  for (const double radius : radii) line.radius_mm = std::max(line.radius_mm, radius);
  return line;
}

/// The bone at a height of the world: the middle of its canal, and the distances of its borders from a point.
class BoneAt {
 public:
  explicit BoneAt(const phantom::Phantom& phantom) {
    for (const Fragment& fragment : phantom.fragments) {
      const RigidTransform world_from_bone = fragment.world_from_bone(), bone_from_ct = inverse(fragment.ct_from_bone);
      Part part;
      part.low = std::numeric_limits<double>::max(), part.high = -part.low;
      for (const auto& triangle : fragment.outer.triangles)
        for (const std::uint32_t corner : triangle) {
          const double z = (bone_from_ct * fragment.outer.vertices_mm[corner]).z();
          part.low = std::min(part.low, z);
          part.high = std::max(part.high, z);
        }
      for (const auto& [mesh, points] :
           {std::pair(&phantom.bone.outer, &part.outer), std::pair(&phantom.bone.inner, &part.inner)})
        for (const Vector3d& vertex : mesh->vertices_mm)
          if (vertex.z() >= part.low && vertex.z() <= part.high) points->push_back(world_from_bone * vertex);
      parts_.push_back(std::move(part));
    }
  }

  double lowest_z() const {
    double low = std::numeric_limits<double>::max();
    for (const Part& part : parts_)
      for (const Vector3d& point : part.outer) low = std::min(low, point.z());
    return low;
  }

  /// The middle of the canal at a height: the mean over the fragments that have a canal there. Nothing above the bone.
  std::optional<Vector2d> canal(double z) const {
    Vector2d sum(0, 0);
    int count = 0;
    for (const Part& part : parts_) {
      Eigen::AlignedBox2d box;
      for (const Vector3d& point : part.inner)
        if (std::abs(point.z() - z) < kNearMm) box.extend(point.head<2>());
      if (box.isEmpty()) continue;
      sum += box.center();
      ++count;
    }
    if (count == 0) return std::nullopt;
    return sum / count;
  }

  /// Distance of a point from the nearest part of the outer or the inner surface at its height.
  double distance_to_outer(const Vector3d& point) const { return distance(point, &Part::outer); }
  double distance_to_inner(const Vector3d& point) const { return distance(point, &Part::inner); }

 private:
  static constexpr double kNearMm = 1.5;
  struct Part {
    double low, high;  ///< in frame "bone"
    std::vector<Vector3d> outer, inner;
  };
  double distance(const Vector3d& point, std::vector<Vector3d> Part::*surface) const {
    double nearest = std::numeric_limits<double>::max();
    for (const Part& part : parts_)
      for (const Vector3d& other : part.*surface)
        if (std::abs(other.z() - point.z()) < kNearMm) nearest = std::min(nearest, (other - point).head<2>().norm());
    return nearest;
  }
  std::vector<Part> parts_;
};

/// The pose whose middle line runs along the middle of the canal, with a given turn about z and height of the tip.
RigidTransform in_canal(const MiddleLine& line, const BoneAt& bone, double turn_rad, double tip_z) {
  constexpr int kRounds = 6;
  Vector2d tilt(0, 0), shift(0, 0);  // dx/dz and dy/dz; at the tip
  RigidTransform pose{"world", "implant", Eigen::Matrix3d::Identity(), Vector3d::Zero()};
  for (int round = 0; round < kRounds; ++round) {
    pose.rotation = rotation_from_vector({-tilt.y(), tilt.x(), 0}) * rotation_from_vector({0, 0, turn_rad});
    pose.translation_mm = Vector3d(shift.x(), shift.y(), tip_z);
    Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
    Eigen::Matrix2d right = Eigen::Matrix2d::Zero();  // of the two unknowns, for x and y
    for (const Vector3d& point : line.points_mm) {
      const Vector3d at = pose * point;
      const auto middle = bone.canal(at.z());
      if (!middle) continue;
      const Vector2d row(1, at.z() - tip_z);
      normal += row * row.transpose();
      right += row * (*middle - at.head<2>()).transpose();
    }
    if (!(std::abs(normal.determinant()) > 1e-6)) break;
    const Eigen::Matrix2d step = normal.inverse() * right;
    shift += step.row(0).transpose();
    tilt += step.row(1).transpose();
  }
  return pose;
}

void check_fit(const MiddleLine& line, const RigidTransform& pose, const BoneAt& bone, const NailingOptions& options) {
  const double wide = line.radius_mm + 0.5 * options.reaming_mm, lowest = bone.lowest_z();
  const auto height = [&](const Vector3d& at) { return formatted("{:.1f} mm above the distal end", at.z() - lowest); };
  for (const Vector3d& point : line.points_mm)
    if (const Vector3d at = pose * point; !bone.canal(at.z()))
      throw Error("simulate.nailing: the nail reaches out of the bone, to " + height(at) +
                  ", where there is no canal; take a shorter nail");
  for (const Vector3d& point : line.points_mm) {
    const Vector3d at = pose * point;
    const std::string where = height(at);
    if (options.reaming_mm > 0) {
      const double left = bone.distance_to_outer(at) - wide;
      if (left < options.min_cortex_mm)
        throw Error(formatted(
            "simulate.nailing: the nail does not fit in the canal: reamed to {:.1f} mm, the bone keeps {:.1f} mm of "
            "cortex {}, and at least {:.1f} mm are needed; take a thinner nail, or one of another bow",
            2 * wide, left, where, options.min_cortex_mm));
    } else if (const double room = bone.distance_to_inner(at) - line.radius_mm; room < 0) {
      throw Error(
          formatted("simulate.nailing: the nail does not fit in the canal: it is {:.1f} mm thick, and the canal is "
                    "{:.1f} mm too narrow for it {}; take a thinner nail, or ream the canal with reaming_mm",
                    2 * line.radius_mm, -room, where));
    }
  }
}

Body body_of(const std::string& name, const std::string& material, Mesh surface) {
  surface.frame = "world";
  return {.name = name, .material = material, .surface = std::move(surface), .moves_with = {}};
}

Nailed nailing(const ClutteredPhantom& given, const geometry::Implant& implant, const NailingOptions& options) {
  phantom::check_phantom(given, "simulate.nailing");
  geometry::check_implant(implant, "simulate.nailing");
  if (given.phantom.bone.inner.triangles.empty())
    throw Error("simulate.nailing: the bone is solid, so it has no canal; give it an inner surface");
  const MiddleLine line = middle_line(implant.surface);
  const BoneAt bone(given.phantom);
  marrow::Random random(std::uint64_t(options.nail_seed), 11);
  const auto within = [&](double reach) { return reach * (2 * random.uniform() - 1); };
  const double turn = radians(within(options.turn_deg));
  RigidTransform pose = in_canal(line, bone, turn, bone.lowest_z() + options.tip_from_distal_end_mm);
  const double x = within(options.shift_mm), y = within(options.shift_mm);
  pose.translation_mm += Vector3d(x, y, 0);
  check_fit(line, pose, bone, options);
  Nailed result;
  result.phantom = given;
  if (options.reaming_mm > 0) {
    phantom::Points reamed;
    for (const Vector3d& point : line.points_mm) reamed.push_back(pose * point);
    const std::vector<double> radii(reamed.size(), line.radius_mm + 0.5 * options.reaming_mm);
    result.phantom.bodies.push_back(body_of("reamed canal", "blood", phantom::tube(reamed, radii)));
  }
  Mesh surface = implant.surface;
  for (Vector3d& vertex : surface.vertices_mm) vertex = pose * vertex;
  result.phantom.bodies.push_back(body_of("nail", options.material, std::move(surface)));
  result.truth.world_from_model = pose;
  result.start.world_from_model = pose;
  result.start.frame = fragment_frame(implant.surface);
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("simulate.nailing", nailing)
      .summary("Puts a nail into the canal of a femur, reamed for it; the fragments stay where they are")
      .in("phantom", "femur with tissues and bodies")
      .in("implant", "the nail; z runs along it from its tip upwards, and its bow is convex to the front (-y)")
      .out("phantom", &Nailed::phantom, "the same with the reamed canal and the nail, which are in no CT")
      .out("truth", &Nailed::truth, "exact pose of the nail: world from implant")
      .out("start", &Nailed::start, "the same, as a start for experiments that displace it")
      .option("material", &NailingOptions::material, "what the nail is made of", one_of({"titanium", "steel"}))
      .option("tip_from_distal_end_mm", &NailingOptions::tip_from_distal_end_mm,
              "height of the tip above the bone's distal end", at_least(0))
      .option("turn_deg", &NailingOptions::turn_deg,
              "the nail is turned about its axis by an angle drawn up to this, to either side", at_least(0),
              at_most(180))
      .option("shift_mm", &NailingOptions::shift_mm,
              "the nail is moved across the canal by lengths drawn up to this, along x and along y", at_least(0),
              at_most(10))
      .option("reaming_mm", &NailingOptions::reaming_mm,
              "the canal is reamed wider than the nail by this; 0: it is not reamed, and the nail must fit in it",
              at_least(0), at_most(5))
      .option("min_cortex_mm", &NailingOptions::min_cortex_mm,
              "thickness of the cortex that must be left beside the reamed canal", at_least(0))
      .option("nail_seed", &NailingOptions::nail_seed, "seed of turn and shift", at_least(0));
}
