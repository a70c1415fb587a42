// SPDX-License-Identifier: Apache-2.0
#include "bowl.hpp"
#include "marrow/toolbox/track/track_state.hpp"
#include "tests/plugins/project/shapes.hpp"

namespace marrow::test::sequence_test {

using well::apart, well::pose_at, well::truth, well::Well;

const std::string kNode = "register.sequence";

Value well_at(const Pose& pose, double height = 0, double length = 1) {
  return Value::of<Cost>(std::make_shared<const Well>(pose.world_from_model, pose.frame, height, length));
}
/// The first cost is least at `first`, the second at the truth. The first must lead out of the waves of the second.
Inputs inputs(const Pose& first = truth()) {
  return {{"cost", well_at(first)},
          {"finer_cost", well_at(truth(), 60, 6)},
          {"optimizer", call("optimizer.nelder_mead", {}).at("optimizer")},
          {"start", item(pose_at(truth(), 2, -2, 8, 3, -3, 9))}};
}
Pose found(const Inputs& inputs, const Options& options = {}) { return output<Pose>(kNode, "pose", inputs, options); }

TEST(Sequence, TheFirstCostLeadsAndTheSecondDecides) {
  const Pose first = pose_at(truth(), 0.2, -0.1, 0.3, 0.2, -0.2, 0.3);
  const Inputs in = inputs(first);
  const Outputs out = call(kNode, in);
  const Pose& pose = out.at("pose").as<Pose>();
  EXPECT_LT(apart(pose, truth()), 0.05);
  EXPECT_NEAR(pose.cost, 0, 1e-3);
  EXPECT_TRUE(pose.warnings.empty());
  const auto stages = out.at("stages").as_list<Pose>();
  ASSERT_EQ(stages.names(), (Strings{"start", "first", "final"}));
  EXPECT_LT(apart(stages[0], in.at("start").as<Pose>()), 1e-9);
  EXPECT_LT(apart(stages[1], first), 0.1);
  EXPECT_GT(stages[1].evaluations, 50);
  EXPECT_EQ(stages[2].evaluations, pose.evaluations);
  EXPECT_GT(pose.evaluations, stages[1].evaluations + 50);
  // Alone the second cost would stay in one of its waves.
  EXPECT_GT(apart(found(with(inputs(), {{"cost", in.at("finer_cost")}}), {{"scan_rotation_deg", 0.0},
                                                                          {"scan_translation_mm", 0.0},
                                                                          {"step_deg", Numbers(3, 0.1)},
                                                                          {"step_axial_deg", Numbers(3, 0.1)},
                                                                          {"step_mm", Numbers(3, 0.1)}}),
                  truth()),
            1);
}

TEST(Sequence, LevelsOfTheSecondCostComparePixelsAsTold) {
  const auto finer = std::make_shared<const Well>(well::kTruth, well::kFrame, 60, 6);
  found(with(inputs(), {{"finer_cost", Value::of<Cost>(finer)}}), {{"finer_pixel_step", Numbers{8, 3, 1}},
                                                                   {"finer_step_deg", Numbers(3, 0.3)},
                                                                   {"finer_step_axial_deg", Numbers(3, 0.3)},
                                                                   {"finer_step_mm", Numbers(3, 0.3)},
                                                                   {"finer_step_tolerance", Numbers(3, 0.1)}});
  std::vector<int> steps;
  for (const CostLevel& level : finer->asked->levels) steps.push_back(level.pixel_step);
  EXPECT_EQ(steps, (std::vector<int>{8, 3, 1, 4})) << "the last one looks around the result";
}

TEST(Sequence, SaysWhereTheCostsDoNotAgree) {
  const Pose other = pose_at(truth(), 0, 0, 0, 3.5, 0, 0);
  const Inputs in = with(inputs(), {{"finer_cost", well_at(other)}});
  const Pose pose = found(in);
  EXPECT_LT(apart(pose, other), 0.1);
  ASSERT_EQ(pose.warnings.size(), 1u);
  EXPECT_TRUE(pose.warnings[0].starts_with("the two costs lead to poses ")) << pose.warnings[0];
  EXPECT_TRUE(pose.warnings[0].ends_with(" and 3.5 mm apart: one of them is wrong; look at the overlays of both"))
      << pose.warnings[0];
  EXPECT_TRUE(found(in, {{"max_apart_mm", 4.0}}).warnings.empty());
}

TEST(Sequence, DeclaresAsManyNumbersForEachLevel) {
  EXPECT_TRUE(declares(kNode, same_length({"contour_spacing_px", "reach_px", "step_deg", "step_axial_deg", "step_mm",
                                           "step_tolerance"})));
  EXPECT_TRUE(declares(kNode, as_many_or_none("pixel_step", "contour_spacing_px")));
  EXPECT_TRUE(declares(kNode, same_length({"finer_pixel_step", "finer_step_deg", "finer_step_axial_deg",
                                           "finer_step_mm", "finer_step_tolerance"})));
}

TEST(Sequence, SaysWhatIsWrong) {
  EXPECT_EQ(refusal(kNode, inputs(), {{"finer_step_deg", Numbers{1, -1}}}),
            "finer_step_deg: each number must be positive");
  EXPECT_NE(refusal(kNode, with(inputs(), {{"start", item(test::pose_at({std::nan(""), 0, 0}))}}))
                .find("the pose to start from"),
            std::string::npos);
  // Both costs must say something.
  for (const char* port : {"cost", "finer_cost"})
    EXPECT_TRUE(refusal(kNode, with(inputs(), {{port, function<Cost>(cost_of([](const auto&) { return 1; }))}}))
                    .starts_with("the images say nothing about the pose that was found: the cost is the same at all "
                                 "poses within 16 degrees and mm"))
        << port;
}

// A cost that is nowhere a number, against its contract: no search may end in a pose.
TEST(NowhereFinite, ASearchSaysSo) {
  for (const char* node : {"register.multiresolution", "register.tracked"}) {
    const std::string said = refusal(node, well::searched(cost_of([](const auto&) { return std::nan(""); }), Pose()));
    EXPECT_TRUE(said.starts_with("the optimizer found no least value: the function is not finite at any of the "))
        << node << ": " << said;
  }
}

// The images say 0 degrees about the long axis, with a variance of noise_times, as their blocks show only one; the
// prior says 2, with a variance of 4. Two normal densities multiply to one with the sum of their weights 1 / variance,
// and with the mean of their means by these weights.
TEST(Prior, ThePoseLiesBetweenImagesAndPriorWithTheDeviationOfBoth) {
  const Vector6d found{0.1, 0.1, 1, 0.1, 0.1, 0.1};
  const Matrix6d hessian = found.cwiseAbs2().cwiseInverse().asDiagonal();
  const Inputs known{{"cost", Value::of<Cost>(std::make_shared<const well::Bowl>(hessian))},
                     {"prior", item(with_deviations(pose_at(truth(), 0, 0, 2, 0, 0, 0), {20, 20, 2, 50, 50, 50}))},
                     {"found", item(with_deviations(truth(), found))}};
  for (const double noise_times : {1.0, 2.0, 4.0}) {
    const auto cost =
        cost_by("similarity.with_prior", known, {{"degrees_of_freedom", 1000.0}, {"noise_times", noise_times}});
    const Pose pose = output<Pose>("register.multiresolution", "pose", well::searched(cost, truth()),
                                   {{"scan_rotation_deg", 0.0},
                                    {"scan_translation_mm", 0.0},
                                    {"candidates", std::int64_t(1)},
                                    {"step_tolerance", Numbers{0.1, 0.1, 0.003}}});
    const double variance = 1 / (1 / noise_times + 1 / 4.0);
    EXPECT_NEAR(well::way(well::kTruth, pose.world_from_model, well::kFrame)[2], variance * 2 / 4.0, 0.02)
        << noise_times;
    EXPECT_NEAR(degrees(std::sqrt((*pose.covariance)(2, 2))), std::sqrt(variance), 0.04) << noise_times;
  }
}

}  // namespace marrow::test::sequence_test

