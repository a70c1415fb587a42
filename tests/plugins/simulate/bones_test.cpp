// SPDX-License-Identifier: Apache-2.0
#include <numeric>

#include "marrow/toolbox/geometry/implant.hpp"
#include "tests/plugins/simulate/phantoms.hpp"

namespace marrow::test::bones_test {

using namespace simulated;
using geometry::Implant;

// Bones that are made from measures: a femur, a vertebra, a pelvis, the femoral part of a knee replacement, and a whole
// bone as a phantom.

Bone bone_by(const std::string& node, const Options& options) { return output<Bone>(node, "bone", {}, options); }

/// The number of pieces that do not touch.
std::size_t pieces(const Mesh& mesh) {
  std::vector<std::uint32_t> up(mesh.vertices_mm.size());
  std::iota(up.begin(), up.end(), 0u);
  const auto top = [&](std::uint32_t i) {
    while (up[i] != i) i = up[i] = up[up[i]];
    return i;
  };
  for (const auto& t : mesh.triangles) up[top(t[0])] = top(t[1]), up[top(t[1])] = top(t[2]);
  std::size_t count = 0;
  for (std::uint32_t i = 0; i < up.size(); ++i) count += top(i) == i;
  return count;
}

const Options kCoarse{{"resolution_mm", 2.0}, {"ripple_mm", 0.0}};
const Bone& usual_femur() {
  static const Bone made = femur(kCoarse);
  return made;
}

/// The extent of the vertices between two fractions of the length from the distal end.
Eigen::AlignedBox3d part(const Mesh& mesh, double from, double to) {
  const Eigen::AlignedBox3d all = extent(mesh);
  return extent(mesh, [&](const auto& p) {
    const double at = (p.z() - all.min().z()) / all.sizes().z();
    return at >= from && at <= to;
  });
}

TEST(SimulateFemur, HasTheMeasuresItIsMadeFrom) {
  const Bone& bone = usual_femur();
  EXPECT_TRUE(is_closed(bone.outer) && is_closed(bone.inner));
  EXPECT_NEAR(extent(bone.outer).sizes().z(), 446, 3);
  EXPECT_NEAR(part(bone.outer, 0, 0.15).sizes().x(), 82, 3);
  EXPECT_NEAR(part(bone.outer, 0.46, 0.49).sizes().x(), 28, 1);
  EXPECT_NEAR(part(bone.outer, 0.46, 0.49).sizes().y(), 30, 1.5);
  EXPECT_NEAR(part(bone.inner, 0.46, 0.49).sizes().x(), 12.3, 0.8);
  EXPECT_NEAR(extent(bone.outer).min().z(), -70, 0.5);
  // The head of a left femur points to the patient's right and to the front: a sphere around its centre fits its top.
  EXPECT_LT(part(bone.outer, 0.97, 1).max().x(), -20);
}

TEST(SimulateFemur, CondylesTellItsAxialRotation) {
  // Two condyles with a notch behind: at 5 % of the length no surface lies behind the middle, but much beside it.
  const Mesh& surface = usual_femur().outer;
  const double middle_x = part(surface, 0.03, 0.05).center().x(), end_z = -70 + 0.05 * 446;
  const double behind = extent(surface, [&](const auto& p) { return p.z() <= end_z; }).max().y();
  const double behind_middle =
      extent(surface, [&](const auto& p) { return p.z() <= end_z && std::abs(p.x() - middle_x) < 4; }).max().y();
  EXPECT_GT(behind - behind_middle, 15);
}

TEST(SimulateFemur, RightIsTheMirrorImageOfLeft) {
  const Mesh &left = usual_femur().outer, right = femur(with(kCoarse, {{"side", "right"}})).outer;
  EXPECT_NEAR(enclosed_volume_mm3(left) / enclosed_volume_mm3(right), 1, 1e-3);
  EXPECT_NEAR(extent(left).min().x(), -extent(right).max().x(), 1);
}

TEST(SimulateFemur, ShapeSeedAndVariationGiveOtherBonesAndNothingElseDoes) {
  const auto made = [](std::uint64_t seed, int shape_seed = 1) {
    return femur({{"resolution_mm", 3.0}, {"ripple_mm", 0.0}, {"variation", 1.0}, {"shape_seed", shape_seed}}, seed)
        .outer;
  };
  const Mesh one = made(1);
  EXPECT_EQ(one.vertices_mm, made(2).vertices_mm);  // the run's seed is for noise only
  EXPECT_NE(one.vertices_mm.size(), made(1, 2).vertices_mm.size());
  for (int seed = 3; seed < 9; ++seed) EXPECT_TRUE(is_closed(made(1, seed))) << seed;
}

TEST(SimulateFemur, ThinShaftIsExplained) {
  EXPECT_EQ(refusal("simulate.femur", {}, with(kCoarse, {{"canal_diameter_mm", 26.0}})),
            "simulate.femur: a canal of 26.000000 mm leaves less than 2 mm of cortex in a shaft of 28.000000 mm; make "
            "the canal narrower");
}

Bone vertebra(const Options& options = {}) { return bone_by("simulate.vertebra", with({{"ripple_mm", 0.0}}, options)); }
/// Of the body's wall, in its middle.
double waist_mm(const Mesh& mesh) {
  return extent(mesh, [](const auto& p) { return p.y() < 3 && std::abs(p.z()) < 1; }).sizes().x();
}

TEST(SimulateVertebra, HasTheMeasuresItIsMadeFrom) {
  const Bone bone = vertebra();
  EXPECT_TRUE(is_closed(bone.outer) && is_closed(bone.inner));
  const Eigen::AlignedBox3d all = extent(bone.outer);
  EXPECT_NEAR(all.sizes().x(), 86, 1);  // the transverse processes
  EXPECT_NEAR(all.min().y(), -17, 0.5);
  EXPECT_NEAR(all.max().y(), 87 - 17, 1);                                                         // the spinous process
  const Eigen::AlignedBox3d front = extent(bone.outer, [](const auto& p) { return p.y() < 3; });  // of the body alone
  EXPECT_NEAR(front.sizes().x(), 45, 1);
  EXPECT_NEAR(front.sizes().z(), 27, 1);
  // The end plates are hollow, and the wall is narrower in the middle.
  EXPECT_NEAR(extent(bone.outer, [](const auto& p) { return std::hypot(p.x(), p.y()) < 2; }).sizes().z(), 27 - 2 * 1.5,
              0.7);
  EXPECT_NEAR(waist_mm(bone.outer), 45 - 2 * 2.5, 1);
}

/// The places where straight lines leave the canal.
TEST(SimulateVertebra, TheCanalIsOpenAndAsWideAsStated) {
  const Bone bone = vertebra();
  double left = 1e9, right = -1e9, front = -1e9, back = 1e9;
  for (const auto& p : bone.outer.vertices_mm) {
    const Vector2d from_axis(p.x(), p.y() - 17 - 8.75);
    EXPECT_GT(from_axis.cwiseQuotient(Vector2d(12, 8.75)).norm(), 0.93) << p.transpose();
    if (std::abs(from_axis.y()) < 1 && std::abs(p.z() - 4) < 3) {
      if (p.x() > 0) left = std::min(left, p.x());
      if (p.x() < 0) right = std::max(right, p.x());
    }
    if (std::abs(p.x()) < 1 && std::abs(p.z()) < 12) {
      if (from_axis.y() < 0) front = std::max(front, p.y());
      if (from_axis.y() > 0) back = std::min(back, p.y());
    }
  }
  EXPECT_NEAR(left - right, 24, 0.7);
  EXPECT_NEAR(back - front, 17.5, 1);
}

TEST(SimulateVertebra, TheShellIsThinOnTheBody) {
  const Bone bone = vertebra({{"shell_mm", 1.5}});
  EXPECT_NEAR(waist_mm(bone.outer) - waist_mm(bone.inner), 2 * 1.5, 0.3);
}

TEST(SimulateVertebra, SeedsAndVariationGiveOtherVertebrae) {
  const double mean_mm3 = enclosed_volume_mm3(vertebra({{"resolution_mm", 1.6}}).outer);
  for (int seed = 1; seed < 9; ++seed) {
    const Options options{{"resolution_mm", 1.6}, {"variation", 1.0}, {"ripple_mm", 0.3}, {"shape_seed", seed}};
    const Bone bone = vertebra(options);
    EXPECT_TRUE(is_closed(bone.outer) && is_closed(bone.inner)) << seed;
    EXPECT_NEAR(enclosed_volume_mm3(bone.outer) / mean_mm3, 1, 0.5) << seed;
    EXPECT_NE(enclosed_volume_mm3(bone.outer), mean_mm3);
    EXPECT_EQ(bone.outer.vertices_mm, vertebra(options).outer.vertices_mm);
  }
}

Bone pelvis(const Options& options = {}) {
  return bone_by("simulate.pelvis", with({{"ripple_mm", 0.0}, {"resolution_mm", 3.0}}, options));
}

TEST(SimulatePelvis, HasTheMeasuresItIsMadeFrom) {
  const Bone bone = pelvis();
  EXPECT_TRUE(is_closed(bone.outer) && is_closed(bone.inner));
  const Vector3d size = extent(bone.outer).sizes();
  EXPECT_NEAR(size.x(), 256, 4);
  EXPECT_NEAR(size.y(), 150, 12);
  EXPECT_NEAR(size.z(), 210, 12);
  // The left and the right half mirror each other.
  EXPECT_NEAR(extent(bone.outer, [](const auto& p) { return p.x() > 0; }).max().x(), 0.5 * size.x(), 1);
  EXPECT_LT(enclosed_volume_mm3(pelvis({{"socket_diameter_mm", 60.0}}).outer), enclosed_volume_mm3(bone.outer))
      << "wider sockets";
}

TEST(SimulatePelvis, IsOneBoneWhateverItsShape) {
  for (int seed = 1; seed < 9; ++seed)
    EXPECT_EQ(pieces(pelvis({{"shape_seed", seed}, {"variation", 1.0}, {"resolution_mm", 4.0}}).outer), 1u) << seed;
}

Mesh knee_implant(const Options& options) { return output<Mesh>("simulate.knee_implant", "mesh", {}, options); }

TEST(SimulateKneeImplant, IsAShellWithCondylesThatDiffer) {
  const Mesh part = knee_implant({{"resolution_mm", 1.2}});
  EXPECT_TRUE(is_closed(part));
  EXPECT_EQ(pieces(part), 1u);
  const Vector3d size = extent(part).sizes();
  EXPECT_NEAR(size.x(), 64, 3) << "two condyles of 24 mm, 40 mm apart";
  EXPECT_LT(enclosed_volume_mm3(part), 0.45 * size.prod()) << "a shell is far from a solid block";
  const auto deepest = [&](double side) {
    return extent(part, [&](const auto& p) { return side * p.x() > 10; }).min().z();
  };
  EXPECT_GT(deepest(1), deepest(-1) + 0.3) << "the condyle on the left is smaller";
}

TEST(SimulateKneeImplant, SeedsGiveOtherSizes) {
  const auto drawn = [](int seed) {
    return knee_implant({{"implant_seed", seed}, {"variation", 1.0}, {"resolution_mm", 2.0}});
  };
  EXPECT_NE(enclosed_volume_mm3(drawn(1)), enclosed_volume_mm3(drawn(2)));
  EXPECT_EQ(drawn(1).vertices_mm, drawn(1).vertices_mm);
}

// The maker of bones takes the surface that another node made, as it is but for its place.
TEST(SimulateBones, TakesASurfaceInPlaceOfAFile) {
  const Mesh part = knee_implant({{"resolution_mm", 2.0}});
  const Bone made = output<Bone>("simulate.surface", "bone", {{"mesh", item(part)}},
                                 {{"long_bone", false}, {"isocentre_from_distal_end_mm", 20.0}});
  EXPECT_NEAR(enclosed_volume_mm3(made.outer), enclosed_volume_mm3(part), 1e-6 * enclosed_volume_mm3(part));
  EXPECT_NEAR(extent(made.outer).min().z(), -20, 1e-6);
}

Phantom whole_of(const Bone& bone, const Options& options = {}) {
  return output<Phantom>("simulate.whole", "phantom", {{"bone", item(bone)}}, options);
}
Bone bone_of(const Mesh& outer, const Mesh& inner = {}) {
  Bone bone;
  bone.outer = outer, bone.inner = inner;
  bone.outer.frame = bone.inner.frame = "bone";
  return bone;
}

TEST(SimulateWhole, MovesTheBoneAboutItsOwnAxes) {
  const Bone bone = bone_of(box_between({10, 0, 0}, {30, 10, 100}));
  const Phantom phantom = whole_of(bone, {{"rotation_deg", Numbers{0, 0, 90}}, {"translation_mm", Numbers{1, 2, 3}}});
  ASSERT_EQ(phantom.fragments.size(), 1u);
  const Fragment& fragment = phantom.fragments[0];
  EXPECT_EQ(fragment.name, "bone");
  EXPECT_EQ(fragment.side, 0);
  // The middle of the box is at (20, 5, 50); a point 10 mm beside it in x comes to lie beside it in y.
  EXPECT_LT((fragment.world_from_ct * Vector3d(20, 5, 50) - Vector3d(21, 7, 53)).norm(), 1e-9);
  EXPECT_LT((fragment.world_from_ct * Vector3d(30, 5, 50) - Vector3d(21, 17, 53)).norm(), 1e-9);
  EXPECT_EQ(fragment.outer.vertices_mm, bone.outer.vertices_mm);
  EXPECT_EQ(fragment.outer.frame, "ct");
}

TEST(SimulateWhole, SeedsLieInTheCortexAtAllHeights) {
  const Phantom phantom = whole_of(bone_of(upright_cylinder(15, 0, 140), upright_cylinder(11, 4, 136)));
  const auto& seeds = phantom.fragments[0].seeds_mm;
  ASSERT_EQ(seeds.size(), 14u);
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    EXPECT_NEAR(seeds[i].z(), 5 + 10 * double(i), 1e-9);
    const double radius = seeds[i].head<2>().norm();
    EXPECT_TRUE(radius > 11 && radius < 15) << radius;
  }
}

