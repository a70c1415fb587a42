// SPDX-License-Identifier: Apache-2.0
// A cost is the mean square of six numbers: the distances (degrees and mm) of a pose from the bottom of a bowl.
#include "tests/plugins/project/shapes.hpp"
#include "tests/plugins/register/bowl.hpp"

namespace marrow::test::best_of_test {

struct Trial {
  Trial() {
    const Mesh mesh = shapes::cylinder(14, 120);
    bottom.frame = fragment_frame(mesh);
    cost = std::make_shared<const well::Well>(bottom.world_from_model, bottom.frame);
    inputs["cost"] = Value::of<Cost>(cost);
    use(std::make_shared<const well::Listener>());
  }
  void use(std::shared_ptr<const Optimizer> optimizer) {
    inputs["optimizer"] = Value::of<Optimizer>(std::move(optimizer));
  }
  /// A start at this distance along the bone. Its cost is the sixth part of its square.
  Pose away(double mm) const { return well::pose_at(bottom, 0, 0, 0, 0, 0, mm); }
  void give(const std::string& input, double mm) { inputs[input] = item(away(mm)); }
  Pose run(const Options& options = {}) {
    Heard heard;
    const Pose pose = output<Pose>("initial.best_of", "pose", inputs, options, heard.context);
    EXPECT_EQ(heard.warnings, Strings{});
    log.insert(log.end(), heard.lines.begin(), heard.lines.end());
    return pose;
  }
  Pose bottom;
  std::shared_ptr<const well::Well> cost;
  Inputs inputs;
  Strings log;
};

TEST(BestOf, TakesTheStartOfLeastCostAndSaysWhatEachCosts) {
  Trial trial;
  trial.give("first", 6);
  trial.give("second", 3);
  trial.give("fourth", -12);
  const Pose best = trial.run();
  EXPECT_NEAR(best.cost, 9.0 / 6, 1e-9);
  EXPECT_NEAR(shift_between_mm(best.world_from_model, trial.away(3).world_from_model), 0, 1e-9);
  EXPECT_EQ(best.evaluations, 3 * 7) << "of all starts";
  EXPECT_EQ(trial.log, Strings{"second is the best start, with a cost of 1.5; first 6, fourth 24"});
}

TEST(BestOf, RefinesEachStart) {
  Trial trial;
  trial.inputs["optimizer"] = call("optimizer.nelder_mead", {}).at("optimizer");
  trial.give("third", 20);
  const Pose refined = trial.run();
  EXPECT_LT(refined.cost, 1);
  EXPECT_LT(well::apart(trial.bottom, refined), 2.5);
}

TEST(BestOf, OfEqualStartsTheFirstIsTaken) {
  Trial trial;
  Pose one = trial.away(5), same = trial.away(5);
  one.warnings = {"one"};
  same.warnings = {"same"};
  trial.inputs["third"] = item(one);
  trial.inputs["fourth"] = item(same);
  EXPECT_EQ(trial.run().warnings, Strings{"one"});
}

TEST(BestOf, SearchesAtOneCoarseLevelWithFewEvaluations) {
  Trial trial;
  trial.give("first", 1);
  const auto listener = std::make_shared<const well::Listener>();
  trial.use(listener);
  trial.run({{"contour_spacing_px", 10.0},
             {"reach_px", 32.0},
             {"pixel_step", std::int64_t(4)},
             {"max_evaluations", std::int64_t(70)}});
  ASSERT_EQ(trial.cost->asked->levels.size(), 1u);
  EXPECT_EQ(trial.cost->asked->levels[0].contour_spacing_px, 10);
  EXPECT_EQ(trial.cost->asked->levels[0].reach_px, 32);
  EXPECT_EQ(trial.cost->asked->levels[0].pixel_step, 4);
  ASSERT_EQ(listener->problems.size(), 1u);
  EXPECT_EQ(listener->problems[0].max_evaluations, 70);
  const Eigen::VectorXd steps = listener->problems[0].initial_step;
  EXPECT_EQ(steps.maxCoeff(), 8) << "a quarter of the reach about the long axis, else an eighth";
  EXPECT_EQ(steps.sum(), 5 * 4 + 8);
}

TEST(BestOf, SaysWhatIsWrong) {
  Trial trial;
  EXPECT_EQ(refusal("initial.best_of", trial.inputs),
            "no way led to a start: none of the inputs first, second, third and fourth is there; see why the nodes "
            "that they are wired to gave none");
  trial.give("first", 1);
  Pose bent = trial.away(1);
  bent.world_from_model.rotation *= 2;
  trial.inputs["second"] = item(bent);
  EXPECT_NE(refusal("initial.best_of", trial.inputs).find("second"), std::string::npos);
}

/// Says nothing beyond 10 mm.
class Shortsighted : public well::Well {
 public:
  using Well::Well;
  std::string nothing_compared(const RigidTransform& pose) const override {
    return pose.translation_mm.norm() > 10 ? "view 'a': it shows nothing of the bone" : "";
  }
  std::shared_ptr<const Cost> at_level(const CostLevel&) const override {
    return std::make_shared<Shortsighted>(*this);
  }
};

TEST(BestOf, AStartAboutWhichTheImagesSayNothingIsNone) {
  Trial trial;
  trial.inputs["cost"] =
      Value::of<Cost>(std::make_shared<const Shortsighted>(trial.bottom.world_from_model, trial.bottom.frame));
  trial.give("first", 20);
  trial.give("third", 30);
  EXPECT_EQ(refusal("initial.best_of", trial.inputs),
            "the images say nothing about any start: first: view 'a': it shows nothing of the bone; third: view 'a': "
            "it shows nothing of the bone; give a start nearer to the bone, or see whether the masks, the edges and "
            "the model are right");
  trial.give("second", 9);
  EXPECT_NEAR(trial.run().cost, 81.0 / 6, 1e-9);
  ASSERT_EQ(trial.log.size(), 2u);
  EXPECT_EQ(trial.log[0],
            "the images say nothing about a start: first: view 'a': it shows nothing of the bone; third: view 'a': it "
            "shows nothing of the bone");
}

TEST(BestOf, TheModelGivesTheAxesOfAStartThatHasNone) {
  Trial trial;
  Pose start = trial.away(5);
  start.frame = {};
  trial.inputs["second"] = item(start);
  trial.inputs["model"] = item(shapes::cylinder(14, 120));
  const Pose best = trial.run();
  EXPECT_TRUE(best.frame.is_anatomical);
  EXPECT_LT((best.frame.origin_mm - trial.bottom.frame.origin_mm).norm(), 1e-9);
}

}  // namespace marrow::test::best_of_test