namespace marrow::test::tracked_test {

using well::truth;

const std::string kNode = "register.tracked";

/// A prediction off by this much, with these deviations of all angles and translations.
Pose predicted(const Vector6d& off_deg_mm, double deg, double mm) {
  return with_deviations(well::pose_at(truth(), off_deg_mm), {deg, deg, deg, mm, mm, mm});
}
std::shared_ptr<const Cost> bowl() { return std::make_shared<well::Bowl>(Matrix6d::Identity(), 100); }
std::shared_ptr<const Cost> with_waves() {
  return std::make_shared<const well::Well>(well::kTruth, well::kFrame, 60, 6);
}

double apart(const Pose& pose) { return well::apart(truth(), pose); }

/// What is known in a frame, with a covariance that most frames take over.
Value known(int frame, double usual_cost = std::nan("")) {
  track::TrackState state;
  state.usual_cost = usual_cost;
  state.usual_covariance = Matrix6d(7 * Matrix6d::Identity());
  state.frame = frame;
  return item(state);
}

TEST(Tracked, FindsTheMinimumNearThePrediction) {
  const auto out = call(kNode, well::searched(bowl(), predicted({1, -1, 2, 1, -1, 2}, 2, 2)));
  EXPECT_LT(apart(out.at("pose").as<Pose>()), 0.05);
  EXPECT_EQ(out.at("stages").as_list<Pose>().names(), (Strings{"predicted", "final"}));
  const Matrix6d covariance = *out.at("pose").as<Pose>().covariance;
  EXPECT_NEAR(std::sqrt(covariance(3, 3)), 0.1, 0.02) << "1 / sqrt(100 * 1)";
}

TEST(Tracked, LooksFurtherWhereTheResultIsUnlikely) {
  // The well has waves: the search ends in one of them unless it looks all around.
  const auto out = call(kNode, well::searched(with_waves(), predicted({2, -2, 9, 3, -3, 9}, 4, 4)), {{"gate", 0.0}});
  const auto stages = out.at("stages").as_list<Pose>();
  ASSERT_EQ(stages.names(), (Strings{"predicted", "near", "final"}));
  EXPECT_LE(out.at("pose").as<Pose>().cost, stages[1].cost);
  EXPECT_LE(apart(out.at("pose").as<Pose>()), apart(stages[1]));
}

TEST(Tracked, LooksFurtherWhereTheCostIsMoreThanUsual) {
  // Any pose agrees with the prediction. Only the cost tells that it ended in a wave of the well.
  const auto stages = [&](double usual_cost) {
    const Inputs in = well::searched(with_waves(), predicted({2, -2, 9, 3, -3, 9}, 10, 20));
    return output_list<Pose>(kNode, "stages", with(in, {{"state", known(3, usual_cost)}}), {{"gate", 1e9}});
  };
  const Strings near{"predicted", "final"}, wide{"predicted", "near", "final"};
  const auto not_yet_known = stages(std::nan(""));
  EXPECT_EQ(not_yet_known.names(), near);
  const double cost = not_yet_known[1].cost;
  EXPECT_EQ(stages(cost).names(), near);
  const auto looked = stages(cost / 2);
  ASSERT_EQ(looked.names(), wide);
  EXPECT_LE(looked[2].cost, looked[1].cost);
}

TEST(Tracked, MostFramesTakeOverACovariance) {
  const auto covariance = [&](int frame) {
    const Inputs in = well::searched(bowl(), predicted({1, -1, 2, 1, -1, 2}, 2, 2));
    return *output<Pose>(kNode, "pose", with(in, {{"state", known(frame)}})).covariance;
  };
  EXPECT_EQ(covariance(3), 7 * Matrix6d::Identity());
  EXPECT_NE(covariance(20), 7 * Matrix6d::Identity()) << "every tenth is new";
}

TEST(Tracked, AStartWithoutACovarianceOrThatIsKnownExactlyIsHardlyKnown) {
  Pose start = predicted({2, -1, 3, 1, 4, -2}, 0, 0);
  // Three deviations of 0 would leave nothing to search; the right pose is 5.9 mm and degrees away.
  Heard heard;
  EXPECT_LT(apart(output<Pose>(kNode, "pose", well::searched(bowl(), start), {}, heard.context)), 0.05);
  EXPECT_EQ(std::count(heard.lines.begin(), heard.lines.end(),
                       "the predicted pose counts as hardly known: its predicted deviations are 0, so its registration "
                       "compared nothing"),
            1);
  start.covariance.reset();
  EXPECT_LT(apart(output<Pose>(kNode, "pose", well::searched(bowl(), start))), 0.05);
}

/// A bowl that says nothing within some distance of a pose, as where an edge lies beyond the reach of an outline.
class MuteNear : public well::Bowl {
 public:
  MuteNear(const Pose& middle, double within) : Bowl(Matrix6d::Identity(), 100), middle_(middle), within_(within) {}
  std::string nothing_compared(const RigidTransform& pose) const override {
    const bool is_near = well::way(middle_.world_from_model, pose, middle_.frame).norm() < within_;
    return is_near ? "view 'a': no edge lies within 6 px of the model's outline" : "";
  }
  std::shared_ptr<const Cost> at_level(const CostLevel&) const override { return std::make_shared<MuteNear>(*this); }