TEST(SimulateWhole, RefusesAnOpenSurface) {
  EXPECT_HAS(refusal("simulate.whole", {{"bone", item(bone_of(opened(box_between({0, 0, 0}, {10, 10, 10}))))}}),
             "simulate.whole, outer surface: the surface is open");
}

Implant nail(const Options& options = {}) {
  return output<Implant>("simulate.nail", "implant", {}, with({{"length_mm", 250.0}, {"resolution_mm", 1.0}}, options));
}

TEST(SimulateNail, IsACurvedTubeWithHolesAcross) {
  const Implant implant = nail({{"bow_radius_mm", 1000.0}, {"resolution_mm", 0.6}});
  ASSERT_EQ(implant.holes.size(), 3u);
  for (const auto& hole : implant.holes) {
    const double along = 1000 * std::asin(hole.centre_mm.z() / 1000);
    const Vector3d tangent(0, std::sin(along / 1000), std::cos(along / 1000));
    EXPECT_NEAR(hole.axis.norm(), 1, 1e-12);
    EXPECT_NEAR(hole.axis.dot(tangent), 0, 1e-12) << hole.name << " is not across the nail";
    EXPECT_NEAR((hole.centre_mm - Vector3d(0, 1000, 0)).norm(), 1000, 1e-9) << "on the middle line";
  }
  EXPECT_TRUE(implant.holes[0].axis.isApprox(Vector3d::UnitX(), 1e-12));
  EXPECT_NEAR(implant.holes[1].axis.x(), 0, 1e-12) << "the second is turned by 90 degrees";
  // The tube, less three holes through two walls of 2.6 mm. A hole is somewhat longer than the wall is thick.
  const double tube = kPi * (25 - 2.4 * 2.4) * 250, holes = 3 * 2 * kPi * 6.25 * 2.6;
  EXPECT_NEAR(enclosed_volume_mm3(implant.surface), tube - 1.1 * holes, 0.01 * tube);
  EXPECT_EQ(implant.surface.frame, "implant");
}

