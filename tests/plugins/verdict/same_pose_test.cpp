// SPDX-License-Identifier: Apache-2.0
// The verdict depends on the pose, not on the way to it. The costs are wells about given poses, so the end of each
// search is known.
#include <filesystem>
#include <fstream>

#include "wells.hpp"

namespace marrow::test::same_pose_test {

using wells::Trial, wells::figure;

/// A failure model in which only the distance by contour and the number of warnings count.
std::filesystem::path model(double bias) {
  const auto path =
      std::filesystem::temp_directory_path() / ("marrow_same_pose_" + std::to_string(::getpid()) + ".yaml");
  std::ofstream(path) << "marrow-failure-model: 1\nrecord: made by hand\nbias: " << bias
                      << "\ndoubtful_above: 0.1\nwrong_above: 0.5\nterms:\n"
                         "  - {figure: contour_apart_deg, scale: 1, weight: 0.5, absent: 0}\n"
                         "  - {figure: warnings, scale: 1, weight: 1, absent: 0}\n";
  return path;
}

/// With a second cost that is least where the pose is turned by this angle about the long axis.
Trial with_second_cost(double turned_deg) {
  Trial trial;
  trial.second.views = {{{trial.moved_by({0, 0, turned_deg, 0, 0, 0}), 0.9}},
                        {{trial.moved_by({0, 0, turned_deg, 0, 0, 0}), 0.9}}};
  trial.inputs["contour_cost"] = Value::of<Cost>(std::make_shared<const wells::Wells>(trial.second));
  return trial;
}

Value stages_by(const Trial& trial, double first_turned_deg) {
  Pose first = trial.pose;
  first.world_from_model = trial.moved_by({0, 0, first_turned_deg, 0, 0, 0});
  return shipped::list(named("first", first, "final", trial.pose), "stage");
}

TEST(SamePose, WhereTheFirstSearchEndedDoesNotCount) {
  Trial trial = with_second_cost(1);
  const Options options{{"failure_model", model(-5)}};
  trial.inputs["stages"] = stages_by(trial, 0);
  const Verdict one = trial.verdict(options);
  trial.inputs["stages"] = stages_by(trial, 9);
  const Verdict other = trial.verdict(options);
  EXPECT_EQ(hash_of(one), hash_of(other));
  EXPECT_NEAR(figure(one, "contour_apart_deg"), 1, 0.05);
}

TEST(SamePose, ATenthOfADegreeIsTheSamePose) {
  const Options options{{"failure_model", model(-5)}};
  Numbers found;
  for (const double off : {-0.1, 0.0, 0.1}) {
    Trial trial = with_second_cost(3);
    Pose pose = trial.pose;
    pose.world_from_model = trial.moved_by({off, -off, off, 0.3 * off, 0, -0.3 * off});
    trial.inputs["pose"] = item(pose);
    found.push_back(trial.verdict(options).failure_probability);
  }
  // log odds -5 + 0.5 log(1 + 3): a tenth of a degree changes them by 0.5 * 0.1 / 4.
  const double log_odds = -5 + 0.5 * std::log(4.0);
  for (const double probability : found) EXPECT_NEAR(std::log(probability / (1 - probability)), log_odds, 0.03);
}

TEST(SamePose, APoseFromWhichASecondCostLeadsAwayAsFarAsAFailureIsDoubtful) {
  Trial trial = with_second_cost(7.6);
  const Options options{{"failure_model", model(-9)}};  // the model alone trusts it
  const Verdict verdict = trial.verdict(options);
  EXPECT_LT(verdict.failure_probability, 0.001);
  EXPECT_EQ(verdict.judgement, Judgement::doubtful);
  EXPECT_EQ(verdict.reasons.at(0),
            "contour and grey values lead to poses 7.6 degrees apart about the long axis; both cannot be right");
  EXPECT_EQ(verdict.remedies.at(0), "another view, or a landmark off the long axis");
  EXPECT_EQ(with_second_cost(4).verdict(options).judgement, Judgement::trusted);
}

TEST(SamePose, SoIsOneFromWhichItsOwnCostLeadsAway) {
  Trial trial;
  for (auto& view : trial.cost.views) view = {{trial.moved_by({0, 0, 0, 0, 0, 3}), 0.9}};
  const Verdict verdict = trial.verdict({{"failure_model", model(-9)}});
  EXPECT_NEAR(figure(verdict, "apart_mm"), 3, 0.05);
  EXPECT_EQ(verdict.judgement, Judgement::doubtful);
  EXPECT_EQ(verdict.reasons.at(0), "the cost leads to a pose 3.00 mm away; both cannot be right");
}

}  // namespace marrow::test::same_pose_test
