// SPDX-License-Identifier: Apache-2.0
// The parts of the search: the poses it looks at first, what it asks of the optimizer, and derivatives in its
// coordinates.
#include "marrow/toolbox/search/search.hpp"

#include <gtest/gtest.h>

#include "bowl.hpp"
#include "marrow/toolbox/search/compared.hpp"
#include "marrow/toolbox/search/derivatives.hpp"
#include "marrow/toolbox/search/predicted_covariance.hpp"
#include "marrow/toolbox/search/scan.hpp"
#include "tests/harness/message_of.hpp"

namespace search_test {

using marrow::Matrix6d;
using marrow::Pose;
using marrow::Vector6d;
using marrow::search::Found;
using marrow::search::kAllAxes;
using marrow::search::Scan;
using marrow::search::Search;
using marrow::search::SearchOptions;
using well::Bowl;
using well::Listener;
using well::pose_at;
using well::truth;

Vector6d motion(double rx, double ry, double rz, double tx, double ty, double tz) {
  Vector6d deg_and_mm;
  deg_and_mm << rx, ry, rz, tx, ty, tz;
  return deg_and_mm;
}

Bowl bowl(double information = 1) {
  return {truth().world_from_model, truth().frame, Matrix6d::Identity(), information};
}

Vector6d from_truth(const marrow::RigidTransform& pose) {
  return well::way(truth().world_from_model, pose, truth().frame);
}

TEST(Scan, OfTheAxisIsAGridWithinItsRanges) {
  SearchOptions options;
  options.scan_rotation_deg = 6;
  options.scan_rotation_step_deg = 2;
  options.scan_translation_mm = 0.3;
  options.scan_translation_step_mm = 0.1;  // three steps, although 0.3 / 0.1 is a little less than 3
  const Scan scan = marrow::search::axial_scan(options);
  ASSERT_EQ(scan.motions.size(), 7u * 7);
  EXPECT_TRUE(scan.motions.front().isApprox(motion(0, 0, -6, 0, 0, -0.3), 1e-12));
  EXPECT_TRUE(scan.motions[1].isApprox(motion(0, 0, -6, 0, 0, -0.2), 1e-12));
  EXPECT_TRUE(scan.motions.back().isApprox(motion(0, 0, 6, 0, 0, 0.3), 1e-12));
  // Two steps along either axis, and along both at once, are near; three are not.
  const auto at = [](int turn, int shift) { return (turn + 3) * 7 + shift + 3; };
  EXPECT_TRUE(scan.near(at(0, 0), at(2, 2)));
  EXPECT_TRUE(scan.near(at(-1, 1), at(1, -1)));
  EXPECT_FALSE(scan.near(at(0, 0), at(3, 0)));
  EXPECT_FALSE(scan.near(at(0, -1), at(0, 2)));
}

TEST(Scan, ScatteredPosesAreHaltons) {
  SearchOptions options;
  options.scan_poses = 7;
  options.scan_side_deg = 4;
  options.scan_rotation_deg = 6;
  options.scan_side_mm = 3;
  options.scan_translation_mm = 5;
  options.scan_reach = 0.5;
  const Scan scan = marrow::search::scattered_scan(options);
  ASSERT_EQ(scan.motions.size(), 7u);
  EXPECT_EQ(scan.motions[0], Vector6d(Vector6d::Zero()));
  // Of 1: 1/2, 1/3, 1/5, 1/7, 1/11, 1/13. Of 6, which is 110, 20, 11, 6, 6 and 6 in these bases: 3/8, 2/9, 6/25, 6/7,
  // 6/11, 6/13.
  EXPECT_TRUE(scan.motions[1].isApprox(
      motion(4 * 0, 4 * (2.0 / 3 - 1), 6 * (2.0 / 5 - 1), 3 * (2.0 / 7 - 1), 3 * (2.0 / 11 - 1), 5 * (2.0 / 13 - 1)),
      1e-12));
  EXPECT_TRUE(scan.motions[6].isApprox(motion(4 * (6.0 / 8 - 1), 4 * (4.0 / 9 - 1), 6 * (12.0 / 25 - 1),
                                              3 * (12.0 / 7 - 1), 3 * (12.0 / 11 - 1), 5 * (12.0 / 13 - 1)),
                                       1e-12));
  // Near is within an ellipsoid of half the ranges.
  Scan two = scan;
  const auto near = [&](const Vector6d& way) {
    two.motions = {motion(0.1, 0.2, 0.3, 0.1, 0.2, 0.3), motion(0.1, 0.2, 0.3, 0.1, 0.2, 0.3) + way};
    return two.near(0, 1);
  };
  EXPECT_TRUE(near(motion(0, 0, 2.99, 0, 0, 0)));
  EXPECT_FALSE(near(motion(0, 0, 3.01, 0, 0, 0)));
  EXPECT_FALSE(near(motion(2 * 0.8, 0, 3 * 0.8, 0, 0, 0)));
  EXPECT_TRUE(near(motion(0, 0, 0, 0, 0, 2.5 * 0.99)));
}

TEST(Search, TellsTheOptimizerStepsAndLimitsOfTheLevel) {
  SearchOptions options;
  options.max_evaluations = 123;
  const Bowl cost = bowl();
  const Listener listener;
  marrow::Context context;
  const Pose start = pose_at(truth(), 1, 2, 3, 4, 5, 6);
  Search search(listener, start, options, context);
  search.refine(cost, {2, 5, 0}, {0.5, 0.7, 0.9, 0.02}, 0, 1);
  search.refine(cost, kAllAxes, {0.5, 0.7, 0.9, 0.02}, 0, 1);
  ASSERT_EQ(listener.problems.size(), 2u);
  EXPECT_EQ(listener.problems[0].initial_step, Eigen::Vector3d(0.7, 0.9, 0.5));
  EXPECT_EQ(listener.problems[0].start, Eigen::Vector3d(0, 0, 0));
  EXPECT_EQ(listener.problems[1].initial_step, Eigen::VectorXd(motion(0.5, 0.5, 0.7, 0.9, 0.9, 0.9)));
  EXPECT_EQ(listener.problems[1].max_evaluations, 123);
  EXPECT_EQ(listener.problems[1].step_tolerance, 0.02);
  EXPECT_FALSE(listener.problems[1].expansion) << "the cost knows no derivatives";
  EXPECT_EQ(search.evaluations(), 14);
}

TEST(Search, GoesWhereTheOptimizerSays) {
  const Bowl cost = bowl();
  const Listener listener(true);
  marrow::Context context;
  const Pose start = truth();
  const SearchOptions options;
  Search search(listener, start, options, context);
  EXPECT_NEAR(search.refine(cost, {5, 2}, {1, 2, 3, 0.1}, 0, 1), 0.5 * 9, 1e-9);
  EXPECT_TRUE(from_truth(search.pose()).isApprox(motion(0, 0, 0, 0, 0, 3), 1e-9));
  EXPECT_NEAR(search.refine(cost, {1}, {1, 2, 3, 0.1}, 0, 1), 0.5 * (9 + 1), 1e-9);
}

TEST(Search, FollowsTheBestOfItsScanThroughAllLevels) {
  SearchOptions options;
  options.scan_rotation_deg = 3;
  options.scan_rotation_step_deg = 1;
  options.scan_translation_mm = 3;
  options.scan_translation_step_mm = 1;
  options.candidates = 3;
  options.finalists = 2;
  const Bowl cost = bowl();
  const Listener listener;
  marrow::Context context;
  const Pose start = pose_at(truth(), 0.5, 0, 1, 0, 0, -1);
  Search search(listener, start, options, context);
  const auto levels = marrow::search::levels_of(cost, options);
  const Found found = search.find(levels);
  // The grid's best is the one without the start's axial errors; the optimizer stays there.
  EXPECT_LT((from_truth(found.pose) - motion(0.5, 0, 0, 0, 0, 0)).norm(), 0.01) << from_truth(found.pose).transpose();
  EXPECT_EQ(from_truth(found.axial), from_truth(found.pose));
  EXPECT_NEAR(found.value, 0.125, 1e-3);
  // Each of three candidates about its axis and about all axes, then two finalists at two more levels.
  ASSERT_EQ(listener.problems.size(), 3u * 2 + 2 * 2);
  EXPECT_EQ(listener.problems[0].initial_step, Eigen::Vector2d(6, 3));
  EXPECT_EQ(listener.problems[1].initial_step, Eigen::VectorXd(motion(3, 3, 6, 3, 3, 3)));
  EXPECT_EQ(listener.problems[6].initial_step, Eigen::VectorXd(motion(1, 1, 3, 1, 1, 1)));
  EXPECT_EQ(listener.problems[7].initial_step, Eigen::VectorXd(motion(0.3, 0.3, 1, 0.3, 0.3, 0.3)));
  EXPECT_EQ(listener.problems[7].step_tolerance, 0.03);
  EXPECT_EQ(search.evaluations(), 7 * 7 + 10 * 7);
  ASSERT_EQ(cost.levels.size(), 3u);
  EXPECT_EQ(cost.levels[1].contour_spacing_px, 4);
  EXPECT_EQ(cost.levels[1].reach_px, 12);
  EXPECT_EQ(cost.levels[1].pixel_step, 0);
}

TEST(Search, RefusesLevelsWithoutPositiveNumbers) {
  const auto said = [](const SearchOptions& options) {
    return marrow::test::message_of([&] { marrow::search::check_options(options); });
  };
  SearchOptions options;
  EXPECT_EQ(said(options), "");
  options.step_mm = {3, 0, 0.3};
  EXPECT_EQ(said(options), "step_mm: each number must be positive");
  options.contour_spacing_px.clear();
  EXPECT_EQ(said(options), "contour_spacing_px: there is no level; give a number for one at least");
  options = {};
  options.reach_px = {24, 12};
  EXPECT_THROW(marrow::search::levels_of(bowl(), options), std::out_of_range)
      << "nothing is read past the end of a list that is too short";
}

TEST(Search, CandidatesAreNoNeighbours) {
  SearchOptions options;
  options.scan_rotation_deg = 9;
  options.scan_translation_mm = 0;
  options.candidates = 10;
  const Bowl cost = bowl();
  const Listener listener;
  marrow::Context context;
  const Pose start = truth();
  Search search(listener, start, options, context);
  search.find(marrow::search::levels_of(cost, options));
  // Of -9, -6 ... 9 degrees: 0, then -9 and 9, which are further than two steps of 3 from it.
  EXPECT_EQ(listener.problems.size(), 3u * 2 + 2);
}

TEST(Search, ItsWayIsTheLeastCostSoFar) {
  const Bowl cost = bowl(4);
  const Listener listener(true);
  marrow::Context context;
  const Pose start = pose_at(truth(), 0, 0, 0, 0, 0, -8);
  const SearchOptions options;
  Search search(listener, start, options, context);
  for (const double step : {3.0, 2.0, -1.0, 4.0})
    search.refine(cost, {5}, {1, 1, step, 0.1}, 0, 1);  // to -5, -3, -4 and 0
  const auto steps = search.convergence(cost);
  std::vector<double> costs;
  for (const auto& step : steps) costs.push_back(step.cost);
  ASSERT_EQ(costs.size(), 3u);
  EXPECT_NEAR(costs[0], 12.5, 1e-9);
  EXPECT_NEAR(costs[1], 4.5, 1e-9);
  EXPECT_NEAR(costs[2], 0, 1e-9);
  EXPECT_EQ(steps[0].evaluations, 1);
  EXPECT_EQ(steps[1].evaluations, 14);
  EXPECT_EQ(steps[2].evaluations, 28);
  const Pose pose = final_pose_of(search, start, cost, {}, options, context);
  EXPECT_NEAR(pose.cost, 0, 1e-9);
  EXPECT_EQ(pose.convergence.size(), 3u);
  ASSERT_TRUE(pose.covariance.has_value());
  EXPECT_NEAR((*pose.covariance)(3, 3), 1.0 / 4, 1e-6);
  const marrow::search::PredictedCovariance predicted(cost, search.pose(), start.frame);
  EXPECT_EQ(pose.evaluations, 28 + predicted.evaluations());
}

TEST(Search, ReportsItsProgress) {
  class Talker : public Listener {
   public:
    marrow::MinimisationResult minimise(const marrow::MinimisationProblem& problem) const override {
      for (const int evaluation : {49, 50, 100, 1000}) problem.observer(evaluation, problem.start, 1);
      return Listener::minimise(problem);
    }
  };
  std::vector<double> parts;
  marrow::Context::Hooks hooks;
  hooks.progress = [&](double part, std::string_view) { parts.push_back(part); };
  marrow::Context context(hooks);
  SearchOptions options;
  options.max_evaluations = 400;
  const Talker talker;
  const Pose start = truth();
  Search search(talker, start, options, context);
  search.refine(bowl(), kAllAxes, {}, 0.2, 0.4);
  ASSERT_EQ(parts.size(), 3u);
  EXPECT_NEAR(parts[0], 0.2 + 0.4 * 50 / 400, 1e-12);
  EXPECT_NEAR(parts[1], 0.2 + 0.4 * 100 / 400, 1e-12);
  EXPECT_NEAR(parts[2], 0.6, 1e-12) << "never more than its share";
}

TEST(Derivatives, AreThoseOfTheCoordinates) {
  // A cost with an expansion about every pose: s . q + q . A q / 2 for the shift q of a point of the model, and of its
  // turned axis.
  const marrow::FragmentFrame frame = truth().frame;
  const marrow::RigidTransform origin = truth().world_from_model;
  const auto value = [&](const Vector6d& deg_and_mm) {
    const marrow::RigidTransform pose = marrow::search::moved_by_units(origin, frame, deg_and_mm);
    return (pose * Eigen::Vector3d(30, -10, 120)).dot(Eigen::Vector3d(0.4, -0.3, 0.5)) +
           (pose.rotation * Eigen::Vector3d(20, 30, -10)).dot(Eigen::Vector3d(1, 2, -1));
  };
  for (const Vector6d& at : {motion(0, 0, 0, 0, 0, 0), motion(20, -30, 15, 3, -5, 8), motion(-3, 1, 40, 0, 0, 1)}) {
    // About the pose there, in rad and mm, by differences.
    const marrow::RigidTransform there = marrow::search::moved_by_units(origin, frame, at);
    const auto at_motion = [&](const Vector6d& small) {
      const marrow::RigidTransform pose = marrow::moved(there, frame, small);
      return (pose * Eigen::Vector3d(30, -10, 120)).dot(Eigen::Vector3d(0.4, -0.3, 0.5)) +
             (pose.rotation * Eigen::Vector3d(20, 30, -10)).dot(Eigen::Vector3d(1, 2, -1));
    };
    marrow::Cost::Expansion about;
    about.value = 3;
    for (int i = 0; i < 6; ++i)
      about.gradient[i] = (at_motion(1e-5 * Vector6d::Unit(i)) - at_motion(-1e-5 * Vector6d::Unit(i))) / 2e-5;
    about.curvature = about.gradient * about.gradient.transpose();
    const std::vector<int> axes{4, 0, 2, 1, 5};
    const auto told = marrow::search::in_coordinates(about, at, axes);
    EXPECT_EQ(told.value, 3);
    ASSERT_EQ(told.gradient.size(), 5);
    for (int k = 0; k < 5; ++k) {
      const Vector6d h = 1e-3 * Vector6d::Unit(axes[std::size_t(k)]);
      EXPECT_NEAR(told.gradient[k], (value(at + h) - value(at - h)) / 2e-3, 1e-6) << k;
    }
    EXPECT_TRUE(told.curvature.isApprox(told.gradient * told.gradient.transpose(), 1e-9));
  }
  EXPECT_TRUE(std::isnan(marrow::search::in_coordinates(std::nullopt, motion(0, 0, 0, 0, 0, 0), kAllAxes).value));
}

/// A constant, or not a number, without a sentence that says so.
class Blind : public marrow::Cost {
 public:
  explicit Blind(double value, std::string said = "") : value_(value), said_(std::move(said)) {}
  double value(const marrow::RigidTransform&) const override { return value_; }
  std::vector<double> without_each_block(const marrow::RigidTransform&) const override { return {value_, value_}; }
  std::shared_ptr<const marrow::Cost> at_level(const marrow::CostLevel&) const override {
    return std::make_shared<Blind>(*this);
  }
  std::string nothing_compared(const marrow::RigidTransform&) const override { return said_; }

