// SPDX-License-Identifier: Apache-2.0
// The parts of the search: the poses it looks at first, what it asks of the optimizer, and derivatives in its
// coordinates.
#include "marrow/toolbox/search/search.hpp"
#include "bowl.hpp"
#include "marrow/toolbox/search/predicted_covariance.hpp"

namespace marrow::test::search_test {

using search::Found;
using search::kAllAxes;
using search::Scan;
using search::Search;
using search::SearchOptions;
using well::Bowl;
using well::Listener;
using well::pose_at;
using well::truth;

Vector6d from_truth(const RigidTransform& pose) { return well::way(well::kTruth, pose, well::kFrame); }

/// A search by an optimizer that only listens.
struct Trial {
  explicit Trial(const Pose& from = truth(), const SearchOptions& with_options = {}, bool goes = false)
      : listener(goes), start(from), options(with_options), search(listener, start, options, context) {}
  Listener listener;
  Context context;
  Pose start;
  SearchOptions options;
  Search search;
};

TEST(Scan, OfTheAxisIsAGridWithinItsRanges) {
  SearchOptions options;
  options.scan_rotation_deg = 6;
  options.scan_rotation_step_deg = 2;
  options.scan_translation_mm = 0.3;
  options.scan_translation_step_mm = 0.1;  // three steps, although 0.3 / 0.1 is a little less than 3
  const Scan scan = search::axial_scan(options);
  ASSERT_EQ(scan.motions.size(), 7u * 7);
  EXPECT_TRUE(scan.motions.front().isApprox(Vector6d(0, 0, -6, 0, 0, -0.3), 1e-12));
  EXPECT_TRUE(scan.motions[1].isApprox(Vector6d(0, 0, -6, 0, 0, -0.2), 1e-12));
  EXPECT_TRUE(scan.motions.back().isApprox(Vector6d(0, 0, 6, 0, 0, 0.3), 1e-12));
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
  const Scan scan = search::scattered_scan(options);
  ASSERT_EQ(scan.motions.size(), 7u);
  EXPECT_EQ(scan.motions[0], Vector6d(Vector6d::Zero()));
  // Of 1: 1/2, 1/3, 1/5, 1/7, 1/11, 1/13. Of 6, which is 110, 20, 11, 6, 6 and 6 in these bases: 3/8, 2/9, 6/25, 6/7,
  // 6/11, 6/13.
  EXPECT_TRUE(scan.motions[1].isApprox(
      Vector6d(4 * 0, 4 * (2.0 / 3 - 1), 6 * (2.0 / 5 - 1), 3 * (2.0 / 7 - 1), 3 * (2.0 / 11 - 1), 5 * (2.0 / 13 - 1)),
      1e-12));
  EXPECT_TRUE(scan.motions[6].isApprox(Vector6d(4 * (6.0 / 8 - 1), 4 * (4.0 / 9 - 1), 6 * (12.0 / 25 - 1),
                                                3 * (12.0 / 7 - 1), 3 * (12.0 / 11 - 1), 5 * (12.0 / 13 - 1)),
                                       1e-12));
  // Near is within an ellipsoid of half the ranges.
  Scan two = scan;
  const auto near = [&](const Vector6d& way) {
    two.motions = {Vector6d(0.1, 0.2, 0.3, 0.1, 0.2, 0.3), Vector6d(0.1, 0.2, 0.3, 0.1, 0.2, 0.3) + way};
    return two.near(0, 1);
  };
  EXPECT_TRUE(near(Vector6d(0, 0, 2.99, 0, 0, 0)));
  EXPECT_FALSE(near(Vector6d(0, 0, 3.01, 0, 0, 0)));
  EXPECT_FALSE(near(Vector6d(2 * 0.8, 0, 3 * 0.8, 0, 0, 0)));
  EXPECT_TRUE(near(Vector6d(0, 0, 0, 0, 0, 2.5 * 0.99)));
}

TEST(Search, TellsTheOptimizerStepsAndLimitsOfTheLevel) {
  SearchOptions options;
  options.max_evaluations = 123;
  Trial trial(pose_at(truth(), 1, 2, 3, 4, 5, 6), options);
  trial.search.refine(Bowl(), {2, 5, 0}, {0.5, 0.7, 0.9, 0.02}, 0, 1);
  trial.search.refine(Bowl(), kAllAxes, {0.5, 0.7, 0.9, 0.02}, 0, 1);
  const auto& problems = trial.listener.problems;
  ASSERT_EQ(problems.size(), 2u);
  EXPECT_EQ(problems[0].initial_step, Vector3d(0.7, 0.9, 0.5));
  EXPECT_EQ(problems[0].start, Vector3d(0, 0, 0));
  EXPECT_EQ(problems[1].initial_step, Eigen::VectorXd(Vector6d(0.5, 0.5, 0.7, 0.9, 0.9, 0.9)));
  EXPECT_EQ(problems[1].max_evaluations, 123);
  EXPECT_EQ(problems[1].step_tolerance, 0.02);
  EXPECT_FALSE(problems[1].expansion) << "the cost knows no derivatives";
  EXPECT_EQ(trial.search.evaluations(), 14);
}

TEST(Search, GoesWhereTheOptimizerSays) {
  Trial trial(truth(), {}, true);
  EXPECT_NEAR(trial.search.refine(Bowl(), {5, 2}, {1, 2, 3, 0.1}, 0, 1), 0.5 * 9, 1e-9);
  EXPECT_TRUE(from_truth(trial.search.pose()).isApprox(Vector6d(0, 0, 0, 0, 0, 3), 1e-9));
  EXPECT_NEAR(trial.search.refine(Bowl(), {1}, {1, 2, 3, 0.1}, 0, 1), 0.5 * (9 + 1), 1e-9);
}

TEST(Search, FollowsTheBestOfItsScanThroughAllLevels) {
  SearchOptions options;
  options.scan_rotation_deg = 3;
  options.scan_rotation_step_deg = 1;
  options.scan_translation_mm = 3;
  options.scan_translation_step_mm = 1;
  options.candidates = 3;
  options.finalists = 2;
  const Bowl cost;
  Trial trial(pose_at(truth(), 0.5, 0, 1, 0, 0, -1), options);
  const auto levels = search::levels_of(cost, options);
  const Found found = trial.search.find(levels);
  // The grid's best is the one without the start's axial errors; the optimizer stays there.
  EXPECT_LT((from_truth(found.pose) - Vector6d(0.5, 0, 0, 0, 0, 0)).norm(), 0.01) << from_truth(found.pose).transpose();
  EXPECT_EQ(from_truth(found.axial), from_truth(found.pose));
  EXPECT_NEAR(found.value, 0.125, 1e-3);
  // Each of three candidates about its axis and about all axes, then two finalists at two more levels.
  const auto& problems = trial.listener.problems;
  ASSERT_EQ(problems.size(), 3u * 2 + 2 * 2);
  EXPECT_EQ(problems[0].initial_step, Vector2d(6, 3));
  EXPECT_EQ(problems[1].initial_step, Eigen::VectorXd(Vector6d(3, 3, 6, 3, 3, 3)));
  EXPECT_EQ(problems[6].initial_step, Eigen::VectorXd(Vector6d(1, 1, 3, 1, 1, 1)));
  EXPECT_EQ(problems[7].initial_step, Eigen::VectorXd(Vector6d(0.3, 0.3, 1, 0.3, 0.3, 0.3)));
  EXPECT_EQ(problems[7].step_tolerance, 0.03);
  EXPECT_EQ(trial.search.evaluations(), 7 * 7 + 10 * 7);
  ASSERT_EQ(cost.levels.size(), 3u);
  EXPECT_EQ(cost.levels[1].contour_spacing_px, 4);
  EXPECT_EQ(cost.levels[1].reach_px, 12);
  EXPECT_EQ(cost.levels[1].pixel_step, 0);
}

TEST(Search, RefusesLevelsWithoutPositiveNumbers) {
  const auto said = [](const SearchOptions& options) { return message_of([&] { search::check_options(options); }); };
  SearchOptions options;
  EXPECT_EQ(said(options), "");
  options.step_mm = {3, 0, 0.3};
  EXPECT_EQ(said(options), "step_mm: each number must be positive");
  options.contour_spacing_px.clear();
  EXPECT_EQ(said(options), "contour_spacing_px: there is no level; give a number for one at least");
  options = {};
  options.reach_px = {24, 12};
  EXPECT_THROW(search::levels_of(Bowl(), options), std::out_of_range)
      << "nothing is read past the end of a list that is too short";
}

TEST(Search, CandidatesAreNoNeighbours) {
  SearchOptions options;
  options.scan_rotation_deg = 9;
  options.scan_translation_mm = 0;
  options.candidates = 10;
  Trial trial(truth(), options);
  const Bowl cost;
  trial.search.find(search::levels_of(cost, options));
  // Of -9, -6 ... 9 degrees: 0, then -9 and 9, which are further than two steps of 3 from it.
  EXPECT_EQ(trial.listener.problems.size(), 3u * 2 + 2);
}

TEST(Search, ItsWayIsTheLeastCostSoFar) {
  const Bowl cost(Matrix6d::Identity(), 4);
  Trial trial(pose_at(truth(), 0, 0, 0, 0, 0, -8), {}, true);
  for (const double step : {3.0, 2.0, -1.0, 4.0})
    trial.search.refine(cost, {5}, {1, 1, step, 0.1}, 0, 1);  // to -5, -3, -4 and 0
  const auto steps = trial.search.convergence(cost);
  ASSERT_EQ(steps.size(), 3u);
  EXPECT_NEAR(steps[0].cost, 12.5, 1e-9);
  EXPECT_NEAR(steps[1].cost, 4.5, 1e-9);
  EXPECT_NEAR(steps[2].cost, 0, 1e-9);
  EXPECT_EQ(steps[0].evaluations, 1);
  EXPECT_EQ(steps[1].evaluations, 14);
  EXPECT_EQ(steps[2].evaluations, 28);
  const Pose pose = final_pose_of(trial.search, trial.start, cost, {}, trial.options, trial.context);
  EXPECT_NEAR(pose.cost, 0, 1e-9);
  EXPECT_EQ(pose.convergence.size(), 3u);
  ASSERT_TRUE(pose.covariance.has_value());
  EXPECT_NEAR((*pose.covariance)(3, 3), 1.0 / 4, 1e-6);
  const search::PredictedCovariance predicted(cost, trial.search.pose(), trial.start.frame);
  EXPECT_EQ(pose.evaluations, 28 + predicted.evaluations());
}

TEST(Search, ReportsItsProgress) {
  class Talker : public Listener {
   public:
    MinimisationResult minimise(const MinimisationProblem& problem) const override {
      for (const int evaluation : {49, 50, 100, 1000}) problem.observer(evaluation, problem.start, 1);
      return Listener::minimise(problem);
    }
  };
  Numbers parts;
  Context::Hooks hooks;
  hooks.progress = [&](double part, std::string_view) { parts.push_back(part); };
  Context context(hooks);
  SearchOptions options;
  options.max_evaluations = 400;
  const Talker talker;
  const Pose start = truth();
  Search search(talker, start, options, context);
  search.refine(Bowl(), kAllAxes, {}, 0.2, 0.4);
  ASSERT_EQ(parts.size(), 3u);
  EXPECT_NEAR(parts[0], 0.2 + 0.4 * 50 / 400, 1e-12);
  EXPECT_NEAR(parts[1], 0.2 + 0.4 * 100 / 400, 1e-12);
  EXPECT_NEAR(parts[2], 0.6, 1e-12) << "never more than its share";
}

TEST(Derivatives, AreThoseOfTheCoordinates) {
  // A cost with an expansion about every pose: s . q + q . A q / 2 for the shift q of a point of the model, and of its
  // turned axis.
  const FragmentFrame& frame = well::kFrame;
  const RigidTransform& origin = well::kTruth;
  const auto shift = [](const RigidTransform& pose) {
    return (pose * Vector3d(30, -10, 120)).dot(Vector3d(0.4, -0.3, 0.5)) +
           (pose.rotation * Vector3d(20, 30, -10)).dot(Vector3d(1, 2, -1));
  };
  const auto value = [&](const Vector6d& deg_and_mm) {
    return shift(search::moved_by_units(origin, frame, deg_and_mm));
  };
  for (const Vector6d& at :
       {Vector6d(0, 0, 0, 0, 0, 0), Vector6d(20, -30, 15, 3, -5, 8), Vector6d(-3, 1, 40, 0, 0, 1)}) {
    // About the pose there, in rad and mm, by differences.
    const RigidTransform there = search::moved_by_units(origin, frame, at);
    const auto at_motion = [&](const Vector6d& small) { return shift(marrow::moved(there, frame, small)); };
    Cost::Expansion about;
    about.value = 3;
    for (int i = 0; i < 6; ++i)
      about.gradient[i] = (at_motion(1e-5 * Vector6d::Unit(i)) - at_motion(-1e-5 * Vector6d::Unit(i))) / 2e-5;
    about.curvature = about.gradient * about.gradient.transpose();
    const std::vector<int> axes{4, 0, 2, 1, 5};
    const auto told = search::in_coordinates(about, at, axes);
    EXPECT_EQ(told.value, 3);
    ASSERT_EQ(told.gradient.size(), 5);
    for (int k = 0; k < 5; ++k) {
      const Vector6d h = 1e-3 * Vector6d::Unit(axes[std::size_t(k)]);
      EXPECT_NEAR(told.gradient[k], (value(at + h) - value(at - h)) / 2e-3, 1e-6) << k;
    }
    EXPECT_TRUE(told.curvature.isApprox(told.gradient * told.gradient.transpose(), 1e-9));
  }
  EXPECT_TRUE(std::isnan(search::in_coordinates(std::nullopt, Vector6d(0, 0, 0, 0, 0, 0), kAllAxes).value));
}

/// A constant, or not a number, without a sentence that says so.
class Blind : public Cost {
 public:
  explicit Blind(double value, std::string said = "") : value_(value), said_(std::move(said)) {}
  double value(const RigidTransform&) const override { return value_; }
  Numbers without_each_block(const RigidTransform&) const override { return {value_, value_}; }
  std::shared_ptr<const Cost> at_level(const CostLevel&) const override { return std::make_shared<Blind>(*this); }
  std::string nothing_compared(const RigidTransform&) const override { return said_; }

