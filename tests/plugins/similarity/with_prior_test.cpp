// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/analytic/body.hpp"
#include "marrow/toolbox/field/interior.hpp"
#include "marrow/toolbox/match/bones_together.hpp"
#include "tests/plugins/register/bowl.hpp"

namespace marrow::test::with_prior_test {

constexpr double kInformation = 1e4, kUnit = 2 / kInformation;

const FragmentFrame kFrame{Vector3d(5, -3, 80), rotation_from_vector({0.1, -0.2, 0.3})};
const RigidTransform kTruth = placed({12, -7, 30}, {0.2, 0.1, -0.4});
Pose truth() {
  Pose pose = pose_of(kTruth);
  pose.frame = kFrame;
  return pose;
}
Pose away(double rx, double ry, double rz, double tx, double ty, double tz) {
  return well::pose_at(truth(), rx, ry, rz, tx, ty, tz);
}
/// Two deviations about the long axis, if one is 5 degrees.
const RigidTransform kTurned = away(0, 0, 10, 0, 0, 0).world_from_model;

/// With deviations of rotations across the long axis and about it [deg], and of translations [mm].
Pose known_to(const Pose& pose, double rotations_deg, double axial_deg, double shifts_mm) {
  return with_deviations(pose, {rotations_deg, rotations_deg, axial_deg, shifts_mm, shifts_mm, shifts_mm});
}

/// The expansion of any cost, by differences of its values.
Cost::Expansion by_differences(const Cost& cost, const RigidTransform& pose, const FragmentFrame& frame) {
  constexpr double kStep = 1e-4;
  const auto at = [&](const Vector6d& motion) { return cost.value(marrow::moved(pose, frame, motion)); };
  Cost::Expansion about;
  about.value = cost.value(pose);
  for (int i = 0; i < 6; ++i) {
    const Vector6d a = kStep * Vector6d::Unit(i);
    about.gradient[i] = (at(a) - at(-a)) / (2 * kStep);
    for (int j = 0; j < 6; ++j) {
      const Vector6d b = kStep * Vector6d::Unit(j);
      about.curvature(i, j) = (at(a + b) - at(a - b) - at(b - a) + at(-a - b)) / (4 * kStep * kStep);
    }
  }
  return about;
}

/// A bowl about the truth with derivatives, whose curvature is 1 per square degree and mm. Its minimum is known to 0.01
/// degrees and mm. So the noise of its value is 1e-4, and a unit of the prior counts twice this. Without one of its two
/// blocks it is tilted to one side, without the other to the other side.
class Images : public well::Bowl {
 public:
  explicit Images(double tilt = 0, int blocks = 2, const std::string& silence = "")
      : Bowl(kTruth, kFrame, Matrix6d::Identity(), kInformation), tilt_(tilt), blocks_(blocks), silence_(silence) {}
  std::optional<Expansion> expansion(const RigidTransform& pose, const FragmentFrame& frame) const override {
    return by_differences(*this, pose, frame);
  }
  std::vector<Expansion> expansion_without_each_block(const RigidTransform& pose,
                                                      const FragmentFrame& frame) const override {
    std::vector<Expansion> without(std::size_t(blocks_), by_differences(*this, pose, frame));
    for (std::size_t i = 0; i < without.size(); ++i) without[i].gradient += Vector6d::Constant(i == 0 ? tilt_ : -tilt_);
    return without;
  }
  std::string nothing_compared(const RigidTransform&) const override { return silence_; }
  Strings silent_views(const RigidTransform&) const override {
    return silence_.empty() ? Strings() : Strings{silence_};
  }

