// SPDX-License-Identifier: Apache-2.0
// Not every 6 x 6 matrix is a covariance. Each node that takes a pose with its covariance refuses a matrix that is not
// symmetric or has a negative eigenvalue. (The tests of readers and of the runtime do the same for files and outputs.)

#include "tests/plugins/register/well.hpp"

namespace covariances_test {

using marrow::Matrix6d, marrow::Pose;

marrow::Mesh box() { return marrow::test::box({0, 0, 0}, {30, 20, 100}); }

Pose with(const Matrix6d& covariance) {
  Pose pose;
  pose.frame = marrow::fragment_frame(box());
  pose.covariance = covariance;
  return pose;
}

/// The matrices, each with the end of its message. The eigenvalue of the last one is computed by hand: 1 - 2 = -1 in
/// units of the two variances, which are 4 and 9 with a covariance of 2 * 2 * 3.
struct Wrong {
  Matrix6d matrix;
  std::string said;
};
std::vector<Wrong> wrong() {
  const std::string remedy = "; a covariance is symmetric and has no negative eigenvalue";
  Matrix6d unsymmetric = Matrix6d::Identity(), indefinite = Matrix6d::Identity();
  unsymmetric(0, 5) = 0.5;
  indefinite(1, 1) = 4, indefinite(4, 4) = 9;
  indefinite(1, 4) = indefinite(4, 1) = 12;
  return {{-Matrix6d::Identity(), ": the covariance has the negative variance -1 in row 1, column 1" + remedy},
          {unsymmetric, ": the covariance is not symmetric: 0.5 in row 1, column 6, but 0 in row 6, column 1" + remedy},
          {indefinite, ": the covariance has a negative eigenvalue (-1 times its variances)" + remedy}};
}

/// Expects that a node refuses all of them and accepts the identity. `inputs` makes the node's inputs from a pose.
template <class Inputs>
void expect_refused(const std::string& node, const std::string& pose_in_words, const Inputs& inputs,
                    const shipped::Options& options = {}) {
  for (const Wrong& one : wrong())
    EXPECT_EQ(shipped::refusal(node, inputs(with(one.matrix)), options), pose_in_words + one.said) << node;
  EXPECT_EQ(shipped::refusal(node, inputs(with(Matrix6d::Identity())), options).find("covariance"), std::string::npos)
      << node;
}

shipped::Inputs search_from(const Pose& start) {
  const auto cost = std::make_shared<well::Well>(marrow::RigidTransform{"world", "ct"}, start.frame);
  return {{"cost", marrow::Value::of<marrow::Cost>(cost)},
          {"optimizer", shipped::call("optimizer.nelder_mead", {}).at("optimizer")},
          {"start", shipped::item(start)}};
}

TEST(Covariances, VerdictsTakeNoneThatCannotBe) {
  const auto judged = [](const Pose& pose) {
    return shipped::Inputs{{"pose", shipped::item(pose)}, {"model", shipped::item(box())}};
  };
  expect_refused("verdict.predicted", "pose", judged);
  expect_refused("verdict.evidence", "pose", [&](const Pose& pose) {
    shipped::Inputs inputs = search_from(pose);
    inputs.erase("start");
    marrow::View view;
    view.camera.width_px = view.camera.height_px = 100;
    view.camera.intrinsics << 1000, 0, 50, 0, 1000, 50, 0, 0, 1;
    view.camera.camera_from_world.translation_mm.z() = 600;
    view.image.pixels = cv::Mat(100, 100, CV_16UC1, cv::Scalar(1000));
    marrow::List<marrow::View> views;
    views.add("frontal", view);
    inputs["views"] = shipped::list(views, "view");
    inputs["pose"] = shipped::item(pose);
    inputs["model"] = shipped::item(box());
    return inputs;
  });
  expect_refused("verdict.predicted", "the prior", [&](const Pose& prior) {
    shipped::Inputs inputs = judged(with(0.5 * Matrix6d::Identity()));
    inputs["prior"] = shipped::item(prior);
    return inputs;
  });
}

TEST(Covariances, RegistrationsStartFromNoneThatCannotBe) {
  for (const char* node : {"register.multiresolution", "register.sequence"})
    expect_refused(node, "the pose to start from", [&](const Pose& pose) {
      shipped::Inputs inputs = search_from(pose);
      if (node == std::string("register.sequence")) inputs["finer_cost"] = inputs["cost"];
      return inputs;
    });
  expect_refused("register.tracked", "the predicted pose", search_from);
}

TEST(Covariances, APriorThatCannotBeIsRefused) {
  for (const bool is_prior : {true, false})
    expect_refused("similarity.with_prior", is_prior ? "the prior" : "the pose found by the images",
                   [&](const Pose& pose) {
                     const Pose other = with(Matrix6d::Identity());
                     return shipped::Inputs{{"cost", search_from(pose).at("cost")},
                                            {"prior", shipped::item(is_prior ? pose : other)},
                                            {"found", shipped::item(is_prior ? other : pose)}};
                   });
}

TEST(Covariances, DeviationsOfNoneThatCannotBe) {
  expect_refused("deviations.calibrated", "the pose of stage 'first'", [](const Pose& pose) {
    marrow::List<Pose> stages;
    stages.add("first", pose);
    return shipped::Inputs{{"stages", shipped::list(stages, "stage")}, {"model", shipped::item(box())}};
  });
  expect_refused("evaluate.pose_error", "pose", [](const Pose& pose) {
    return shipped::Inputs{{"pose", shipped::item(pose)},
                           {"truth", shipped::item(marrow::Truth{pose.world_from_model})},
                           {"model", shipped::item(box())}};
  });
}

TEST(Covariances, NeitherAStartNorAWayWithOneThatCannotBe) {
  expect_refused("track.begin", "the pose of the first frame", [](const Pose& pose) {
    return shipped::Inputs{{"start", shipped::item(pose)}};
  });
  expect_refused("guide.way", "the pose of 1", [](const Pose& pose) {
    marrow::List<Pose> poses;
    poses.add("1", pose);
    return shipped::Inputs{{"poses", shipped::list(poses, "pass")}};
  });
}

}  // namespace covariances_test
