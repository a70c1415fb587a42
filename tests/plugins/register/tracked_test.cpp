// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "bowl.hpp"
#include "marrow/toolbox/track/track_state.hpp"
#include "shipped.hpp"

namespace tracked_test {

using marrow::Cost;
using marrow::Matrix6d;
using marrow::Pose;
using marrow::Vector6d;
using well::truth;

/// A prediction off by this much, with these deviations of all angles and translations.
Pose predicted(const Vector6d& off_deg_mm, double deg, double mm) {
  Pose pose = truth();
  Vector6d motion = off_deg_mm, deviation;
  motion.head<3>() *= marrow::radians(1);
  pose.world_from_model = moved(truth().world_from_model, pose.frame, motion);
  deviation << Eigen::Vector3d::Constant(marrow::radians(deg)), Eigen::Vector3d::Constant(mm);
  pose.covariance = Matrix6d(deviation.cwiseAbs2().asDiagonal());
  return pose;
}

shipped::Inputs inputs(const std::shared_ptr<const Cost>& cost, const Pose& initial) {
  return {{"cost", marrow::Value::of<Cost>(cost)},
          {"optimizer", shipped::call("optimizer.nelder_mead", {}).at("optimizer")},
          {"start", shipped::item(initial)}};
}

double apart(const Pose& pose) {
  return well::way(truth().world_from_model, pose.world_from_model, truth().frame).norm();
}

std::shared_ptr<const Cost> bowl() {
  return std::make_shared<well::Bowl>(truth().world_from_model, truth().frame, Matrix6d::Identity(), 100);
}

TEST(Tracked, FindsTheMinimumNearThePrediction) {
  const auto out = shipped::call("register.tracked", inputs(bowl(), predicted({1, -1, 2, 1, -1, 2}, 2, 2)));
  EXPECT_LT(apart(out.at("pose").as<Pose>()), 0.05);
  EXPECT_EQ(out.at("stages").as_list<Pose>().names(), (std::vector<std::string>{"predicted", "final"}));
  const Matrix6d covariance = *out.at("pose").as<Pose>().covariance;
  EXPECT_NEAR(std::sqrt(covariance(3, 3)), 0.1, 0.02) << "1 / sqrt(100 * 1)";
}

TEST(Tracked, LooksFurtherWhereTheResultIsUnlikely) {
  // The well has waves: the search ends in one of them unless it looks all around.
  const auto well = std::make_shared<const well::Well>(truth().world_from_model, truth().frame, 60, 6);
  const Pose far = predicted({2, -2, 9, 3, -3, 9}, 4, 4);
  const auto out = shipped::call("register.tracked", inputs(well, far), {{"gate", 0.0}});
  const auto stages = out.at("stages").as_list<Pose>();
  ASSERT_EQ(stages.names(), (std::vector<std::string>{"predicted", "near", "final"}));
  EXPECT_LE(out.at("pose").as<Pose>().cost, stages[1].cost);
  EXPECT_LE(apart(out.at("pose").as<Pose>()), apart(stages[1]));
}

TEST(Tracked, LooksFurtherWhereTheCostIsMoreThanUsual) {
  // Any pose agrees with the prediction. Only the cost tells that it ended in a wave of the well.
  const auto well = std::make_shared<const well::Well>(truth().world_from_model, truth().frame, 60, 6);
  const Pose far = predicted({2, -2, 9, 3, -3, 9}, 10, 20);
  const auto stages = [&](double usual_cost) {
    marrow::track::TrackState state;
    state.usual_cost = usual_cost;
    state.usual_covariance = Matrix6d(Matrix6d::Identity());  // taken over: it need not be found in a wave
    state.frame = 3;
    shipped::Inputs in = inputs(well, far);
    in["state"] = shipped::item(state);
    return shipped::call("register.tracked", in, {{"gate", 1e9}}).at("stages").as_list<Pose>();
  };
  const std::vector<std::string> near{"predicted", "final"}, wide{"predicted", "near", "final"};
  const auto not_yet_known = stages(std::nan(""));
  EXPECT_EQ(not_yet_known.names(), near);
  const double cost = not_yet_known[1].cost;
  EXPECT_EQ(stages(cost).names(), near);
  const auto looked = stages(cost / 2);
  ASSERT_EQ(looked.names(), wide);
  EXPECT_LE(looked[2].cost, looked[1].cost);
}

TEST(Tracked, MostFramesTakeOverACovariance) {
  marrow::track::TrackState state;
  state.usual_covariance = Matrix6d(7 * Matrix6d::Identity());
  const auto covariance = [&](int frame) {
    state.frame = frame;
    shipped::Inputs in = inputs(bowl(), predicted({1, -1, 2, 1, -1, 2}, 2, 2));
    in["state"] = shipped::item(state);
    return *shipped::call("register.tracked", in).at("pose").as<Pose>().covariance;
  };
  EXPECT_EQ(covariance(3), 7 * Matrix6d::Identity());
  EXPECT_NE(covariance(20), 7 * Matrix6d::Identity()) << "every tenth is new";
}

TEST(Tracked, AStartWithoutACovarianceIsHardlyKnown) {
  Pose without = predicted({2, -1, 3, 1, 4, -2}, 1, 1);
  without.covariance.reset();
  EXPECT_LT(apart(shipped::call("register.tracked", inputs(bowl(), without)).at("pose").as<Pose>()), 0.05);
}

TEST(Tracked, AStartThatIsKnownExactlyIsHardlyKnown) {
  // Three deviations of 0 would leave nothing to search; the right pose is 5.9 mm and degrees away.
  Pose exact = predicted({2, -1, 3, 1, 4, -2}, 0, 0);
  std::vector<std::string> lines;
  marrow::Context::Hooks hooks;
  hooks.log = [&](std::string_view text, marrow::LogLevel) { lines.emplace_back(text); };
  const Pose found =
      shipped::call("register.tracked", inputs(bowl(), exact), {}, marrow::Context(hooks)).at("pose").as<Pose>();
  EXPECT_LT(apart(found), 0.05);
  EXPECT_EQ(std::count(lines.begin(), lines.end(),
                       "the predicted pose counts as hardly known: its predicted deviations are 0, so its registration "
                       "compared nothing"),
            1);
}

/// A bowl that says nothing within some distance of a pose, as where an edge lies beyond the reach of an outline.
class MuteNear : public well::Bowl {
 public:
  MuteNear(const Pose& middle, double within)
      : Bowl(truth().world_from_model, truth().frame, Matrix6d::Identity(), 100), middle_(middle), within_(within) {}
  std::string nothing_compared(const marrow::RigidTransform& pose) const override {
    const bool is_near = well::way(middle_.world_from_model, pose, middle_.frame).norm() < within_;
    return is_near ? "view 'a': no edge lies within 6 px of the model's outline" : "";
  }
  std::shared_ptr<const Cost> at_level(const marrow::CostLevel&) const override {
    return std::make_shared<MuteNear>(*this);
  }

