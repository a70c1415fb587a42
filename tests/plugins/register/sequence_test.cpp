// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "shipped.hpp"
#include "well.hpp"

namespace sequence_test {

using marrow::Cost;
using marrow::Pose;
using well::pose_at;
using well::truth;
using well::Well;

/// The first cost is least at `first`, the second at `second`.
struct Trial {
  Trial(const Pose& first, const Pose& second) {
    inputs["cost"] = marrow::Value::of<Cost>(std::make_shared<const Well>(first.world_from_model, first.frame));
    finer = std::make_shared<const Well>(second.world_from_model, second.frame, 60,
                                         6);  // the first cost must lead out of its waves
    inputs["finer_cost"] = marrow::Value::of<Cost>(finer);
    inputs["optimizer"] = shipped::call("optimizer.nelder_mead", {}).at("optimizer");
    inputs["start"] = shipped::item(pose_at(truth(), 2, -2, 8, 3, -3, 9));
  }
  shipped::Outputs run(const shipped::Options& options = {}) const {
    return shipped::call("register.sequence", inputs, options);
  }
  std::shared_ptr<const Well> finer;
  shipped::Inputs inputs;
};

double apart(const Pose& a, const Pose& b) { return well::way(a.world_from_model, b.world_from_model, a.frame).norm(); }

TEST(Sequence, TheFirstCostLeadsAndTheSecondDecides) {
  const Pose first = pose_at(truth(), 0.2, -0.1, 0.3, 0.2, -0.2, 0.3);
  const Trial trial(first, truth());
  const shipped::Outputs out = trial.run();
  const Pose& pose = out.at("pose").as<Pose>();
  EXPECT_LT(apart(pose, truth()), 0.05);
  EXPECT_NEAR(pose.cost, 0, 1e-3);
  EXPECT_TRUE(pose.warnings.empty());
  const auto stages = out.at("stages").as_list<Pose>();
  ASSERT_EQ(stages.names(), (std::vector<std::string>{"start", "first", "final"}));
  EXPECT_LT(apart(stages[0], trial.inputs.at("start").as<Pose>()), 1e-9);
  EXPECT_LT(apart(stages[1], first), 0.1);
  EXPECT_GT(stages[1].evaluations, 50);
  EXPECT_EQ(stages[2].evaluations, pose.evaluations);
  EXPECT_GT(pose.evaluations, stages[1].evaluations + 50);
  // Alone the second cost would stay in one of its waves.
  Trial alone(truth(), truth());
  alone.inputs["cost"] = alone.inputs["finer_cost"];
  EXPECT_GT(apart(alone
                      .run({{"scan_rotation_deg", 0.0},
                            {"scan_translation_mm", 0.0},
                            {"step_deg", std::vector<double>(3, 0.1)},
                            {"step_axial_deg", std::vector<double>(3, 0.1)},
                            {"step_mm", std::vector<double>(3, 0.1)}})
                      .at("pose")
                      .as<Pose>(),
                  truth()),
            1);
}

TEST(Sequence, LevelsOfTheSecondCostComparePixelsAsTold) {
  const Trial trial(truth(), truth());
  trial.run({{"finer_pixel_step", std::vector<double>{8, 3, 1}},
             {"finer_step_deg", std::vector<double>(3, 0.3)},
             {"finer_step_axial_deg", std::vector<double>(3, 0.3)},
             {"finer_step_mm", std::vector<double>(3, 0.3)},
             {"finer_step_tolerance", std::vector<double>(3, 0.1)}});
  std::vector<int> steps;
  for (const marrow::CostLevel& level : trial.finer->asked->levels) steps.push_back(level.pixel_step);
  EXPECT_EQ(steps, (std::vector<int>{8, 3, 1, 4})) << "the last one looks around the result";
}

TEST(Sequence, SaysWhereTheCostsDoNotAgree) {
  Trial trial(truth(), truth());
  const Pose other = pose_at(truth(), 0, 0, 0, 3.5, 0, 0);
  trial.inputs["finer_cost"] =
      marrow::Value::of<Cost>(std::make_shared<const Well>(other.world_from_model, other.frame));
  const Pose pose = trial.run().at("pose").as<Pose>();
  EXPECT_LT(apart(pose, other), 0.1);
  ASSERT_EQ(pose.warnings.size(), 1u);
  EXPECT_TRUE(pose.warnings[0].starts_with("the two costs lead to poses ")) << pose.warnings[0];
  EXPECT_TRUE(pose.warnings[0].ends_with(" and 3.5 mm apart: one of them is wrong; look at the overlays of both"))
      << pose.warnings[0];
  EXPECT_TRUE(trial.run({{"max_apart_mm", 4.0}}).at("pose").as<Pose>().warnings.empty());
}

TEST(Sequence, DeclaresAsManyNumbersForEachLevel) {
  const std::string node = "register.sequence";
  EXPECT_TRUE(shipped::declares(node, marrow::same_length({"contour_spacing_px", "reach_px", "step_deg",
                                                           "step_axial_deg", "step_mm", "step_tolerance"})));
  EXPECT_TRUE(shipped::declares(node, marrow::as_many_or_none("pixel_step", "contour_spacing_px")));
  EXPECT_TRUE(shipped::declares(node, marrow::same_length({"finer_pixel_step", "finer_step_deg", "finer_step_axial_deg",
                                                           "finer_step_mm", "finer_step_tolerance"})));
}

TEST(Sequence, SaysWhatIsWrong) {
  Trial trial(truth(), truth());
  EXPECT_EQ(shipped::refusal("register.sequence", trial.inputs, {{"finer_step_deg", std::vector<double>{1, -1}}}),
            "finer_step_deg: each number must be positive");
  Pose broken = truth();
  broken.world_from_model.translation_mm.x() = std::nan("");
  trial.inputs["start"] = shipped::item(broken);
  EXPECT_NE(shipped::refusal("register.sequence", trial.inputs).find("the pose to start from"), std::string::npos);
}

TEST(Sequence, BothCostsMustSaySomething) {
  class Constant : public Cost {
   public:
    double value(const marrow::RigidTransform&) const override { return 1; }
    std::shared_ptr<const Cost> at_level(const marrow::CostLevel&) const override {
      return std::make_shared<Constant>();
    }
  };
  for (const char* port : {"cost", "finer_cost"}) {
    Trial trial(truth(), truth());
    trial.inputs[port] = marrow::Value::of<Cost>(std::make_shared<const Constant>());
    EXPECT_TRUE(shipped::refusal("register.sequence", trial.inputs)
                    .starts_with("the images say nothing about the pose that was found: the cost is the same at all "
                                 "poses within 16 degrees and mm"))
        << port;
  }
}

}  // namespace sequence_test