TEST(SimulateNail, RefusesWhatIsNoNail) {
  EXPECT_EQ(shipped::refusal("simulate.nail", {}, {{"bore_mm", 9.5}}),
            "simulate.nail: a bore of 9.500000 mm leaves a wall of less than 0.5 mm in a nail of 10.000000 mm; make "
            "the bore narrower");
  EXPECT_EQ(shipped::refusal("simulate.nail", {}, {{"hole_at_mm", Numbers{310}}, {"hole_turn_deg", Numbers{0}}}),
            "simulate.nail: the hole at 310.000000 mm from the tip does not lie within the nail, which is 300.000000 "
            "mm long");
  EXPECT_EQ(shipped::refusal("simulate.nail", {},
                             {{"hole_at_mm", Numbers{}}, {"hole_turn_deg", Numbers{}}, {"resolution_mm", 2.0}}),
            "simulate.nail: the implant has no holes, so there is nothing to lock; give each hole's centre and axis");
}

const Numbers kNone{0, 0, 0};

const ClutteredPhantom& broken() {
  static const ClutteredPhantom phantom{
      fracture(femur({{"resolution_mm", 2.0}}),
               {{"height_fraction", 0.4}, {"rotation_deg", kNone}, {"translation_mm", kNone}, {"ct_gap_mm", kNone}}),
      {},
      {}};
  return phantom;
}

