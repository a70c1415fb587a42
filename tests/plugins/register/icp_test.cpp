// SPDX-License-Identifier: Apache-2.0
#include "tests/harness/node_test.hpp"

namespace marrow::test::icp_test {

/// The distal half of a femur, and where it lies in the world.
struct Bone {
  Bone() {
    const auto bone = call("simulate.femur", {}, {{"resolution_mm", 2.0}}).at("bone");
    const auto phantom = call("simulate.fracture", {{"bone", bone}}).at("phantom");
    model = *call("simulate.truth", {{"phantom", phantom}}).at("models").as_list<Mesh>().find("distal");
    frame = fragment_frame(model);
  }
  /// The surface in the world, as far as it lies below a height along the shaft.
  Mesh target(double below_mm = 1e9) const {
    Mesh mesh;
    mesh.frame = "world";
    for (const Vector3d& vertex : model.vertices_mm) mesh.vertices_mm.push_back(exact * vertex);
    for (const auto& t : model.triangles)
      if (model.vertices_mm[t[0]].z() < below_mm) mesh.triangles.push_back(t);
    return mesh;
  }
  Pose start(const Vector6d& motion) const {
    Pose pose = pose_of(marrow::moved(exact, frame, motion));
    pose.frame = frame;
    return pose;
  }
  double mtre_mm(const Pose& pose) const { return mean_distance_mm(model, pose.world_from_model, exact); }
  Mesh model;
  FragmentFrame frame;
  RigidTransform exact = placed({30, -15, 700}, {0.4, -0.2, 0.3});
};

const Bone& bone() {
  static const Bone bone;
  return bone;
}

Inputs given(const Pose& start, const Mesh& target, const Mesh& model = bone().model) {
  return {{"start", item(start)}, {"model", item(model)}, {"target", item(target)}};
}
Pose run(const Pose& start, const Mesh& target, const Options& options = {}) {
  return output<Pose>("register.icp", "pose", given(start, target), options);
}

const Vector6d kAway{radians(4), radians(-3), radians(8), 4, -3, 6};

TEST(Icp, BringsABoneOntoItself) {
  Pose start = bone().start(kAway);
  // What was said of the start is not said of the pose.
  start.covariance = Matrix6d::Identity();
  start.warnings = {"the direction along the axis is not determined"};
  start.convergence = {{100, 0.5}};
  const auto outputs = call("register.icp", given(start, bone().target()));
  const Pose& pose = outputs.at("pose").as<Pose>();
  EXPECT_GT(bone().mtre_mm(start), 8);
  EXPECT_LT(bone().mtre_mm(pose), 0.03);
  EXPECT_LT(pose.cost, 0.4) << "to points of the target, not to its triangles";
  EXPECT_TRUE(pose.warnings.empty());
  EXPECT_FALSE(pose.covariance);
  EXPECT_TRUE(pose.convergence.empty());
  const auto stages = outputs.at("stages").as_list<Pose>();
  EXPECT_EQ(stages.names(), (Strings{"start", "final"}));
  EXPECT_EQ(stages[0].world_from_model.translation_mm, start.world_from_model.translation_mm);
  EXPECT_EQ(stages[1].world_from_model.translation_mm, pose.world_from_model.translation_mm);
  EXPECT_NO_THROW(check_rigid(pose.world_from_model, "pose"));
  EXPECT_EQ(run(start, bone().target()).world_from_model.rotation, pose.world_from_model.rotation) << "every time";
}

TEST(Icp, OfAPartOfTheBone) {
  // Two thirds of the surface are there; what lies beyond reach_mm of it does not count.
  const Mesh part = bone().target(bone().frame.origin_mm.z() + 20);
  EXPECT_LT(surface_area_mm2(part) / surface_area_mm2(bone().target()), 0.9);
  Vector6d motion = 0.5 * kAway;
  motion[5] = 1;
  EXPECT_LT(bone().mtre_mm(run(bone().start(motion), part, {{"reach_mm", 6.0}})), 0.5);
}

TEST(Icp, WarnsWhereItWasStoppedOrHadFewPairs) {
  EXPECT_EQ(run(bone().start(kAway), bone().target(), {{"max_iterations", std::int64_t(3)}}).warnings,
            Strings{"the pairs of points still changed after 3 iterations; raise max_iterations"});
  const Mesh part = bone().target(bone().frame.origin_mm.z() - 60);
  const Strings warnings = run(bone().start(Vector6d::Zero()), part, {{"reach_mm", 2.0}}).warnings;
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("of the model's points have one of the target within reach_mm; is the start far off, or "
                             "the target another part?"),
            std::string::npos)
      << warnings[0];
  const double percent = 100 * surface_area_mm2(part) / surface_area_mm2(bone().target());
  EXPECT_NEAR(std::stod(warnings[0].substr(std::string("only ").size())), percent, 5);
}

TEST(Icp, SaysWhatIsWrong) {
  const auto refusal = [](const Inputs& inputs) { return shipped::refusal("register.icp", inputs); };
  const Pose start = bone().start(Vector6d::Zero());
  EXPECT_EQ(refusal(given(start, bone().model)),
            "the target is in the frame 'ct', but the pose to start from leads to 'world'; the target is a surface in "
            "the world");
  EXPECT_EQ(refusal(given(start, bone().target(), bone().target())),
            "the model is in the frame 'world', but the pose to start from takes points in 'ct'; give the model of "
            "this start");
  EXPECT_EQ(refusal(given(start, bone().target(), {})), "model: the surface has no triangles");
  EXPECT_EQ(refusal(given(bone().start({0, 0, 0, 500, 0, 0}), bone().target())),
            "0 of 2000 points of the model have one of the target within 10 mm, but three at least are needed; give a "
            "better start, or raise reach_mm");
}

}  // namespace marrow::test::icp_test
