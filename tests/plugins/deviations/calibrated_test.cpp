// SPDX-License-Identifier: Apache-2.0
#include "tests/harness/node_test.hpp"

namespace marrow::test::calibrated_test {

/// A box of 20 x 30 x 100 mm about (1, 2, 3).
Mesh box() { return test::box({1, 2, 3}, {20, 30, 100}); }

/// A pose whose own axes are not those of the box, with deviations of 1 about and along each axis of the box.
Pose pose() {
  Pose pose;
  pose.frame = fragment_frame(box());
  pose.covariance = Matrix6d::Identity();
  FragmentFrame other = pose.frame;
  other.origin_mm += Vector3d(5, -7, 11);
  other.axes = (other.axes * rotation_from_vector({0.3, -0.2, 0.5})).eval();
  return in_frame(pose, other);
}

Outputs calibrated(const List<Pose>& stages, const Options& options) {
  return call("deviations.calibrated", {{"stages", shipped::list(stages, "stage")}, {"model", item(box())}}, options);
}

/// Standard deviations about and along the box's axes.
Vector6d deviations(const Pose& pose) {
  return in_frame(pose, fragment_frame(box())).covariance->diagonal().cwiseSqrt();
}

Vector6d six(double a, double b, double c, double d, double e, double f) {
  Vector6d all;
  all << a, b, c, d, e, f;
  return all;
}

TEST(DeviationsCalibrated, MultipliesTheDeviationsAboutAndAlongTheBonesAxes) {
  List<Pose> stages;
  stages.add("start", Pose());
  stages.add("first", pose());
  stages.add("final", pose());
  const auto outputs = calibrated(stages, {{"rotation_factors", Numbers{2, 3, 0.5}},
                                           {"translation_factors", Numbers{0.25, 1, 7}},
                                           {"first_rotation_factors", Numbers{1, 1, 9}},
                                           {"first_translation_factors", Numbers{1, 0.1, 1}}});
  const auto found = outputs.at("stages").as_list<Pose>();
  ASSERT_EQ(found.names(), stages.names());
  EXPECT_FALSE(found[0].covariance);
  EXPECT_LT((deviations(found[1]) - six(1, 1, 9, 1, 0.1, 1)).norm(), 1e-9);
  EXPECT_LT((deviations(found[2]) - six(2, 3, 0.5, 0.25, 1, 7)).norm(), 1e-9);
  const auto last = outputs.at("pose").as<Pose>();
  EXPECT_EQ(*last.covariance, *found[2].covariance);
  EXPECT_EQ(last.frame.origin_mm, pose().frame.origin_mm) << "the covariance is in the frame that it was in";
}

TEST(DeviationsCalibrated, WhereTheFirstStageIsTheLastTheFactorsAreThoseOfTheLast) {
  List<Pose> stages;
  stages.add("first", pose());
  const auto outputs = calibrated(stages, {{"rotation_factors", Numbers{2, 2, 2}}});
  EXPECT_LT((deviations(outputs.at("pose").as<Pose>()) - six(2, 2, 2, 1, 1, 1)).norm(), 1e-9);
}

TEST(DeviationsCalibrated, ADirectionThatIsNotKnownStaysUnknown) {
  Pose unknown = pose();
  (*unknown.covariance)(2, 2) = std::numeric_limits<double>::infinity();
  List<Pose> stages;
  stages.add("final", unknown);
  const auto outputs = calibrated(stages, {{"rotation_factors", Numbers{2, 2, 2}}});
  EXPECT_EQ(*outputs.at("pose").as<Pose>().covariance, *unknown.covariance);
}

TEST(DeviationsCalibrated, WithoutAPoseItSaysSo) {
  EXPECT_EQ(
      refusal("deviations.calibrated", {{"stages", shipped::list(List<Pose>(), "stage")}, {"model", item(box())}}),
      "there is no pose; wire the stages of a registration");
}

}  // namespace marrow::test::calibrated_test
