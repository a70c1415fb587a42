// SPDX-License-Identifier: Apache-2.0
#include "bowl.hpp"

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
