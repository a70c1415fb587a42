// SPDX-License-Identifier: Apache-2.0
#include "marrow/base/number_text.hpp"
#include "tests/plugins/verdict/wells.hpp"

namespace marrow::test::predicted_test {

using wells::figure;
using Texts = Strings;

/// A box of 20 x 20 x 100 mm about the origin.
Mesh box() { return test::box({0, 0, 0}, {20, 20, 100}); }

/// A pose with standard deviations about (degrees) and along (mm) the box's axes.
Pose pose_with(const Vector6d& deviations) {
  return with_deviations(pose_at({10, -20, 800}, {0.1, -0.7, 1.3}), deviations);
}

Verdict verdict_of(const Pose& pose, const Options& options = {}) {
  return output<Verdict>("verdict.predicted", "verdict", {{"pose", item(pose)}, {"model", item(box())}}, options);
}

TEST(VerdictPredicted, APoseThatIsKnownWellIsTrusted) {
  const Verdict verdict = verdict_of(pose_with({0.1, 0.1, 0.5, 0.1, 0.1, 0.1}));
  EXPECT_EQ(verdict.judgement, Judgement::trusted);
  EXPECT_EQ(verdict.failure_probability, 0);
  ASSERT_EQ(verdict.reasons.size(), 1u);
  EXPECT_EQ(verdict.reasons[0],
            "the bone's surface is known to 0.2 mm, and the rotation about the long axis to 0.5 degrees");
  EXPECT_EQ(verdict.remedies, Texts{});
}

TEST(VerdictPredicted, TheProbabilityIsThatOfTheNormalDistribution) {
  // A rotation about the long axis with a deviation of 5 degrees is off by more than 5 degrees with probability 0.317.
  // It moves the box's surface by less than 2 mm, unless it is above 8 degrees.
  Verdict verdict = verdict_of(pose_with({0, 0, 5, 0, 0, 0}));
  EXPECT_EQ(verdict.judgement, Judgement::doubtful);
  EXPECT_NEAR(verdict.failure_probability, 0.317, 0.015) << "10000 draws: three standard deviations";
  EXPECT_NEAR(figure(verdict, "predicted_axial_deg"), 5, 0.5);
  // A shift moves every point by as much: above 2 mm with the same probability.
  verdict = verdict_of(pose_with({0, 0, 0, 0, 0, 2}));
  EXPECT_NEAR(verdict.failure_probability, 0.317, 0.015);
  EXPECT_NEAR(figure(verdict, "predicted_mtre_mm"), 2, 0.2);
  EXPECT_EQ(figure(verdict, "predicted_axial_deg"), 0);
}

TEST(VerdictPredicted, SaysWhichDirectionIsNotKnownAndWhatWouldSettleIt) {
  Verdict verdict = verdict_of(pose_with({0, 0, 5, 0, 0, 0}));
  EXPECT_EQ(verdict.reasons.at(0), formatted("the rotation about the long axis is known to {:.1f} degrees only",
                                             figure(verdict, "predicted_axial_deg")));
  EXPECT_EQ(verdict.remedies.at(0), "another view, or a landmark off the long axis");
  verdict = verdict_of(pose_with({0, 0, 0, 0, 0, 2}));
  EXPECT_EQ(verdict.reasons,
            Texts{formatted("the bone's surface is known to {:.1f} mm only", figure(verdict, "predicted_mtre_mm"))});
  EXPECT_EQ(verdict.remedies, Texts{"another view, from a different direction"});
  verdict = verdict_of(pose_with({0, 0, 40, 0, 0, 0}));
  EXPECT_EQ(verdict.reasons.size(), 2u) << "40 degrees move the surface, too";
  EXPECT_TRUE(verdict.reasons.at(0).starts_with("the rotation about the long axis")) << "the weightier first";
}

TEST(VerdictPredicted, IsWrongAboveHalf) {
  const Pose pose = pose_with({0, 0, 15, 0, 0, 0});  // above 5 degrees with probability 0.74
  EXPECT_EQ(verdict_of(pose).judgement, Judgement::wrong);
  EXPECT_EQ(verdict_of(pose, {{"wrong_above", 0.9}}).judgement, Judgement::doubtful);
  EXPECT_EQ(verdict_of(pose, {{"doubtful_above", 0.9}, {"wrong_above", 0.95}}).judgement, Judgement::trusted);
  EXPECT_TRUE(declares("verdict.predicted", below("doubtful_above", "wrong_above")));
}

TEST(VerdictPredicted, WithoutPredictionItIsDoubtful) {
  Pose pose = pose_with(Vector6d::Zero());
  pose.covariance.reset();
  const Verdict verdict = verdict_of(pose);
  EXPECT_EQ(verdict.judgement, Judgement::doubtful);
  EXPECT_TRUE(std::isnan(verdict.failure_probability));
  EXPECT_EQ(verdict.reasons,
            Texts{"the registration predicts no deviations, so nothing says how far the pose may be off"});
  EXPECT_EQ(verdict.remedies, Texts{"a registration that predicts its deviations"});
}

TEST(VerdictPredicted, AnUndeterminedPoseIsWrong) {
  const Verdict verdict = verdict_of(pose_with(Vector6d::Constant(HUGE_VAL)));
  EXPECT_EQ(verdict.judgement, Judgement::wrong);
  EXPECT_EQ(verdict.failure_probability, 1);
  EXPECT_EQ(verdict.reasons, Texts{"the images do not determine the pose in every direction"});
  EXPECT_EQ(verdict.remedies, Texts{"another view, or a landmark"});
}

TEST(VerdictPredicted, AWarningMakesItDoubtful) {
  Pose pose = pose_with({0.1, 0.1, 0.5, 0.1, 0.1, 0.1});
  pose.warnings = {"the search ended at its limit"};
  const Verdict verdict = verdict_of(pose);
  EXPECT_EQ(verdict.judgement, Judgement::doubtful);
  EXPECT_EQ(verdict.failure_probability, 0);
  EXPECT_EQ(verdict.reasons.at(0), "the registration warns: the search ended at its limit");
  EXPECT_EQ(verdict.remedies, Texts{"a look at the overlay of each view"});
}

/// The verdict on a pose that is known well, with this distance of its outline from the edges in the second of two
/// views.
Verdict verdict_beside_edges(double median_px, const Options& options = {}) {
  Metrics distance;
  distance.items = {{"median_px", 0.5, "px"}, {"first_median_px", 0.4, "px"}, {"second_median_px", median_px, "px"}};
  return output<Verdict>(
      "verdict.predicted", "verdict",
      {{"pose", item(pose_with({0.1, 0.1, 0.5, 0.1, 0.1, 0.1}))}, {"model", item(box())}, {"distance", item(distance)}},
      options);
}

TEST(VerdictPredicted, AnOutlineBesideTheEdgesMakesItDoubtful) {
  const Verdict verdict = verdict_beside_edges(3.5);
  EXPECT_EQ(verdict.judgement, Judgement::doubtful);
  EXPECT_EQ(verdict.reasons.at(0), "view 'second': half of the outline lies 3.5 pixels or more from the nearest edge");
  EXPECT_EQ(verdict.remedies, Texts{"a look at the overlay of this view, and a start nearer to the pose"});
  EXPECT_EQ(figure(verdict, "outline_distance_px"), 3.5);
  EXPECT_EQ(verdict_beside_edges(2.5).judgement, Judgement::trusted);
  EXPECT_EQ(verdict_beside_edges(3.5, {{"beside_px", 4.0}}).judgement, Judgement::trusted);
  EXPECT_EQ(verdict_beside_edges(std::nan("")).judgement, Judgement::doubtful) << "nothing was compared there";
}

TEST(VerdictPredicted, ADistanceOfNoViewIsRefused) {
  EXPECT_EQ(refusal("verdict.predicted", {{"pose", item(pose_with({0.1, 0.1, 0.5, 0.1, 0.1, 0.1}))},
                                          {"model", item(box())},
                                          {"distance", item(Metrics())}}),
            "the distance has no figure of a view, such as frontal_median_px; wire evaluate.outline_distance");
}

/// The verdict on a pose with a cost of 1, beside another pose.
Verdict beside(double apart_deg, double cost, const Options& options = {}) {
  Pose pose = pose_with({0.1, 0.1, 0.5, 0.1, 0.1, 0.1}), other = pose;
  pose.cost = 1, other.cost = cost;
  other.world_from_model.rotation = rotation_from_vector({0, radians(apart_deg), 0}) * pose.world_from_model.rotation;
  return output<Verdict>("verdict.predicted", "verdict",
                         {{"pose", item(pose)}, {"model", item(box())}, {"other", item(other)}}, options);
}

TEST(VerdictPredicted, AnotherPoseThatFitsNearlyAsWellMakesItDoubtful) {
  const Verdict verdict = beside(18, 1.1);
  EXPECT_EQ(verdict.judgement, Judgement::doubtful);
  EXPECT_EQ(
      verdict.reasons[0],
      "another pose, 18.0 degrees away, explains the images nearly as well: its cost is 1.10 times that of this one");
  EXPECT_EQ(beside(18, 1.3).judgement, Judgement::trusted) << "it costs clearly more";
  EXPECT_EQ(beside(18, 1.3, {{"clear_times", 1.5}}).judgement, Judgement::doubtful);
  EXPECT_EQ(beside(3, 1.0).judgement, Judgement::trusted) << "it is the same pose";
}

TEST(VerdictPredicted, RefusesAnotherBonesSurface) {
  Mesh mesh = box();
  mesh.frame = "elsewhere";
  EXPECT_EQ(
      refusal("verdict.predicted", {{"pose", item(pose_with({0, 0, 1, 0, 0, 1}))}, {"model", item(mesh)}}),
      "the model is in the frame 'elsewhere', but the pose takes points in 'ct'; give the model that was registered");
}

/// A prior that is turned by an angle about the long axis against a pose.
Pose prior_of(const Pose& pose, double turned_deg, double deviation_deg) {
  Pose prior = pose_with({1, 1, deviation_deg, 3, 3, 3});
  Vector6d turn = Vector6d::Zero();
  turn[2] = radians(turned_deg);
  prior.world_from_model = moved(pose.world_from_model, pose.frame, turn);
  return prior;
}
Verdict verdict_of(const Pose& pose, const Pose& prior, Context context = Context(), const Options& options = {}) {
  return output<Verdict>("verdict.predicted", "verdict",
                         {{"pose", item(pose)}, {"model", item(box())}, {"prior", item(prior)}}, options, context);
}

TEST(VerdictPredicted, APriorThatContradictsTheImagesMakesAPoseDoubtful) {
  // The pose is known to 3 degrees, the prior to 5: they differ by 4 = sqrt(5^2 - 3^2) degrees, give or take.
  const Pose pose = pose_with({0.1, 0.1, 3, 0.1, 0.1, 0.1});
  Heard listener;
  const Verdict verdict = verdict_of(pose, prior_of(pose, -20, 5), listener.context, {{"doubtful_above", 0.3}});
  EXPECT_EQ(verdict.judgement, Judgement::doubtful);
  EXPECT_NEAR(figure(verdict, "prior_axial_deg"), 20, 1e-6);
  EXPECT_NEAR(figure(verdict, "prior_axial_deviations"), 5, 1e-6);
  const std::string said =
      "the prior contradicts the images: they are 20.0 degrees apart about the long axis, 5.0 times the deviation "
      "expected of this difference";
  EXPECT_EQ(verdict.reasons.at(0), said);
  EXPECT_EQ(listener.warnings, Texts{said});
  EXPECT_EQ(verdict.remedies.back(),
            "a look at the markers, if the prior comes from these: has the skin slid, or one moved?");
}

TEST(VerdictPredicted, APriorThatAgreesChangesNoJudgement) {
  const Pose pose = pose_with({0.1, 0.1, 0.5, 0.1, 0.1, 0.1});
  Heard listener;
  const Verdict verdict = verdict_of(pose, prior_of(pose, 6, 5), listener.context);
  EXPECT_EQ(verdict.judgement, Judgement::trusted);
  EXPECT_NEAR(figure(verdict, "prior_axial_deviations"), 6 / std::sqrt(25 - 0.25), 1e-6);
  EXPECT_TRUE(listener.warnings.empty());
  // The limit is an option.
  EXPECT_EQ(verdict_of(pose, prior_of(pose, 6, 5), Context(), {{"contradicts_above", 1.2}}).judgement,
            Judgement::doubtful);
}

TEST(VerdictPredicted, WhereTheImagesSayNothingThereIsNothingToCompare) {
  const Pose pose = pose_with({0.1, 0.1, 4.99, 0.1, 0.1, 0.1});
  const Verdict verdict = verdict_of(pose, prior_of(pose, 20, 5));
  EXPECT_TRUE(std::isnan(figure(verdict, "prior_axial_deviations")));
  EXPECT_NEAR(figure(verdict, "prior_axial_deg"), 20, 1e-6);
}

TEST(VerdictPredicted, APriorNeedsACovariance) {
  const Pose pose = pose_with({0.1, 0.1, 0.5, 0.1, 0.1, 0.1});
  Pose prior = prior_of(pose, 0, 5);
  prior.covariance.reset();
  EXPECT_EQ(refusal("verdict.predicted", {{"pose", item(pose)}, {"model", item(box())}, {"prior", item(prior)}}),
            "the prior has no covariance; take it from a node that predicts one, such as a fit of markers");
}

TEST(VerdictPredicted, DeviationsOfZeroAreNoKnowledge) {
  const Verdict verdict = verdict_of(pose_with(Vector6d::Zero()));
  EXPECT_EQ(verdict.judgement, Judgement::wrong);
  EXPECT_EQ(verdict.failure_probability, 1);
  EXPECT_EQ(verdict.reasons, Texts{"the predicted deviations are 0, so the registration compared nothing"});
  EXPECT_EQ(verdict.remedies, Texts{"a start nearer to the bone, and a look at the masks and edges of each view"});
}

}  // namespace marrow::test::predicted_test

