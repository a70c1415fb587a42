// SPDX-License-Identifier: Apache-2.0
// The axes of a search: a start from a file or from Python has none of its own. The bowl is 4 degrees wide about the
// cylinder's axis, which lies along (1, 1, 1); so about each of the CT's axes it is sqrt((4^2 + 0.1^2 + 0.1^2) / 3) =
// 2.31 degrees wide.
#include "bowl.hpp"
#include "tests/plugins/project/shapes.hpp"

namespace marrow::test::start_axes_test {

/// A cylinder along (1, 1, 1), with its middle at the CT's origin.
Mesh oblique_cylinder() {
  Mesh mesh = shapes::cylinder(12, 120);
  const Vector3d middle = fragment_frame(mesh).origin_mm;
  const Matrix3d turn = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), Vector3d::Ones()).toRotationMatrix();
  for (Vector3d& vertex : mesh.vertices_mm) vertex = turn * (vertex - middle);
  return mesh;
}

/// A registration that begins at the bottom of the bowl, with the CT's axes.
struct Trial {
  Mesh mesh = oblique_cylinder();
  Heard listener;
  Inputs inputs;

  explicit Trial(bool with_model) {
    const Pose start = test::pose_at({3, -4, 500});
    Matrix6d hessian = Matrix6d::Zero();
    hessian.diagonal() << 100, 100, 1.0 / 16, 100, 100, 100;
    inputs = well::searched(std::make_shared<well::Bowl>(start.world_from_model, fragment_frame(mesh), hessian), start);
    if (with_model) inputs["model"] = item(mesh);
  }
  Pose run(const std::string& node) {
    Inputs all = inputs;
    if (node == "register.sequence") all["finer_cost"] = inputs.at("cost");
    const Options options =
        node == "register.tracked" ? Options{} : Options{{"scan_rotation_deg", 0.0}, {"scan_translation_mm", 0.0}};
    return output<Pose>(node, "pose", all, options, listener.context);
  }
};

constexpr const char* kNodes[] = {"register.multiresolution", "register.sequence", "register.tracked"};

TEST(StartAxes, AreThoseOfTheModelIfTheStartHasNone) {
  for (const char* node : kNodes) {
    Trial trial(true);
    const Pose pose = trial.run(node);
    const FragmentFrame expected = fragment_frame(trial.mesh);
    EXPECT_TRUE(pose.frame.is_anatomical) << node;
    EXPECT_LT((pose.frame.axes - expected.axes).norm() + (pose.frame.origin_mm - expected.origin_mm).norm(), 1e-9);
    EXPECT_NEAR(degrees(std::sqrt((*pose.covariance)(2, 2))), 4, 0.1) << node;
    for (const std::string& warning : trial.listener.warnings) EXPECT_EQ(warning.find("no axes"), std::string::npos);
  }
  Trial trial(true);
  EXPECT_EQ(
      trial.run("register.multiresolution").warnings,
      Strings{"axial rotation is poorly determined by these images: its predicted standard deviation is 4 degrees"});
}

TEST(StartAxes, WithoutAModelNobodySpeaksOfALongAxis) {
  for (const char* node : kNodes) {
    Trial trial(false);
    const Pose pose = trial.run(node);
    EXPECT_FALSE(pose.frame.is_anatomical) << node;
    ASSERT_FALSE(trial.listener.warnings.empty());
    EXPECT_EQ(trial.listener.warnings[0],
              "the start has no axes of the bone, and no model gives them: rotations are about the x, y and z axes of "
              "'ct', and which direction is the long axis is not known; wire the bone's surface to 'model'");
    EXPECT_NEAR(degrees(std::sqrt((*pose.covariance)(2, 2))), 2.31, 0.1) << node;
    for (const std::string& warning : pose.warnings) EXPECT_EQ(warning.find("axial"), std::string::npos) << warning;
  }
  // 2.31 degrees about each axis are below the limit of 3. The direction between them is not.
  Trial trial(false);
  EXPECT_EQ(trial.run("register.multiresolution").warnings,
            Strings{"rotation about the direction (0.577, 0.577, 0.577) is poorly determined by these "
                    "images: its predicted standard deviation is 4 degrees"});
}

TEST(StartAxes, TheCovarianceOfAPredictionIsTurnedToo) {
  // 1 degree about the cylinder's axis and 0.2 across it, told about the CT's axes.
  Trial trial(true);
  const FragmentFrame frame = fragment_frame(trial.mesh);
  Pose predicted = trial.inputs.at("start").as<Pose>();
  predicted.frame = frame;
  predicted = with_deviations(predicted, {0.2, 0.2, 1, 1, 1, 1});
  trial.inputs["start"] = item(in_frame(predicted, FragmentFrame()));
  const Pose told = output_list<Pose>("register.tracked", "stages", trial.inputs)[0];
  EXPECT_LT((*told.covariance - *predicted.covariance).norm(), 1e-12);
}

TEST(StartAxes, RefusesTheModelOfAnotherBone) {
  Trial trial(true);
  trial.mesh.frame = "elsewhere";
  trial.inputs["model"] = item(trial.mesh);
  EXPECT_EQ(
      refusal("register.multiresolution", trial.inputs),
      "the model is in the frame 'elsewhere', but the pose takes points in 'ct'; give the model that was registered");
}

TEST(StartAxes, WarningsOfTheStartAreNotOfThePose) {
  Trial trial(true);
  Pose start = trial.inputs.at("start").as<Pose>();
  start.warnings = {"the landmarks lie nearly on a line"};
  trial.inputs["start"] = item(start);
  for (const char* node : kNodes)
    for (const std::string& warning : trial.run(node).warnings) EXPECT_NE(warning, start.warnings[0]) << node;
}

}  // namespace marrow::test::start_axes_test
