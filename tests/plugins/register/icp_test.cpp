// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "shipped.hpp"
#include "tests/framework/domain/shapes.hpp"

namespace icp_test {

using Eigen::Vector3d;

/// The distal half of a femur, and where it lies in the world.
struct Bone {
  Bone() {
    const auto bone = shipped::call("simulate.femur", {}, {{"resolution_mm", 2.0}}).at("bone");
    const auto phantom = shipped::call("simulate.fracture", {{"bone", bone}}).at("phantom");
    model =
        *shipped::call("simulate.truth", {{"phantom", phantom}}).at("models").as_list<marrow::Mesh>().find("distal");
    frame = fragment_frame(model);
    exact.rotation = marrow::rotation_from_vector({0.4, -0.2, 0.3});
    exact.translation_mm = {30, -15, 700};
  }
  /// The surface in the world, as far as it lies below a height along the shaft.
  marrow::Mesh target(double below_mm = 1e9) const {
    marrow::Mesh mesh;
    mesh.frame = "world";
    for (const Vector3d& vertex : model.vertices_mm) mesh.vertices_mm.push_back(exact * vertex);
    for (const auto& t : model.triangles)
      if (model.vertices_mm[t[0]].z() < below_mm) mesh.triangles.push_back(t);
    return mesh;
  }
  marrow::Pose start(const marrow::Vector6d& motion) const {
    marrow::Pose pose;
    pose.frame = frame;
    pose.world_from_model = moved(exact, frame, motion);
    return pose;
  }
  double mtre_mm(const marrow::Pose& pose) const {
    double sum = 0;
    for (const Vector3d& point : sample_surface(model, 500))
      sum += (pose.world_from_model * point - exact * point).norm() / 500;
    return sum;
  }
  marrow::Mesh model;
  marrow::FragmentFrame frame;
  marrow::RigidTransform exact{"world", "ct"};
};

const Bone& bone() {
  static const Bone bone;
  return bone;
}

shipped::Outputs run(const marrow::Pose& start, const marrow::Mesh& target, const shipped::Options& options = {}) {
  return shipped::call(
      "register.icp",
      {{"start", shipped::item(start)}, {"model", shipped::item(bone().model)}, {"target", shipped::item(target)}},
      options);
}
std::string refusal(const marrow::Pose& start, const marrow::Mesh& model, const marrow::Mesh& target) {
  return shipped::refusal(
      "register.icp",
      {{"start", shipped::item(start)}, {"model", shipped::item(model)}, {"target", shipped::item(target)}});
}

marrow::Vector6d displacement() {
  marrow::Vector6d motion;
  motion << marrow::radians(4), marrow::radians(-3), marrow::radians(8), 4, -3, 6;
  return motion;
}

TEST(Icp, BringsABoneOntoItself) {
  const marrow::Pose start = bone().start(displacement());
  const auto outputs = run(start, bone().target());
  const marrow::Pose& pose = outputs.at("pose").as<marrow::Pose>();
  std::printf("mTRE %.2f mm at the start, %.3f mm at the end, pairs %.3f mm apart\n", bone().mtre_mm(start),
              bone().mtre_mm(pose), pose.cost);
  EXPECT_GT(bone().mtre_mm(start), 8);
  EXPECT_LT(bone().mtre_mm(pose), 0.03);
  EXPECT_LT(pose.cost, 0.4) << "to points of the target, not to its triangles";
  EXPECT_TRUE(pose.warnings.empty());
  const auto stages = outputs.at("stages").as_list<marrow::Pose>();
  EXPECT_EQ(stages.names(), (std::vector<std::string>{"start", "final"}));
  EXPECT_EQ(stages[0].world_from_model.translation_mm, start.world_from_model.translation_mm);
  EXPECT_EQ(stages[1].world_from_model.translation_mm, pose.world_from_model.translation_mm);
  EXPECT_NO_THROW(check_rigid(pose.world_from_model, "pose"));
}

TEST(Icp, OfAPartOfTheBone) {
  // Two thirds of the surface are there; what lies beyond reach_mm of it does not count.
  const double end = bone().frame.origin_mm.z();
  const marrow::Mesh part = bone().target(end + 20);
  const double share = surface_area_mm2(part) / surface_area_mm2(bone().target());
  marrow::Vector6d motion = 0.5 * displacement();
  motion[5] = 1;
  const marrow::Pose start = bone().start(motion);
  const marrow::Pose pose = run(start, part, {{"reach_mm", 6.0}}).at("pose").as<marrow::Pose>();
  std::printf("%.0f %% of the surface: mTRE %.2f mm at the start, %.3f mm at the end\n", 100 * share,
              bone().mtre_mm(start), bone().mtre_mm(pose));
  EXPECT_LT(share, 0.9);
  EXPECT_LT(bone().mtre_mm(pose), 0.5);
}

TEST(Icp, IsTheSameEveryTime) {
  const marrow::Pose start = bone().start(displacement());
  const auto one = run(start, bone().target()), other = run(start, bone().target());
  EXPECT_EQ(one.at("pose").as<marrow::Pose>().world_from_model.rotation,
            other.at("pose").as<marrow::Pose>().world_from_model.rotation);
}

TEST(Icp, KeepsNothingThatWasSaidOfTheStart) {
  marrow::Pose start = bone().start(displacement());
  start.covariance = marrow::Matrix6d::Identity();
  start.warnings = {"the direction along the axis is not determined"};
  start.convergence = {{100, 0.5}};
  const auto outputs = run(start, bone().target());
  const marrow::Pose& pose = outputs.at("pose").as<marrow::Pose>();
  EXPECT_TRUE(pose.warnings.empty());
  EXPECT_FALSE(pose.covariance);
  EXPECT_TRUE(pose.convergence.empty());
}

TEST(Icp, WarnsWhereItWasStoppedOrHadFewPairs) {
  const marrow::Pose start = bone().start(displacement());
  EXPECT_EQ(run(start, bone().target(), {{"max_iterations", std::int64_t(3)}}).at("pose").as<marrow::Pose>().warnings,
            std::vector<std::string>{"the pairs of points still changed after 3 iterations; raise max_iterations"});
  const marrow::Mesh part = bone().target(bone().frame.origin_mm.z() - 60);
  const auto warnings =
      run(bone().start(marrow::Vector6d::Zero()), part, {{"reach_mm", 2.0}}).at("pose").as<marrow::Pose>().warnings;
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("of the model's points have one of the target within reach_mm; is the start far off, or "
                             "the target another part?"),
            std::string::npos)
      << warnings[0];
  const double percent = 100 * surface_area_mm2(part) / surface_area_mm2(bone().target());
  EXPECT_NEAR(std::stod(warnings[0].substr(std::string("only ").size())), percent, 5);
}

TEST(Icp, SaysWhatIsWrong) {
  const marrow::Pose start = bone().start(marrow::Vector6d::Zero());
  EXPECT_EQ(refusal(start, bone().model, bone().model),
            "the target is in the frame 'ct', but the pose to start from leads to 'world'; the target is a surface in "
            "the world");
  EXPECT_EQ(refusal(start, bone().target(), bone().target()),
            "the model is in the frame 'world', but the pose to start from takes points in 'ct'; give the model of "
            "this start");
  EXPECT_EQ(refusal(start, {}, bone().target()), "model: the surface has no triangles");
  marrow::Vector6d far = marrow::Vector6d::Zero();
  far[3] = 500;
  EXPECT_EQ(refusal(bone().start(far), bone().model, bone().target()),
            "0 of 2000 points of the model have one of the target within 10 mm, but three at least are needed; give a "
            "better start, or raise reach_mm");
}

}  // namespace icp_test