Inputs inputs(const Implant& implant) { return {{"phantom", item(broken())}, {"implant", item(implant)}}; }

TEST(SimulateNailing, ThePoseBringsTheImplantIntoTheCanal) {
  const Implant implant = nail();
  const auto outputs = call("simulate.nailing", inputs(implant));
  const auto& pose = outputs.at("truth").as<Truth>().world_from_model;
  const auto& bodies = outputs.at("phantom").as<ClutteredPhantom>().bodies;
  ASSERT_EQ(bodies.size(), 2u);
  EXPECT_EQ(bodies[0].name, "reamed canal");
  EXPECT_EQ(bodies[1].name, "nail");
  EXPECT_EQ(bodies[1].material, "titanium");
  EXPECT_FALSE(bodies[1].in_ct);
  for (std::size_t i = 0; i < implant.surface.vertices_mm.size(); i += 97)
    EXPECT_TRUE(bodies[1].surface.vertices_mm[i].isApprox(pose * implant.surface.vertices_mm[i], 1e-12));
  // The tip stands 35 mm above the distal end, which lies 70 mm below the origin.
  EXPECT_NEAR(pose.translation_mm.z(), -35, 0.5);
  EXPECT_LT(degrees(std::acos(pose.rotation(2, 2))), 15) << "along the femur";
  const auto other = call("simulate.nailing", inputs(implant), {{"nail_seed", 2}});
  EXPECT_FALSE(other.at("truth").as<Truth>().world_from_model.rotation.isApprox(pose.rotation, 1e-6));
}