// The long axis is that of the bone's surface, whatever axes a pose came with. A box lies along an oblique direction.
// Its covariance is given about the CT's axes; what it means about the box's own follows by hand: both have the same
// origin, so C' = Q C Q^T of each 3 x 3 block, with the box's axes in the columns of Q.
namespace marrow::test::long_axis_test {

using wells::figure;

/// Turns z into an oblique direction.
Matrix3d turn() { return rotation_from_vector({0.5, -0.6, 0.2}); }

/// 20 x 24 x 100 mm about the origin, along the third column of turn().
Mesh oblique_box() {
  Mesh mesh = test::box({0, 0, 0}, {20, 24, 100});
  for (Vector3d& vertex : mesh.vertices_mm) vertex = turn() * vertex;
  return mesh;
}

/// A pose about the CT's axes whose deviation about the box's long axis is given; 0.05 degrees and mm else.
Pose known_to(double axial_deg) {
  constexpr double kOther = 0.05;
  Vector6d variance = Vector6d::Constant(kOther * kOther);
  variance.head<3>() *= radians(1) * radians(1);
  variance[2] = std::pow(radians(axial_deg), 2);
  Matrix6d q = Matrix6d::Zero();
  q.topLeftCorner<3, 3>() = q.bottomRightCorner<3, 3>() = turn();
  Pose pose = pose_at({5, -3, 700});
  pose.covariance = q * variance.asDiagonal() * q.transpose();
  return pose;
}

Verdict verdict_on(const Pose& pose, const Pose* prior = nullptr) {
  Inputs inputs{{"pose", item(pose)}, {"model", item(oblique_box())}};
  if (prior) inputs["prior"] = item(*prior);
  return output<Verdict>("verdict.predicted", "verdict", inputs);
}

TEST(LongAxis, ThePredictedDeviationIsAboutTheBonesAxis) {
  // About the CT's z the deviation is only sqrt(sum_k Q_zk^2 v_k).
  EXPECT_NEAR(figure(verdict_on(known_to(0.624)), "predicted_axial_deg"), 0.624, 0.02);
  const Verdict verdict = verdict_on(known_to(4));
  EXPECT_NEAR(figure(verdict, "predicted_axial_deg"), 4, 0.1);
  // 21.1 % of a normal distribution lie beyond 5 / 4 deviations.
  EXPECT_NEAR(verdict.failure_probability, 0.211, 0.02);
  EXPECT_EQ(verdict.reasons.at(0), "the rotation about the long axis is known to 4.0 degrees only");
}

TEST(LongAxis, SoIsTheDifferenceFromAPrior) {
  const Pose pose = known_to(3);
  Pose prior = known_to(5);
  prior.world_from_model.rotation = rotation_from_vector(radians(12) * turn().col(2));
  const Verdict verdict = verdict_on(pose, &prior);
  EXPECT_NEAR(figure(verdict, "prior_axial_deg"), 12, 1e-6);
  EXPECT_NEAR(figure(verdict, "prior_axial_deviations"), 12 / std::sqrt(25.0 - 9.0), 1e-6);
}

TEST(LongAxis, APriorMayHaveOtherAxesThanThePose) {
  const Pose pose = known_to(3), prior = known_to(5);
  const Pose turned = in_frame(prior, {Vector3d(30, -20, 100), rotation_from_vector({1, 2, -1})});
  EXPECT_NEAR(figure(verdict_on(pose, &turned), "prior_axial_deviations"), 0, 1e-6);
  Pose away = turned;
  away.world_from_model.rotation = rotation_from_vector(radians(12) * turn().col(2));
  EXPECT_NEAR(figure(verdict_on(pose, &away), "prior_axial_deviations"), 12 / std::sqrt(25.0 - 9.0), 1e-6);
}

}  // namespace marrow::test::long_axis_test