namespace marrow::test::global_search_test {

/// A bowl with waves of 24 degrees or mm, far from where the CT lies; searched with as few poses as this bowl needs.
struct Trial {
  Trial() {
    const Mesh mesh = shapes::cylinder(14, 120);
    Pose middle;
    middle.frame = fragment_frame(mesh);
    truth = well::pose_at(middle, 12, -9, 25, -21, 17, 28);
    inputs["model"] = item(mesh);
    inputs["cost"] = Value::of<Cost>(std::make_shared<const well::Well>(truth.world_from_model, truth.frame, 1500, 24));
    inputs["optimizer"] = call("optimizer.nelder_mead", {}).at("optimizer");
  }
  Pose run(const Options& more = {}) const {
    return output<Pose>("initial.global_search", "pose", inputs,
                        with({{"poses", std::int64_t(4000)}, {"candidates", std::int64_t(20)}}, more));
  }
  double apart(const Pose& pose) const { return well::apart(truth, pose); }
  Pose truth;
  Inputs inputs;
};

TEST(GlobalSearch, FindsThePoseAmongManyMinimaWithoutAStart) {
  const Trial trial;
  const Pose found = trial.run();
  EXPECT_LT(trial.apart(found), 0.5);
  EXPECT_GT(found.evaluations, 4000);
  EXPECT_GT(trial.apart(trial.run({{"poses", std::int64_t(1)}})), 5)
      << "from the middle alone it ends in another minimum";
}

TEST(GlobalSearch, TheRangesLieAboutTheStart) {
  Trial trial;
  const Pose far = well::pose_at(trial.truth, 0, 0, 0, 60, 90, 0);
  Pose start = far;
  start.world_from_model = well::pose_at(far, 5, 5, -20, 10, -10, 20).world_from_model;
  trial.inputs["cost"] = Value::of<Cost>(std::make_shared<const well::Well>(far.world_from_model, far.frame, 1500, 24));
  trial.truth = far;
  trial.inputs["start"] = item(start);
  EXPECT_LT(trial.apart(trial.run()), 0.5);
}

TEST(GlobalSearch, DeclaresAsManyNumbersForEachLevel) {
  const std::string node = "initial.global_search";
  EXPECT_TRUE(declares(node, same_length({"contour_spacing_px", "reach_px"})));
  EXPECT_TRUE(declares(node, as_many_or_none("pixel_step", "contour_spacing_px")));
}

TEST(GlobalSearch, SaysWhatIsWrong) {
  Trial trial;
  EXPECT_EQ(refusal("initial.global_search", trial.inputs, {{"reach_px", Numbers{60, 24, 0}}}),
            "reach_px: each number must be positive");
  EXPECT_EQ(refusal("initial.global_search", trial.inputs, {{"poses", std::int64_t(0)}}),
            "it has no poses to try; give their number, such as 4000, and the ranges to search");
  EXPECT_EQ(refusal("initial.global_search", trial.inputs, {{"needs_start", true}}),
            "there is no start to search around; give the approximate placement of the fragment, in case.yaml under "
            "'start' (docs/case.md)");
  trial.inputs["model"] = item(Mesh{});
  EXPECT_NE(refusal("initial.global_search", trial.inputs).find("model"), std::string::npos);
}

}  // namespace marrow::test::global_search_test