TEST(SimulateNailing, RefusesANailThatDoesNotFit) {
  const auto refusal = [](const Implant& implant, const Options& options = {}) {
    return shipped::refusal("simulate.nailing", inputs(implant), options);
  };
  const std::string thick = refusal(nail({{"diameter_mm", 20.0}}), {{"reaming_mm", 5.0}});
  EXPECT_EQ(thick.rfind("simulate.nailing: the nail does not fit in the canal: reamed to 2", 0), 0u) << thick;
  EXPECT_HAS(thick, "mm of cortex");
  EXPECT_HAS(thick,
             " mm above the distal end, and at least 1.0 mm are needed; take a thinner nail, or one of "
             "another bow");
  const std::string unreamed = refusal(nail({{"diameter_mm", 14.0}}), {{"reaming_mm", 0.0}});
  EXPECT_HAS(unreamed, "mm thick, and the canal is ");
  EXPECT_HAS(unreamed, "take a thinner nail, or ream the canal with reaming_mm");
  const std::string long_one = refusal(nail({{"length_mm", 470.0}}));
  EXPECT_HAS(long_one, "where there is no canal; take a shorter nail");
  ClutteredPhantom solid = broken();
  solid.phantom.bone.inner = {};
  EXPECT_EQ(shipped::refusal("simulate.nailing", {{"phantom", item(solid)}, {"implant", item(nail())}}),
            "simulate.nailing: the bone is solid, so it has no canal; give it an inner surface");
}

}  // namespace marrow::test::bones_test