 private:
  double value_;
  std::string said_;
};

/// What final_pose_of() says at the truth; empty if it gives a pose.
std::string refused(const Cost& cost) {
  Trial trial;
  return message_of([&] {
    final_pose_of(trial.search, trial.start, cost, {1, 1, 1, 0.1}, trial.options, trial.context);
  });
}

TEST(Search, APoseAboutWhichTheImagesSayNothingIsNoResult) {
  const std::string
      before = "the images say nothing about the pose that was found: ",
      remedy = "; give a start nearer to the bone, or see whether the masks, the edges and the model are right";
  EXPECT_EQ(refused(Bowl()), "");
  for (const double same : {3.0, 0.0})
    EXPECT_EQ(refused(Blind(same)), before + "the cost is the same at all poses within 16 degrees and mm" + remedy);
  EXPECT_EQ(refused(Blind(std::nan(""))), before + "the cost is not a number" + remedy);
  EXPECT_EQ(refused(Blind(3, "view 'a': it is black")), before + "view 'a': it is black" + remedy);
}

TEST(Search, ACostThatChangesInOneAxisAloneSaysSomething) {
  Matrix6d one = Matrix6d::Zero();
  one(5, 5) = 1;
  const Bowl groove(one);
  EXPECT_EQ(search::nothing_compared(groove, well::kTruth, well::kFrame), "");
  EXPECT_EQ(refused(groove), "");
}

}  // namespace marrow::test::search_test