 private:
  double value_;
  std::string said_;
};

/// What final_pose_of() says at the truth; empty if it gives a pose.
std::string refused(const marrow::Cost& cost) {
  const Listener listener;
  marrow::Context context;
  const Pose start = truth();
  const SearchOptions options;
  Search search(listener, start, options, context);
  return marrow::test::message_of([&] { final_pose_of(search, start, cost, {1, 1, 1, 0.1}, options, context); });
}

TEST(Search, APoseAboutWhichTheImagesSayNothingIsNoResult) {
  const std::string
      before = "the images say nothing about the pose that was found: ",
      remedy = "; give a start nearer to the bone, or see whether the masks, the edges and the model are right";
  EXPECT_EQ(refused(bowl()), "");
  EXPECT_EQ(refused(Blind(3)), before + "the cost is the same at all poses within 16 degrees and mm" + remedy);
  EXPECT_EQ(refused(Blind(0)), before + "the cost is the same at all poses within 16 degrees and mm" + remedy);
  EXPECT_EQ(refused(Blind(std::nan(""))), before + "the cost is not a number" + remedy);
  EXPECT_EQ(refused(Blind(3, "view 'a': it is black")), before + "view 'a': it is black" + remedy);
}

TEST(Search, ACostThatChangesInOneAxisAloneSaysSomething) {
  Matrix6d one = Matrix6d::Zero();
  one(5, 5) = 1;
  const Bowl groove(truth().world_from_model, truth().frame, one);
  EXPECT_EQ(marrow::search::nothing_compared(groove, truth().world_from_model, truth().frame), "");
  EXPECT_EQ(refused(groove), "");
}

}  // namespace search_test
