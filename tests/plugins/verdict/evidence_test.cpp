// SPDX-License-Identifier: Apache-2.0
#include <fstream>

#include "wells.hpp"

namespace marrow::test::evidence_test {

using wells::Trial, wells::Wells, wells::figure;

TEST(VerdictEvidence, TheFiguresOfARightPoseAreSmall) {
  Trial trial;
  const Verdict verdict = trial.verdict();
  EXPECT_LT(figure(verdict, "decoys_scatter"), 1);
  EXPECT_LT(figure(verdict, "best_turned"), 0.2);
  EXPECT_LT(figure(verdict, "other_minimum"), 0.2);
  EXPECT_LT(figure(verdict, "better_minimum"), 1e-3);
  EXPECT_LT(figure(verdict, "restarts_mm"), 0.2);
  EXPECT_LT(figure(verdict, "restarts_deg"), 0.3);
  EXPECT_LT(figure(verdict, "view_pull_mm"), 0.2);
  EXPECT_LT(figure(verdict, "view_pull_deg"), 0.01);
  EXPECT_EQ(figure(verdict, "warnings"), 0);
}

TEST(VerdictEvidence, SeesAnotherMinimumThatIsAsGood) {
  Trial trial;
  for (auto& wells : trial.cost.views) wells.push_back({trial.moved_by({0, 0, 40, 0, 0, 0}), 0.9});
  const Verdict verdict = trial.verdict();
  EXPECT_NEAR(figure(verdict, "other_minimum"), 1, 0.02);
  EXPECT_LT(figure(verdict, "better_minimum"), 0.02);
}

TEST(VerdictEvidence, SeesABetterMinimum) {
  Trial trial;
  for (auto& wells : trial.cost.views) {
    wells[0].depth = 0.5;
    wells.push_back({trial.moved_by({0, 0, 0, 0, 0, 14}), 0.9});
  }
  const Verdict verdict = trial.verdict();
  EXPECT_GT(figure(verdict, "other_minimum"), 1.5);
  EXPECT_NEAR(figure(verdict, "better_minimum"), figure(verdict, "other_minimum") - 1, 1e-9);
}

TEST(VerdictEvidence, SeesViewsThatPullApart) {
  // The lateral view shows the bone 2 mm further along the world's y, which lies in both images.
  Trial trial;
  trial.cost.views[1][0].pose.translation_mm.y() += 2;
  EXPECT_NEAR(figure(trial.verdict(), "view_pull_mm"), 2, 0.1);
  // Rotated about the long axis by 6 degrees.
  trial.cost.views[1][0].pose = trial.moved_by({0, 0, 6, 0, 0, 0});
  EXPECT_NEAR(figure(trial.verdict(), "view_pull_deg"), 6, 0.2);
}

TEST(VerdictEvidence, SaysHowFarTheOtherCostsPoseIs) {
  Trial trial;
  trial.inputs["contour_pose"] = item(trial.pose_moved_by({0, 0, 7, 0, 0, 0}));
  EXPECT_NEAR(figure(trial.verdict(), "contour_apart_deg"), 7, 1e-6);
  const Pose contour = trial.pose_moved_by({0, 0, 0, 3, 0, 4});
  trial.inputs["contour_pose"] = item(contour);
  EXPECT_NEAR(figure(trial.verdict(), "contour_apart_mm"), 5, 1e-6);
  // Without it, the stage 'first' takes its place.
  trial.inputs.erase("contour_pose");
  trial.inputs["stages"] = list(named("start", trial.pose, "first", contour), "stage");
  EXPECT_NEAR(figure(trial.verdict(), "contour_apart_mm"), 5, 1e-6);
}

TEST(VerdictEvidence, MeasuresTheOutlineAgainstTheEdges) {
  Trial trial;
  std::vector<OutlinePoint> borders;
  EdgeMap map{200, 200, {}};
  // Two straight borders with an edge pixel beside each point. The right one lies 1 px off its edges on the upper half,
  // and has none on the lowest tenth.
  for (int v = 50; v < 150; ++v)
    for (const int side : {-1, 1}) {
      const float u = 99.5f + float(side) * 18;
      borders.push_back({u, float(v), float(side), 0, {float(side) * 15, 0, float(v - 100)}});
      if (side > 0 && v >= 140) continue;
      const float off = side > 0 && v < 100 ? 1.f : 0.f;
      map.pixels.push_back({u + off, float(v), float(side), 0, 100});
    }
  trial.inputs["edges"] = per_view("frontal", map, "lateral", map);
  trial.inputs["projector"] =
      function<OutlineProjector>(outline_of([=](const Camera&, const RigidTransform&, double) { return borders; }));
  const Verdict verdict = trial.verdict();
  // A pixel is 0.8 mm at 800 mm from the source; the bone is about 6 mm farther away.
  EXPECT_NEAR(figure(verdict, "outline_part_mm"), 0.8, 0.05);
  EXPECT_LT(figure(verdict, "outline_spread_mm"), 0.05);
  EXPECT_NEAR(figure(verdict, "unexplained"), 0.05, 0.015);
  trial.inputs["edges"] = per_view("oblique", map);
  trial.inputs["cost"] = Value::of<Cost>(std::make_shared<const Wells>(trial.cost));
  EXPECT_EQ(shipped::refusal("verdict.evidence", trial.inputs),
            "view 'frontal': there is no edge map of that name; make the edges from the same list of views");
}

/// Everything below z = -40 mm of the model is bone.
SignedField floor_of_bone() {
  return field_by(grid_at({3, 3, 3}, Vector3d::Constant(-100), Vector3d::Constant(100)),
                  [](const Vector3d& p) { return p.z() + 40; });
}

TEST(VerdictEvidence, SeesThatBonesIntersect) {
  Trial trial;
  // The other bone ends at z = -34, and the box at -50.
  const Pose other = trial.pose_moved_by({0, 0, 0, 0, 0, 6});
  trial.inputs["others"] = per_fragment("distal", trial.pose, "proximal", other);
  trial.inputs["other_bones"] = per_fragment("proximal", floor_of_bone());
  EXPECT_NEAR(figure(trial.verdict(), "intersection_mm"), 16, 0.5);
  trial.inputs.erase("other_bones");
  EXPECT_EQ(shipped::refusal("verdict.evidence", trial.inputs),
            "others and other_bones belong together; wire both or none");
}

/// A file with this text, in a folder that goes with the test.
struct ModelFile {
  std::filesystem::path path;
  explicit ModelFile(const std::string& text) {
    path = std::filesystem::temp_directory_path() / ("marrow_failure_model_" + std::to_string(::getpid()) + ".yaml");
    std::ofstream(path) << text;
  }
  ~ModelFile() { std::filesystem::remove(path); }
  Options options() const { return {{"failure_model", path}}; }
};

std::string model_of(double bias, const std::string& terms) {
  return "marrow-failure-model: 1\nrecord: made by hand\nbias: " + std::to_string(bias) +
         "\ndoubtful_above: 0.1\nwrong_above: 0.5\nterms:\n" + terms;
}

/// It alone trusts a pose without warnings.
const std::string kTrusting = model_of(-9, "  - {figure: warnings, scale: 1, weight: 1, absent: 0}\n");

TEST(VerdictEvidence, TheModelGivesTheProbability) {
  Trial trial;
  trial.pose.warnings = {"one", "two", "three"};
  trial.inputs["pose"] = item(trial.pose);
  // log odds = bias + 2 log(1 + 3 / 1), and 0.5 log(1 + 4 / 2) for a figure that is absent
  const std::string terms =
      "  - {figure: warnings, scale: 1, weight: 2, absent: 0}\n"
      "  - {figure: contour_apart_mm, scale: 2, weight: 0.5, absent: 4}\n";
  const double log_odds = 2 * std::log(4) + 0.5 * std::log(3);
  struct Case {
    double bias;
    Judgement judgement;
  };
  for (const auto& [bias, judgement] : {Case{-log_odds + 1, Judgement::wrong}, Case{-log_odds - 1, Judgement::doubtful},
                                        Case{-log_odds - 4, Judgement::trusted}}) {
    const Verdict verdict = trial.verdict(ModelFile(model_of(bias, terms)).options());
    EXPECT_NEAR(verdict.failure_probability, 1 / (1 + std::exp(-(bias + log_odds))), 1e-5);
    EXPECT_EQ(verdict.judgement, judgement);
    ASSERT_EQ(verdict.reasons.size(), 1u);
    EXPECT_EQ(verdict.reasons[0], "warnings of the registration: 3");
    EXPECT_EQ(verdict.remedies.size(), judgement == Judgement::trusted    ? 0u
                                       : judgement == Judgement::doubtful ? 1u
                                                                          : 2u);
  }
}

// 5 mm along each axis: most errors of such a pose are above 2 mm. The uncertainty comes from the cameras, not from the
// search.
TEST(VerdictEvidence, SaysWhatThePredictedDeviationsLeaveOpen) {
  const ModelFile model(kTrusting);
  Trial trial;
  const auto verdict_with = [&](double deviation_mm, bool is_refined) {
    Pose pose = trial.pose;
    pose.covariance.emplace(Matrix6d::Zero());
    pose.covariance->diagonal().tail<3>().setConstant(deviation_mm * deviation_mm);
    trial.inputs["pose"] = item(pose);
    if (is_refined) trial.inputs["stages"] = list(named("last", trial.pose), "stage");
    return trial.verdict(model.options());
  };
  const double unknown = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(verdict_with(5, false).reasons.at(0).starts_with(
      "the predicted deviations allow a failure with a probability of 0.9"));
  EXPECT_EQ(verdict_with(unknown, false).reasons.at(0),
            "the predicted deviations allow a failure with a probability of 1.00");
  const Verdict refined = verdict_with(5, true);
  EXPECT_TRUE(
      refined.reasons.at(0).starts_with("with what is not known about the cameras, the bone's surface is known to "))
      << refined.reasons[0];
  EXPECT_EQ(
      refined.remedies,
      (Strings{
          "a check of what was given: the bone, the side, which image belongs to which camera, the signs of its angles",
          "cameras that are known better, by a calibration; then give refine.cameras smaller rotation_deg, shift_mm, "
          "focal_percent and centre_px"}));
  EXPECT_EQ(verdict_with(unknown, true).reasons.at(0),
            "the predicted deviations allow a failure with a probability of 1.00");
}

TEST(VerdictEvidence, APoseInAnotherBoneIsDoubtful) {
  Trial trial;
  trial.inputs["others"] = per_fragment("proximal", trial.pose_moved_by({0, 0, 0, 0, 0, 6}));
  trial.inputs["other_bones"] = per_fragment("proximal", floor_of_bone());
  const ModelFile model(kTrusting);
  Options options = model.options();
  const Verdict verdict = trial.verdict(options);
  EXPECT_EQ(verdict.judgement, Judgement::doubtful);
  EXPECT_EQ(verdict.reasons, Strings{"the bone reaches 16.0 mm into another bone"});
  options["max_intersection_mm"] = 20.0;
  EXPECT_EQ(trial.verdict(options).judgement, Judgement::trusted);
}

TEST(VerdictEvidence, WithoutAModelAPoseIsDoubtful) {
  Trial trial;
  const Verdict verdict = trial.verdict();
  EXPECT_EQ(verdict.judgement, Judgement::doubtful);
  EXPECT_TRUE(std::isnan(verdict.failure_probability));
  EXPECT_EQ(verdict.reasons, Strings{"there is no failure model, so the figures are not judged"});
}

std::string refusal(const std::string& text) {
  return message_of([&] { Trial().verdict(ModelFile(text).options()); });
}

TEST(VerdictEvidence, SaysWhatIsWrongWithAModel) {
  const std::string good = "  - {figure: warnings, scale: 1, weight: 2, absent: 0}\n";
  EXPECT_NE(refusal(model_of(0, "  - {figure: warnings, scale: 1, weight: -2, absent: 0}\n"))
                .find("weight: expected a number from 0 to 1e+06, got -2"),
            std::string::npos);
  EXPECT_NE(refusal(model_of(0, "  - {figure: luck, scale: 1, weight: 1, absent: 0}\n"))
                .find("there is no figure 'luck'; fit the model again with tools/studies/fit_verdict"),
            std::string::npos);
  EXPECT_NE(
      refusal("marrow-failure-model: 2\nrecord: x\nbias: 0\ndoubtful_above: 0.6\nwrong_above: 0.5\nterms:\n" + good)
          .find("doubtful_above: expected at most wrong_above"),
      std::string::npos);
  EXPECT_NE(refusal("marrow-failure-model: 1\nrecord: x\nbias: 0\ndoubtful_above: 0\nwrong_above: 0.5\nterms: []\n")
                .find("terms: expected a list of terms, each with figure, scale, weight and absent"),
            std::string::npos);
}

/// The images say nothing about it, with or without a sentence that says so.
struct Blind : Cost {
  std::string said;
  explicit Blind(std::string text) : said(std::move(text)) {}
  double value(const RigidTransform&) const override { return 0.5; }
  std::string nothing_compared(const RigidTransform&) const override { return said; }
  std::shared_ptr<const Cost> at_level(const CostLevel&) const override { return std::make_shared<Blind>(*this); }
};

TEST(VerdictEvidence, APoseOfWhichTheImagesSayNothingIsWrong) {
  Trial trial;
  const ModelFile model(kTrusting);
  const auto verdict_on = [&](const std::string& said, const Options& options) {
    trial.inputs["cost"] = Value::of<Cost>(std::make_shared<const Blind>(said));
    return output<Verdict>("verdict.evidence", "verdict", trial.inputs, options);
  };
  for (const Options& options : {Options(), model.options()}) {
    const Verdict verdict = verdict_on("view 'frontal': it shows nothing of the bone", options);
    EXPECT_EQ(verdict.judgement, Judgement::wrong);
    EXPECT_EQ(verdict.failure_probability, 1);
    EXPECT_EQ(verdict.reasons,
              Strings{"the images say nothing about this pose: view 'frontal': it shows nothing of the bone"});
  }
  EXPECT_EQ(
      verdict_on("", model.options()).reasons,
      Strings{"the images say nothing about this pose: the cost is the same at all poses within 16 degrees and mm"});
}

TEST(VerdictEvidence, DeviationsOfZeroAreNoKnowledge) {
  const ModelFile model(kTrusting);
  Trial trial;
  trial.pose.covariance.emplace(Matrix6d::Zero());
  trial.inputs["pose"] = item(trial.pose);
  const Verdict verdict = trial.verdict(model.options());
  EXPECT_EQ(verdict.judgement, Judgement::wrong);
  EXPECT_EQ(verdict.failure_probability, 1);
}

// The verdict depends on the pose, not on the way to it. The costs are wells about given poses, so the end of each
// search is known.

/// A failure model in which only the distance by contour and the number of warnings count.
std::string by_contour(double bias) {
  return model_of(bias,
                  "  - {figure: contour_apart_deg, scale: 1, weight: 0.5, absent: 0}\n"
                  "  - {figure: warnings, scale: 1, weight: 1, absent: 0}\n");
}

/// With a second cost that is least where the pose is turned by this angle about the long axis.
Trial with_second_cost(double turned_deg) {
  Trial trial;
  trial.second.views = {{{trial.moved_by({0, 0, turned_deg, 0, 0, 0}), 0.9}},
                        {{trial.moved_by({0, 0, turned_deg, 0, 0, 0}), 0.9}}};
  trial.inputs["contour_cost"] = Value::of<Cost>(std::make_shared<const Wells>(trial.second));
  return trial;
}

Value stages_by(const Trial& trial, double first_turned_deg) {
  return list(named("first", trial.pose_moved_by({0, 0, first_turned_deg, 0, 0, 0}), "final", trial.pose), "stage");
}

TEST(SamePose, WhereTheFirstSearchEndedDoesNotCount) {
  Trial trial = with_second_cost(1);
  const ModelFile model(by_contour(-5));
  trial.inputs["stages"] = stages_by(trial, 0);
  const Verdict one = trial.verdict(model.options());
  trial.inputs["stages"] = stages_by(trial, 9);
  const Verdict other = trial.verdict(model.options());
  EXPECT_EQ(hash_of(one), hash_of(other));
  EXPECT_NEAR(figure(one, "contour_apart_deg"), 1, 0.05);
}

TEST(SamePose, ATenthOfADegreeIsTheSamePose) {
  const ModelFile model(by_contour(-5));
  Numbers found;
  for (const double off : {-0.1, 0.0, 0.1}) {
    Trial trial = with_second_cost(3);
    trial.inputs["pose"] = item(trial.pose_moved_by({off, -off, off, 0.3 * off, 0, -0.3 * off}));
    found.push_back(trial.verdict(model.options()).failure_probability);
  }
  // log odds -5 + 0.5 log(1 + 3): a tenth of a degree changes them by 0.5 * 0.1 / 4.
  const double log_odds = -5 + 0.5 * std::log(4.0);
  for (const double probability : found) EXPECT_NEAR(std::log(probability / (1 - probability)), log_odds, 0.03);
}

TEST(SamePose, APoseFromWhichASecondCostLeadsAwayAsFarAsAFailureIsDoubtful) {
  Trial trial = with_second_cost(7.6);
  const ModelFile model(by_contour(-9));  // it alone trusts the pose
  const Verdict verdict = trial.verdict(model.options());
  EXPECT_LT(verdict.failure_probability, 0.001);
  EXPECT_EQ(verdict.judgement, Judgement::doubtful);
  EXPECT_EQ(verdict.reasons.at(0),
            "contour and grey values lead to poses 7.6 degrees apart about the long axis; both cannot be right");
  EXPECT_EQ(verdict.remedies.at(0), "another view, or a landmark off the long axis");
  EXPECT_EQ(with_second_cost(4).verdict(model.options()).judgement, Judgement::trusted);
}

TEST(SamePose, SoIsOneFromWhichItsOwnCostLeadsAway) {
  Trial trial;
  for (auto& view : trial.cost.views) view = {{trial.moved_by({0, 0, 0, 0, 0, 3}), 0.9}};
  const ModelFile model(by_contour(-9));
  const Verdict verdict = trial.verdict(model.options());
  EXPECT_NEAR(figure(verdict, "apart_mm"), 3, 0.05);
  EXPECT_EQ(verdict.judgement, Judgement::doubtful);
  EXPECT_EQ(verdict.reasons.at(0), "the cost leads to a pose 3.00 mm away; both cannot be right");
}

}  // namespace marrow::test::evidence_test