 private:
  double tilt_;
  int blocks_;
  std::string silence_;
};

struct Trial {
  explicit Trial(const Pose& prior, const Images& of = Images())
      : images(std::make_shared<const Images>(of)),
        inputs{{"cost", Value::of<Cost>(images)},
               {"prior", item(prior)},
               {"found", item(known_to(truth(), 0.01, 0.01, 0.01))}} {}
  std::shared_ptr<const Cost> cost(const Options& options = {}) const {
    return cost_by("similarity.with_prior", inputs, with({{"degrees_of_freedom", 4.0}}, options));
  }
  /// What a prior adds, in its units.
  double added(const Cost& cost, const RigidTransform& pose) const {
    return (cost.value(pose) - images->value(pose)) / kUnit;
  }
  std::shared_ptr<const Images> images;
  Inputs inputs;
};

TEST(WithPrior, AddsMinusTheLogarithmOfStudentsT) {
  const Trial trial(known_to(truth(), 1, 5, 3));
  const auto cost = trial.cost();
  EXPECT_NEAR(cost->value(kTruth), 0, 1e-12);
  // 10 degrees about the long axis are two deviations: q = 4; (4 + 6) / 2 log(1 + 4 / 10) = 1.68236.
  EXPECT_NEAR(trial.added(*cost, kTurned), 1.68236, 1e-5);
  // One deviation along each of two axes: q = 2; 5 log(1.2) = 0.911608.
  const auto shifted = away(0, 0, 0, 3, -3, 0).world_from_model;
  EXPECT_NEAR(trial.added(*cost, shifted), 0.911608, 1e-5);
  // With many degrees of freedom nearly q / 2.
  EXPECT_NEAR(trial.added(*trial.cost({{"degrees_of_freedom", 1000.0}}), kTurned), 2, 0.01);
  EXPECT_EQ(cost->values({kTurned, shifted}), (Numbers{cost->value(kTurned), cost->value(shifted)}));
  EXPECT_EQ(cost->view_count(), 0u) << "it cannot be split into views";
}

TEST(WithPrior, CountsTheSameAtEachLevelOfTheCost) {
  const Trial trial(known_to(truth(), 1, 5, 3));
  EXPECT_NEAR(trial.added(*trial.cost()->at_level({3, 12, 4}), kTurned), 1.68236, 1e-5);
  ASSERT_EQ(trial.images->levels.size(), 1u);
  EXPECT_EQ(trial.images->levels[0].contour_spacing_px, 3);
}

TEST(WithPrior, ItsDerivativesAreThoseOfItsValues) {
  Pose prior = known_to(away(8, -5, 30, 4, -6, 9), 2, 5, 3);
  prior.frame = {Vector3d(-20, 30, 60), rotation_from_vector({-0.3, 0.1, 1.1})};  // not the bone's
  const Trial trial(prior);
  const auto cost = trial.cost();
  for (const Pose& at : {truth(), away(-3, 12, -40, 7, 0, 5)}) {
    const auto about = cost->expansion(at.world_from_model, kFrame);
    ASSERT_TRUE(about);
    EXPECT_NEAR(about->value, cost->value(at.world_from_model), 1e-12);
    const Cost::Expansion differences = by_differences(*cost, at.world_from_model, kFrame),
                          images = by_differences(*trial.images, at.world_from_model, kFrame);
    const Vector6d by_prior = differences.gradient - images.gradient;
    EXPECT_LT((about->gradient - differences.gradient).norm(), 1e-5 * by_prior.norm());
    EXPECT_GT(by_prior.norm(), 1e-4);
    EXPECT_GE(eigen_of_symmetric<6>(Matrix6d(about->curvature - images.curvature)).values[0], -1e-9);
  }
}

TEST(WithPrior, InTheMiddleItsCurvatureIsTheInverseOfTheCovariance) {
  const Pose prior = known_to(truth(), 2, 5, 3);
  const Trial trial(prior);
  const auto about = trial.cost()->expansion(kTruth, kFrame), images = trial.images->expansion(kTruth, kFrame);
  const Matrix6d expected = kUnit * prior.covariance->inverse();
  EXPECT_LT((about->curvature - images->curvature - expected).norm(), 1e-3 * expected.norm());
}

TEST(WithPrior, ItsSixResidualsStandForItsCovariance) {
  // Without one of them the gradient changes by unit * a column of L, and L L^T is the inverse of the covariance.
  const Pose prior = known_to(truth(), 2, 5, 3);
  const auto cost = Trial(prior).cost();
  const auto without = cost->expansion_without_each_block(kTruth, kFrame);
  ASSERT_EQ(without.size(), 2u + 6);
  const Vector6d whole = cost->expansion(kTruth, kFrame)->gradient;
  Matrix6d sum = Matrix6d::Zero();
  for (std::size_t i = 2; i < without.size(); ++i)
    sum += (without[i].gradient - whole) * (without[i].gradient - whole).transpose();
  const Matrix6d expected = kUnit * kUnit * prior.covariance->inverse();
  EXPECT_LT((sum - expected).norm(), 1e-6 * expected.norm());
  // The same by values, for a motion of one deviation about the long axis.
  const auto turned = away(0, 0, 5, 0, 0, 0).world_from_model;
  const Numbers values = cost->without_each_block(turned);
  ASSERT_EQ(values.size(), 12u + 6);
  double squares = 0;
  for (std::size_t i = 12; i < values.size(); ++i) squares += std::pow(values[i] - cost->value(turned), 2);
  EXPECT_NEAR(squares / (kUnit * kUnit), 10.0 / 11, 1e-6) << "q = 1, and the weight of Student's t is 10 / 11";
}

// If the noise is four times as large as the blocks show, each block shows half the deviation.
TEST(WithPrior, WhatABlockChangesGrowsWithTheNoise) {
  const Trial trial(known_to(truth(), 2, 5, 3), Images(0.1));
  const auto turned = away(0, 0, 5, 0, 0, 0).world_from_model;
  const Numbers of_images = trial.images->without_each_block(turned);
  for (const double times : {1.0, 4.0}) {
    const auto cost = trial.cost({{"noise_times", times}});
    const Numbers values = cost->without_each_block(turned);
    for (std::size_t i = 0; i < of_images.size(); ++i)
      EXPECT_NEAR(values[i] - cost->value(turned), std::sqrt(times) * (of_images[i] - trial.images->value(turned)),
                  1e-12);
    const Vector6d whole = cost->expansion(turned, kFrame)->gradient;
    const auto without = cost->expansion_without_each_block(turned, kFrame);
    for (int axis = 0; axis < 6; ++axis) {
      EXPECT_NEAR(without[0].gradient[axis] - whole[axis], 0.1 * std::sqrt(times), 1e-12);
      EXPECT_NEAR(without[1].gradient[axis] - whole[axis], -0.1 * std::sqrt(times), 1e-12);
    }
  }
}

TEST(WithPrior, ResidualsAloneAreNoDivisionIntoBlocks) {
  const auto cost = Trial(known_to(truth(), 2, 5, 3), Images(0, 0)).cost();
  ASSERT_TRUE(cost->expansion(kTruth, kFrame));
  EXPECT_EQ(cost->expansion_without_each_block(kTruth, kFrame).size(), 0u);
}

TEST(WithPrior, APriorIsNoImage) {
  const auto cost = Trial(known_to(truth(), 1, 5, 3), Images(0, 2, "view 'a': it is black")).cost();
  EXPECT_EQ(cost->nothing_compared(kTruth), "view 'a': it is black");
  EXPECT_EQ(cost->silent_views(kTruth), Strings{"view 'a': it is black"});
}

TEST(WithPrior, SaysWhatIsWrong) {
  const auto refusal = [](const Pose& prior, const Inputs& more = {}) {
    return shipped::refusal("similarity.with_prior", with(Trial(prior).inputs, more));
  };
  const Pose good = known_to(truth(), 1, 5, 3);
  EXPECT_EQ(refusal(truth()),
            "the prior has no covariance; take it from a node that predicts one, such as a fit of markers");
  for (const double none : {0.0, std::nan("")})
    EXPECT_EQ(refusal(known_to(truth(), 1, none, 3)),
              "the prior has a covariance that is not positive definite; take it from a node that predicts one, such "
              "as a fit of markers");
  EXPECT_EQ(refusal(good, {{"found", item(truth())}}),
            "the pose found by the images has no covariance; take it from a registration by a cost of the kind "
            "similarity, which predicts one");
  Pose other = good;
  other.world_from_model.source = "bone";
  EXPECT_EQ(refusal(other),
            "the prior leads from 'bone' to 'world', but the pose found by the images from 'ct' to 'world'; give poses "
            "of the same model");
}

}  // namespace marrow::test::with_prior_test

// similarity.with_contact, on two balls whose distance is known.
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
