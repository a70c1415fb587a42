// SPDX-License-Identifier: Apache-2.0
#include "marrow/simulate/knee.hpp"

#include "marrow/simulate/polygonise.hpp"
#include "marrow/simulate/vectors.hpp"

namespace marrow::phantom {
namespace {

using Eigen::Vector3d;

constexpr double kSpacingMm = 1.2;
constexpr double kSteepest = 2.5;
constexpr double kMeanHalfWidthMm = 41;  // of the femur that the sizes below belong to

// Half width and half depth of the tibia over the depth below its plateau, all in mm.
constexpr std::array<Node, 7> kTibiaWidth{{{0, 36}, {8, 37}, {20, 33}, {40, 23}, {60, 17}, {100, 13.5}, {200, 12}}};
constexpr std::array<Node, 7> kTibiaDepth{{{0, 23}, {8, 24}, {20, 22}, {40, 19}, {60, 16.5}, {100, 15}, {200, 13}}};
constexpr std::array<Node, 4> kTibiaShell{{{0, 1.5}, {25, 1.5}, {70, 3.5}, {200, 4.5}}};
constexpr double kTibiaEnd = 150;

/// All fields are in a frame with x to the lateral side, y to the back, z up, and the origin in the middle of the
/// plateau.
double tibia(const Vector3d& p) {
  const double down = -p.z(), forward = 5 * std::clamp(down / 60, 0.0, 1.0);
  const double half_width = along(kTibiaWidth, down), half_depth = along(kTibiaDepth, down);
  const double x = p.x(), y = p.y() + forward, radius = std::hypot(x, y),
               relative = std::hypot(x / half_width, y / half_depth);
  const double wall = relative > 1e-9 ? radius - radius / relative : -half_depth;
  const double plateau = p.z() + 0.12 * p.y();  // falls to the back by 7 degrees
  const double body = cut(wall, std::max(plateau, down - kTibiaEnd), 4);
  const double eminence = std::min(capsule(p, Vector3d(-5, 1, -4), Vector3d(-4, 2, 5), 5, 2),
                                   capsule(p, Vector3d(5, 2, -4), Vector3d(4, 3, 3.5), 5, 2));
  const double tuberosity = ellipsoid(p - Vector3d(2, -19, -38), Vector3d(9, 9, 17));
  return join(join(body, eminence, 3), tuberosity, 8);
}

double fibula(const Vector3d& p) {
  const double head = ellipsoid(p - Vector3d(36, 19, -22), Vector3d(9, 10, 12));
  const double shaft = capsule(p, Vector3d(36, 18, -30), Vector3d(33, 15, -kTibiaEnd + 6), 6, 6.5);
  return join(head, shaft, 8);
}

/// Wide and flat, with a point below and a ridge behind. The origin of its frame is its middle.
double patella(const Vector3d& p) {
  const double body = ellipsoid(p, Vector3d(22, 10, 21));
  const double apex = capsule(p, Vector3d(0, -1, -10), Vector3d(0, 1, -22), 8, 3);
  const double ridge = ellipsoid(p - Vector3d(-2, 5, 3), Vector3d(8, 7, 14));
  return join(join(body, apex, 6), ridge, 5);
}

double shell_of_tibia(const Vector3d& p) { return along(kTibiaShell, -p.z()); }

struct Part {
  std::string name;
  double (*outer)(const Vector3d&);
  double (*shell)(const Vector3d&);
  Vector3d low, high;
};

Mesh turned(Mesh mesh, const RigidTransform& by) {
  for (auto& vertex : mesh.vertices_mm) vertex = by * vertex;
  mesh.frame = by.target;
  return mesh;
}

RigidTransform bent(const Vector3d& axis_at, double angle) {
  RigidTransform bend{"bone", "bone"};
  // About x: the lower leg, which hangs down, moves to the back.
  bend.rotation = Eigen::AngleAxisd(angle, Vector3d::UnitX()).toRotationMatrix();
  bend.translation_mm = axis_at - bend.rotation * axis_at;
  return bend;
}

}  // namespace

DistalEnd distal_end(const Mesh& outer) {
  constexpr double kEndMm = 60;
  constexpr double kHeadShare = 0.12;
  const Eigen::AlignedBox3d whole = bounds_of(outer.vertices_mm);
  const double lowest_z = whole.min().z(), highest_z = whole.max().z();
  Eigen::AlignedBox2d end;
  double head_x = 0, heads = 0;
  for (const auto& vertex : outer.vertices_mm) {
    if (vertex.z() < lowest_z + kEndMm) end.extend(vertex.head<2>());
    if (vertex.z() > highest_z - kHeadShare * (highest_z - lowest_z)) {
      head_x += vertex.x();
      ++heads;
    }
  }
  const Eigen::Vector2d least = end.min(), most = end.max(), middle = 0.5 * (least + most);
  return {
      lowest_z, 0.5 * (most.x() - least.x()), least.y(), most.y(), middle, head_x / heads > middle.x() ? -1.0 : 1.0};
}

Vector3d knee_axis_at(const Mesh& femur_outer) {
  const DistalEnd end = distal_end(femur_outer);
  const double scale = end.half_width_mm / kMeanHalfWidthMm;
  return {end.middle_mm.x(), end.back_y - 21 * scale, end.lowest_z + 22 * scale};
}

Body fixed_to(const Fragment& fragment, const std::string& name, const std::string& material, Mesh surface) {
  return {.name = name,
          .material = material,
          .surface = turned(std::move(surface), fragment.world_from_bone()),
          .in_ct = true,
          .ct_from_world = inverse(fragment.world_from_ct),
          .moves_with = fragment.name};
}

std::vector<Body> make_knee(const Mesh& femur_outer, const Fragment& fragment, const KneeShape& shape) {
  const DistalEnd end = distal_end(femur_outer);
  const double scale = end.half_width_mm / kMeanHalfWidthMm;
  const Vector3d plateau(end.middle_mm.x(), end.middle_mm.y() + 3 * scale, end.lowest_z - shape.gap_mm);
  // The patella lies before the groove, about a thumb above the joint.
  const Vector3d kneecap(end.middle_mm.x(), end.front_y - (0.5 * shape.gap_mm + 8 * scale),
                         end.lowest_z + 40 * scale + shape.patella_up_mm);
  const Vector3d axis = knee_axis_at(femur_outer);
  const auto one_mm = [](const Vector3d&) { return 1.2; };
  const std::vector<std::pair<Part, Vector3d>> parts{
      {{"tibia", tibia, shell_of_tibia, {-46, -40, -kTibiaEnd - 6}, {46, 40, 12}}, plateau},
      {{"fibula", fibula, one_mm, {20, 0, -kTibiaEnd - 6}, {52, 36, -4}}, plateau},
      {{"patella", patella, one_mm, {-28, -16, -32}, {28, 18, 28}}, kneecap}};
  std::vector<Body> bodies;
  for (const auto& [part, at] : parts) {
    // During flexion, the patella follows the tibia but turns less.
    const double share = part.name == "patella" ? 0.7 : 1;
    const RigidTransform in_images = bent(axis, share * shape.flexion_rad),
                         in_ct = bent(axis, share * shape.ct_flexion_rad);
    const auto local = [&, &at = at](const Vector3d& p) {
      Vector3d q = (p - at) / scale;
      q.x() *= end.lateral_x;
      return q;
    };
    Vector3d low = at + scale * part.low, high = at + scale * part.high;
    if (end.lateral_x < 0) {
      low.x() = at.x() - scale * part.high.x();
      high.x() = at.x() - scale * part.low.x();
    }
    for (const bool inside : {false, true}) {
      const Mesh surface = polygonise(
          [&, &part = part](const Vector3d& p) {
            const Vector3d q = local(p);
            return scale * (part.outer(q) + (inside ? part.shell(q) : 0));
          },
          low, high, kSpacingMm, kSteepest);
      Body body = fixed_to(fragment, part.name + (inside ? ", inside" : ""),
                           inside ? "cancellous bone" : "cortical bone", turned(surface, in_images));
      body.ct_from_world = fragment.ct_from_bone * in_ct * inverse(in_images) * inverse(fragment.world_from_bone());
      bodies.push_back(std::move(body));
    }
  }
  return bodies;
}

namespace {

using Eigen::Vector3d;

constexpr int kSides = 240;
constexpr double kLowestMm = -300, kAboveMm = 60, kSeenMm = 130;
constexpr double kFineMm = 1, kCoarseMm = 8;  // between rings, where folds are and elsewhere

double top_of(const Bone& bone) { return bounds_of(bone.outer.vertices_mm).max().z() + kAboveMm; }

/// A surface around the axis of the thigh, from its radius at an angle and a height.
Mesh around(const Bone& bone, const std::function<double(double, double)>& radius_at) {
  std::vector<Points> rings;
  const double top = top_of(bone);
  for (double z = kLowestMm; z < top; z += z >= -kSeenMm && z < kSeenMm ? kFineMm : kCoarseMm) {
    Points& ring = rings.emplace_back();
    for (int k = 0; k < kSides; ++k) {
      const double angle = 2 * kPi * k / kSides, radius = radius_at(angle, z);
      ring.emplace_back(bone.thigh_centre_mm.x() + radius * std::cos(angle),
                        bone.thigh_centre_mm.y() + radius * std::sin(angle), z);
    }
  }
  return loft(rings);
}

Body still(const std::string& name, const std::string& material, Mesh surface) {
  return {.name = name, .material = material, .surface = std::move(surface), .in_ct = true, .moves_with = {}};
}

/// A bulge with a crease beside it, over a part of the circumference.
struct Fold {
  double at_angle, half_span, at_z, slope, phase, width_mm, height_mm;