 private:
  Pose middle_;
  double within_;
};

TEST(Tracked, LooksFurtherWhereTheImagesSayNothing) {
  const Pose near = predicted({6, 0, 0, 0, 0, 0}, 4, 4);
  const auto stays = function<Optimizer>(std::make_shared<const well::Listener>());
  const auto out =
      call(kNode, with(well::searched(std::make_shared<const MuteNear>(near, 2), near), {{"optimizer", stays}}));
  EXPECT_EQ(out.at("stages").as_list<Pose>().names(), (Strings{"predicted", "final"}));
  EXPECT_GT(well::apart(near, out.at("pose").as<Pose>()), 2);
}

TEST(Tracked, AFrameThatSaysNothingGivesNoPose) {
  const Inputs mute = well::searched(std::make_shared<const MuteNear>(truth(), 1e9), truth());
  // Taken over, a covariance would look like that of a good pose.
  for (const Inputs& in : {mute, with(mute, {{"state", known(3)}})})
    EXPECT_EQ(refusal(kNode, in),
              "the images say nothing about the pose that was found: view 'a': no edge lies within 6 px of the model's "
              "outline; give a start nearer to the bone, or see whether the masks, the edges and the model are right");
}

}  // namespace marrow::test::tracked_test

// The axes of a search: a start from a file or from Python has none of its own. The bowl is 4 degrees wide about the
// cylinder's axis, which lies along (1, 1, 1); so about each of the CT's axes it is sqrt((4^2 + 0.1^2 + 0.1^2) / 3) =
// 2.31 degrees wide.
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
            Strings{"rotation about the direction (0.577, 0.577, 0.577) is poorly determined by these images: its "
                    "predicted standard deviation is 4 degrees"});
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
