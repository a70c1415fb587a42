// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/geometry/implant.hpp"
#include "tests/plugins/simulate/phantoms.hpp"

namespace marrow::test::nail_test {

using geometry::Implant;
using namespace simulated;

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
  EXPECT_NE(thick.find("mm of cortex"), std::string::npos) << thick;
  EXPECT_NE(thick.find(" mm above the distal end, and at least 1.0 mm are needed; take a thinner nail, or one of "
                       "another bow"),
            std::string::npos)
      << thick;
  const std::string unreamed = refusal(nail({{"diameter_mm", 14.0}}), {{"reaming_mm", 0.0}});
  EXPECT_NE(unreamed.find("mm thick, and the canal is "), std::string::npos) << unreamed;
  EXPECT_NE(unreamed.find("take a thinner nail, or ream the canal with reaming_mm"), std::string::npos) << unreamed;
  const std::string long_one = refusal(nail({{"length_mm", 470.0}}));
  EXPECT_NE(long_one.find("where there is no canal; take a shorter nail"), std::string::npos) << long_one;
  ClutteredPhantom solid = broken();
  solid.phantom.bone.inner = {};
  EXPECT_EQ(shipped::refusal("simulate.nailing", {{"phantom", item(solid)}, {"implant", item(nail())}}),
            "simulate.nailing: the bone is solid, so it has no canal; give it an inner surface");
}

}  // namespace marrow::test::nail_test
