// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/phantom/phantom.hpp"

#include <cmath>

#include "marrow/base/number_text.hpp"

namespace marrow::phantom {
namespace {

void shift(Mesh& mesh, const Eigen::Vector3d& by_mm) {
  for (auto& vertex : mesh.vertices_mm) vertex += by_mm;
}

Spectrum mixed(double first_share, const Spectrum& first, const Spectrum& second) {
  Spectrum result;
  for (std::size_t e = 0; e < result.size(); ++e) result[e] = first_share * first[e] + (1 - first_share) * second[e];
  return result;
}

using Eigen::Vector3d;

/// The direction of a curve at one of its points.
Vector3d direction_at(const Points& curve, std::size_t i) {
  const std::size_t before = i > 0 ? i - 1 : 0, after = std::min(i + 1, curve.size() - 1);
  return (curve[after] - curve[before]).normalized();
}

}  // namespace

void check_bone(const Bone& bone, const std::string& what) {
  check_closed_surface(bone.outer, what + ", outer surface");
  if (!bone.inner.triangles.empty()) check_closed_surface(bone.inner, what + ", inner surface");
  if (bone.fill_z_mm.empty() || bone.fill_z_mm.size() != bone.fill_fraction.size())
    throw Error(formatted("{}: the bone share needs as many positions as values, got {} and {}", what,
                          bone.fill_z_mm.size(), bone.fill_fraction.size()));
  for (std::size_t i = 0; i < bone.fill_z_mm.size(); ++i) {
    if (!std::isfinite(bone.fill_z_mm[i]) || (i > 0 && bone.fill_z_mm[i] <= bone.fill_z_mm[i - 1]))
      throw Error(what + ": the positions of the bone share must grow");
    if (!(bone.fill_fraction[i] >= 0 && bone.fill_fraction[i] <= 1))
      throw Error(formatted("{}: the bone share must lie in 0 to 1, got {:f}", what, bone.fill_fraction[i]));
  }
}

void check_phantom(const Phantom& phantom, const std::string& what) {
  check_bone(phantom.bone, what);
  if (phantom.fragments.empty()) throw Error(what + ": the phantom has no fragments; break the bone first");
  if (!phantom.fracture.triangles.empty()) check_closed_surface(phantom.fracture, what + ", fracture surface");
  for (const Fragment& fragment : phantom.fragments) {
    check_rigid(fragment.ct_from_bone, what + ", fragment '" + fragment.name + "' in the CT");
    check_rigid(fragment.world_from_ct, what + ", fragment '" + fragment.name + "' in the images");
    if (fragment.side != 0 && phantom.fracture.triangles.empty())
      throw Error(what + ": fragment '" + fragment.name +
                  "' lies on one side of a fracture, but there is no fracture surface");
  }
}

void check_phantom(const ClutteredPhantom& cluttered, const std::string& what) {
  check_phantom(cluttered.phantom, what);
  for (const auto* bodies : {&cluttered.tissues, &cluttered.bodies})
    for (const Body& body : *bodies) {
      const std::string name = what + ", '" + body.name + "'";
      check_closed_surface(body.surface, name);
      check_rigid(body.ct_from_world, name + " in the CT");
      try {
        material(body.material);
      } catch (const Error& error) {
        throw Error(name + ": " + error.what());
      }
    }
}

const Fragment& distal_fragment(const Phantom& phantom) {
  for (const Fragment& fragment : phantom.fragments)
    if (fragment.side < 0) return fragment;
  return phantom.fragments.front();
}

void move(Body& body, const RigidTransform& by) {
  for (auto& vertex : body.surface.vertices_mm) vertex = by * vertex;
  body.ct_from_world = body.ct_from_world * inverse(by);
}

const Fragment& fragment_named(const Phantom& phantom, const std::string& name, const std::string& what) {
  std::string known;
  for (const Fragment& fragment : phantom.fragments) {
    if (fragment.name == name) return fragment;
    known += (known.empty() ? "" : ", ") + fragment.name;
  }
  throw Error(what + ": the phantom has no fragment '" + name + "', only " + known);
}

void place_distal_end(Bone& bone, double depth_mm) {
  double lowest = bone.outer.vertices_mm.front().z();
  for (const auto& vertex : bone.outer.vertices_mm) lowest = std::min(lowest, vertex.z());
  Eigen::Vector2d low = Eigen::Vector2d::Constant(1e300), high = -low;
  for (const auto& vertex : bone.outer.vertices_mm)
    if (vertex.z() <= lowest + 100) {
      low = low.cwiseMin(vertex.head<2>());
      high = high.cwiseMax(vertex.head<2>());
    }
  const Eigen::Vector2d middle = 0.5 * (low + high);
  const Eigen::Vector3d by(-middle.x(), -middle.y(), -depth_mm - lowest);
  shift(bone.outer, by);
  shift(bone.inner, by);
  bone.thigh_centre_mm += by.head<2>();
  for (double& z : bone.fill_z_mm) z += by.z();
}

std::vector<Eigen::Vector3d> points_within(const Grid& grid, const std::vector<Eigen::Vector3d>& points_mm) {
  constexpr double kBorder = 2;
  std::vector<Eigen::Vector3d> inside;
  for (const auto& point : points_mm) {
    const Eigen::Vector3d index = grid.index_from_point(point);
    bool is_inside = true;
    for (int k = 0; k < 3; ++k)
      is_inside = is_inside && index[k] >= kBorder && index[k] <= grid.size[std::size_t(k)] - 1 - kBorder;
    if (is_inside) inside.push_back(point);
  }
  return inside;
}

Fill::Fill(const Bone& bone) : z_(bone.fill_z_mm), fraction_(bone.fill_fraction), integral_(z_.size(), 0.0) {
  for (std::size_t i = 1; i < z_.size(); ++i)
    integral_[i] = integral_[i - 1] + 0.5 * (fraction_[i] + fraction_[i - 1]) * (z_[i] - z_[i - 1]);
}

double Fill::at(double z) const {
  if (z <= z_.front()) return fraction_.front();
  if (z >= z_.back()) return fraction_.back();
  const std::size_t i = std::size_t(std::upper_bound(z_.begin(), z_.end(), z) - z_.begin());
  return fraction_[i - 1] + (fraction_[i] - fraction_[i - 1]) * (z - z_[i - 1]) / (z_[i] - z_[i - 1]);
}

double Fill::integral(double z) const {
  if (z <= z_.front()) return (z - z_.front()) * fraction_.front();
  if (z >= z_.back()) return integral_.back() + (z - z_.back()) * fraction_.back();
  const std::size_t i = std::size_t(std::upper_bound(z_.begin(), z_.end(), z) - z_.begin());
  return integral_[i - 1] + 0.5 * (fraction_[i - 1] + at(z)) * (z - z_[i - 1]);
}

double Fill::mean(double from, double to) const {
  // Below a micrometre the quotient loses its precision, but the fraction hardly changes.
  if (std::abs(to - from) < 1e-3) return at(0.5 * (from + to));
  return (integral(to) - integral(from)) / (to - from);
}

const std::vector<Material>& materials() {
  // Metals, plastic and carbon: mass attenuation coefficients at 40, 50, 60 and 80 keV (Hubbell and Seltzer, NIST IR
  // 5632), at 70 keV along a power law between 60 and 80 keV, times the density.
  static const std::vector<Material> all{
      {"fat", kFatPerMm, -100},
      {"muscle", kMusclePerMm, 50},
      {"blood", mixed(0.02, kBonePerMm, kMusclePerMm), 60},
      {"cortical bone", kBonePerMm, 1450},
      {"cancellous bone", mixed(0.22, kBonePerMm, kMarrowPerMm), 0.22 * 1450 - 0.78 * 20},
      {"calcified wall", mixed(0.5, kBonePerMm, kMusclePerMm), 750},
      {"titanium", {0.9985, 0.5471, 0.3455, 0.2456}, kLargestHu, true},  // 4.51 g/cm3
      {"steel", {2.867, 1.547, 0.952, 0.652}, kLargestHu, true},         // as iron, 7.9 g/cm3
      {"copper", {4.356, 2.341, 1.427, 0.962}, kLargestHu, true},        // 8.96 g/cm3
      {"plastic", {0.02797, 0.02468, 0.02290, 0.02177}, 120},            // acrylic, 1.19 g/cm3
      {"carbon", {0.03322, 0.02994, 0.02805, 0.02680}, 400},             // laminate of carbon fibre, 1.6 g/cm3
  };
  return all;
}

const Material& material(const std::string& name) {
  for (const Material& one : materials())
    if (one.name == name) return one;
  std::string known;
  for (const Material& one : materials()) known += (known.empty() ? "" : ", ") + std::string(one.name);
  throw Error("there is no material '" + name + "'; there are: " + known);
}

Mesh loft(const std::vector<Points>& rings) {
  Mesh mesh;
  mesh.frame = "world";
  const std::uint32_t sides = std::uint32_t(rings.front().size()), count = std::uint32_t(rings.size());
  Vector3d first = Vector3d::Zero(), last = first;
  for (const Points& ring : rings) mesh.vertices_mm.insert(mesh.vertices_mm.end(), ring.begin(), ring.end());
  for (std::uint32_t k = 0; k < sides; ++k) {
    first += rings.front()[k] / sides;
    last += rings.back()[k] / sides;
  }
  mesh.vertices_mm.push_back(first);
  mesh.vertices_mm.push_back(last);
  const std::uint32_t at_first = sides * count, at_last = at_first + 1, end = sides * (count - 1);
  for (std::uint32_t k = 0; k < sides; ++k) {
    const std::uint32_t next = (k + 1) % sides;
    for (std::uint32_t ring = 0; ring + 1 < count; ++ring) {
      const std::uint32_t below = ring * sides, above = below + sides;
      mesh.triangles.push_back({below + k, below + next, above + next});
      mesh.triangles.push_back({below + k, above + next, above + k});
    }
    mesh.triangles.push_back({at_first, next, k});
    mesh.triangles.push_back({at_last, end + k, end + next});
  }
  return mesh;
}

Mesh tube(const Points& curve, const std::vector<double>& radii, int sides) {
  Vector3d across = direction_at(curve, 0).unitOrthogonal();
  std::vector<Points> rings;
  for (std::size_t i = 0; i < curve.size(); ++i) {
    const Vector3d along = direction_at(curve, i);
    across = (across - along * along.dot(across)).normalized();  // turned with the curve, without twist
    const Vector3d third = along.cross(across);
    Points& ring = rings.emplace_back();
    for (int k = 0; k < sides; ++k) {
      const double angle = 2 * kPi * k / sides;
      ring.push_back(curve[i] + radii[i] * (std::cos(angle) * across + std::sin(angle) * third));
    }
  }
  return loft(rings);
}

Mesh tube(const Vector3d& from, const Vector3d& to, double radius, int sides) {
  return tube({from, to}, {radius, radius}, sides);
}

Mesh bar(const Points& curve, const Vector3d& up, double width, double thickness) {
  std::vector<Points> rings;
  for (std::size_t i = 0; i < curve.size(); ++i) {
    const Vector3d along = direction_at(curve, i), across = along.cross(up).normalized(),
                   flat = across.cross(along).normalized();
    // Flat, across and along are right-handed.
    Points& ring = rings.emplace_back();
    for (const auto& [f, a] : {std::pair(-0.5, -0.5), std::pair(0.5, -0.5), std::pair(0.5, 0.5), std::pair(-0.5, 0.5)})
      ring.push_back(curve[i] + f * thickness * flat + a * width * across);
  }
  return loft(rings);
}

}  // namespace marrow::phantom
