// SPDX-License-Identifier: Apache-2.0
// similarity.with_contact, on two balls whose distance is known.
#include "marrow/toolbox/analytic/body.hpp"
#include "marrow/toolbox/field/bones_apart.hpp"
#include "marrow/toolbox/match/among_others.hpp"
#include "tests/plugins/register/bowl.hpp"

namespace marrow::test::with_contact_test {

constexpr double kRadius_mm = 10, kBand_mm = 4, kInformation = 1e4;
constexpr double kUnit = 2 / kInformation;  // noise_times is 2

analytic::Body ball() { return {{{0, 0, 0}, Vector3d::Constant(kRadius_mm)}}; }
std::shared_ptr<const SignedField> field() {
  static const auto kField =
      std::make_shared<const SignedField>(field_of(ball(), analytic::grid_of({61, 61, 61}, {0.5, 0.5, 0.5}), kBand_mm));
  return kField;
}
RigidTransform at(double x_mm) { return placed({x_mm, 0, 0}); }
Pose along_x(double x_mm) { return pose_of(at(x_mm)); }
/// The images know the place to this.
Pose known_to(const Pose& pose, double deg_and_mm) { return with_deviations(pose, Vector6d::Constant(deg_and_mm)); }

/// The ball 'own', beside 'other' at the origin. The images' cost is a bowl about 20 mm whose minimum is known to 0.01
/// degrees and mm, so a unit of the contact counts kUnit.
struct Trial {
  std::shared_ptr<const Cost> images =
      std::make_shared<well::Bowl>(at(20), FragmentFrame(), Matrix6d::Identity(), kInformation);
  std::shared_ptr<const SignedField> own = std::make_shared<const SignedField>(*field());
  Inputs inputs;

  Trial() {
    List<SignedField> fields;
    fields.add_shared("own", own);
    fields.add_shared("other", field());
    inputs = {
        {"cost", Value::of<Cost>(images)},         {"found", item(known_to(along_x(20), 0.01))},
        {"model", item(mesh_of(ball()))},          {"field", Value::of<SignedField>(own)},
        {"other_bones", list(fields, "fragment")}, {"poses", per_fragment("own", along_x(20), "other", along_x(0))}};
  }
  Value cost(const Options& options = {}) const { return call("similarity.with_contact", inputs, options).at("cost"); }
  /// What contact adds where the ball is, in units of the negative log-likelihood.
  double term(const Value& cost, double x_mm) const {
    return (cost.as<Cost>().value(at(x_mm)) - images->value(at(x_mm))) / kUnit;
  }
};

TEST(BonesApart, DepthsAndGapsOfBallsAreThoseOfTheirDistance) {
  const std::vector<Vector3d> surface = sample_surface(mesh_of(ball()), 8000);
  EXPECT_NEAR(field::deepest_mm(surface, *field(), at(17)), 3, 0.1);
  EXPECT_EQ(field::deepest_mm(surface, *field(), at(21)), 0);
  // A cap of height 3 mm whose depths are spread evenly from 0 to nearly 3: the mean of d^4 by that of d^2 is 9 * 3/5.
  EXPECT_NEAR(field::penetration_mm(surface, *field(), at(17)), 3 * std::sqrt(0.6), 0.1);
  EXPECT_EQ(field::penetration_mm(surface, *field(), at(21)), 0);
  for (const double gap_mm : {-1.0, 0.0, 2.0})  // within the weights' fall of 0.2 mm
    EXPECT_NEAR(field::gap_mm(surface, *field(), at(20 + gap_mm)), gap_mm + 0.15, 0.15);
  EXPECT_EQ(field::gap_mm(surface, *field(), at(200)), kBand_mm) << "no farther than the field knows";
}

TEST(WithContact, CostsNothingApartAndTheSquareOfTheDepthWithin) {
  const Trial trial;
  const Value cost = trial.cost({{"penetration_deviation_mm", 0.5}});
  EXPECT_NEAR(trial.term(cost, 20.5), 0, 1e-9);
  EXPECT_NEAR(trial.term(cost, 18), 0.5 * 0.6 * (2 / 0.5) * (2 / 0.5), 0.4);
  EXPECT_NEAR(trial.term(cost, 17) / trial.term(cost, 18.5), 4, 0.5) << "twice as deep";
}

TEST(WithContact, AJointCostsTheSquareOfWhatItsGapIsOff) {
  const Trial trial;
  const Value cost =
      trial.cost({{"joint", Strings{"own", "other"}}, {"joint_width_mm", 2.0}, {"joint_deviation_mm", 0.5}});
  // The gap counts as about 0.2 mm wider, because not only the nearest point counts.
  EXPECT_LT(trial.term(cost, 21.8), 0.1);
  EXPECT_NEAR(trial.term(cost, 20.8), 0.5 * 4, 0.4) << "two deviations too narrow";
  EXPECT_NEAR(trial.term(cost, 22.8), 0.5 * 4, 0.4) << "two too wide";
}

TEST(WithContact, FollowsTheOtherBones) {
  const Trial trial;
  const Value cost = trial.cost();
  const auto moved = match::among_others(cost.as<Cost>(), named("other", at(-3)));
  ASSERT_TRUE(moved);
  EXPECT_NEAR(moved->value(at(16)) - trial.images->value(at(16)),
              cost.as<Cost>().value(at(19)) - trial.images->value(at(19)), 1e-12);
}

TEST(WithContact, KeepsAnImageCostOffTheOtherBone) {
  Trial trial;  // its images want the ball 1 mm inside the other one, and know this to about 0.6 mm
  trial.images = std::make_shared<well::Bowl>(at(19), FragmentFrame(), Matrix6d::Identity(), 1);
  trial.inputs["cost"] = Value::of<Cost>(trial.images);
  trial.inputs["found"] = item(known_to(along_x(19), 0.6));
  const Value cost = trial.cost();
  EXPECT_GT(cost.as<Cost>().value(at(19)), cost.as<Cost>().value(at(19.8)));
  EXPECT_LT(trial.images->value(at(19)), trial.images->value(at(19.8)));
}

TEST(WithContact, RefusesWhatItCannotUse) {
  const auto refusal = [](const Inputs& more, const Options& options = {}) {
    return shipped::refusal("similarity.with_contact", with(Trial().inputs, more), options);
  };
  EXPECT_EQ(refusal({}, {{"joint", Strings{"own", "othr"}}}), "joint: there is no bone 'othr'; did you mean 'other'?");
  EXPECT_EQ(refusal({}, {{"joint", Strings{"own"}}}), "joint names 1 bones; name the two whose gap is known, or none");
  EXPECT_EQ(refusal({}, {{"joint", Strings{"own", "other"}}, {"joint_width_mm", 5.0}}),
            "joint_width_mm is 5, but the field of 'other' knows distances up to 4 mm only; raise band_mm of its "
            "segmentation");
  EXPECT_EQ(refusal({{"poses", per_fragment("own", along_x(20))}}),
            "other_bones has 'other', but poses has none of it; give the poses of the same fragments");
  Pose elsewhere;
  elsewhere.world_from_model.source = "bone";
  EXPECT_EQ(refusal({{"poses", per_fragment("own", along_x(20), "other", elsewhere)}}),
            "other_bones: 'other' is in frame 'ct', but its pose takes 'bone'; give the field of the bone that was "
            "registered");
  EXPECT_EQ(refusal({{"found", item(along_x(20))}}),
            "the pose found by the images has no covariance; take it from a registration by a cost of the kind "
            "similarity, which predicts one");
}

}  // namespace marrow::test::with_contact_test