  double operator()(double angle, double z, double radius) const {
    const double off = std::remainder(angle - at_angle, 2 * kPi);
    if (std::abs(off) >= half_span) return 0;
    const double fading = std::pow(std::cos(0.5 * kPi * off / half_span), 2);
    const double line = at_z + slope * radius * std::sin(off) + 4 * std::sin(3 * angle + phase);
    const double d = (z - line) / width_mm;
    return height_mm * fading * (std::exp(-0.5 * d * d) - 0.6 * std::exp(-0.5 * (d - 2) * (d - 2)));
  }
};

/// Waves around the circumference that turn slowly along the thigh. They lie in -1 to 1 with mean 0.
struct Waves {
  struct Wave {
    int count;
    double share, phase, turn_per_mm;
  };
  std::vector<Wave> waves;
  explicit Waves(Random& random) {
    for (const auto& [count, share] : {std::pair(1, 0.5), std::pair(2, 0.3), std::pair(5, 0.12), std::pair(9, 0.08)})
      waves.push_back({count, share, 2 * kPi * random.uniform(), (random.uniform() - 0.5) * 0.03 * count});
  }
  double operator()(double angle, double z) const {
    double sum = 0;
    for (const Wave& wave : waves) sum += wave.share * std::sin(wave.count * angle + wave.phase + wave.turn_per_mm * z);
    return sum;
  }
};

}  // namespace

std::vector<Body> make_thigh(const Bone& bone, const ThighShape& shape, Random& random) {
  const double outside = bone.thigh_radius_mm, fat = std::min(bone.fat_mm, outside), inside = outside - fat;
  if (!(outside > 0)) return {};
  const Waves waves(random);
  std::vector<Fold> folds;
  for (int i = 0; i < shape.folds; ++i) {
    Fold fold;
    fold.at_angle = 2 * kPi * random.uniform();
    fold.half_span = radians(60 + 70 * random.uniform());
    fold.at_z = -70 + 170 * random.uniform();
    fold.slope = 0.7 * (random.uniform() - 0.5);
    fold.phase = 2 * kPi * random.uniform();
    fold.width_mm = 1.2 + 1.5 * random.uniform();
    fold.height_mm = shape.fold_mm * (0.6 + 0.4 * random.uniform());
    folds.push_back(fold);
  }
  std::vector<Body> tissues;
  tissues.push_back(still("skin", "fat", around(bone, [&](double angle, double z) {
                            double radius = outside;
                            for (const Fold& fold : folds) radius += fold(angle, z, outside);
                            return radius;
                          })));
  if (!(inside > 0)) return tissues;
  // The square of the radius is changed, so that the area stays the same.
  tissues.push_back(still("muscle", "muscle", around(bone, [&](double angle, double z) {
                            const double change = 2 * inside * fat * shape.unevenness * waves(angle, z);
                            return std::sqrt(std::max(0.0, inside * inside + change));
                          })));
  return tissues;
}

std::vector<Body> make_vessels(const Bone& bone, const VesselShape& shape, Random& random) {
  constexpr double kRadiusMm = 3.6, kStepMm = 3, kVeinRadiusMm = 1.8;
  const DistalEnd end = distal_end(bone.outer);
  const double medial = -end.lateral_x;
  const Eigen::Vector2d centre = bone.thigh_centre_mm;
  // From the inner side of the shaft to the middle behind the condyles.
  const auto at = [&](double z) {
    const double above = std::clamp((z - end.lowest_z - 30) / 170, 0.0, 1.0), s = above * above * (3 - 2 * above);
    const Vector3d behind(end.middle_mm.x() + 3 * medial, end.back_y + 11, z),
        beside(centre.x() + 30 * medial, centre.y() + 16, z);
    return Vector3d((1 - s) * behind + s * beside);
  };
  const double phase = 2 * kPi * random.uniform(), top = top_of(bone);
  Points curve;
  for (double z = end.lowest_z - 100; z < top - kAboveMm - 60; z += kStepMm) {
    const double bend = 2 * kPi * z / 45 + phase;
    curve.push_back(at(z) + Vector3d(1.5 * std::sin(bend), 1.2 * std::cos(1.3 * bend), 0));
  }
  std::vector<Body> vessels;
  for (std::size_t first = 0; first + 4 < curve.size();) {
    const std::size_t length = 3 + random.index(6);
    if (random.uniform() < shape.calcified) {
      const Points piece(curve.begin() + std::ptrdiff_t(first),
                         curve.begin() + std::ptrdiff_t(std::min(curve.size(), first + length + 1)));
      const std::vector<double> radii(piece.size(), kRadiusMm + shape.wall_mm);
      vessels.push_back(still("artery's wall", "calcified wall", tube(piece, radii, 24)));
    }
    first += length;
  }
  vessels.push_back(still("artery", "blood", tube(curve, std::vector<double>(curve.size(), kRadiusMm), 24)));
  for (int i = 0; i < shape.veins; ++i) {
    const double start = 2 * kPi * random.uniform(), turn = (random.uniform() - 0.5) * 0.01,
                 depth = bone.thigh_radius_mm - std::max(2.5, 0.5 * bone.fat_mm);
    Points vein;
    for (double z = -200; z < 200; z += kStepMm) {
      const double angle = start + turn * z + 0.05 * std::sin(z / 17 + start);
      vein.emplace_back(centre.x() + depth * std::cos(angle), centre.y() + depth * std::sin(angle), z);
    }
    vessels.push_back(still("vein", "blood", tube(vein, std::vector<double>(vein.size(), kVeinRadiusMm), 16)));
  }
  return vessels;
}

}  // namespace marrow::phantom