 private:
  Pose middle_;
  double within_;
};

TEST(Tracked, LooksFurtherWhereTheImagesSayNothing) {
  const Pose near = predicted({6, 0, 0, 0, 0, 0}, 4, 4);
  shipped::Inputs in = inputs(std::make_shared<const MuteNear>(near, 2), near);
  in["optimizer"] = marrow::Value::of<marrow::Optimizer>(std::make_shared<const well::Listener>());  // stays
  const auto out = shipped::call("register.tracked", in);
  EXPECT_EQ(out.at("stages").as_list<Pose>().names(), (std::vector<std::string>{"predicted", "final"}));
  EXPECT_GT(well::way(near.world_from_model, out.at("pose").as<Pose>().world_from_model, near.frame).norm(), 2);
}

TEST(Tracked, AFrameThatSaysNothingGivesNoPose) {
  marrow::track::TrackState state;
  state.usual_covariance = Matrix6d(7 * Matrix6d::Identity());  // taken over, it would look like a good pose
  state.frame = 3;
  for (const bool has_state : {false, true}) {
    shipped::Inputs in = inputs(std::make_shared<const MuteNear>(truth(), 1e9), truth());
    if (has_state) in["state"] = shipped::item(state);
    EXPECT_EQ(shipped::refusal("register.tracked", in),
              "the images say nothing about the pose that was found: view 'a': no edge lies within 6 px of the model's "
              "outline; give a start nearer to the bone, or see whether the masks, the edges and the model are right");
  }
}

}  // namespace tracked_test
