// SPDX-License-Identifier: Apache-2.0
#include "bowl.hpp"
#include "marrow/toolbox/track/track_state.hpp"

namespace marrow::test::tracked_test {

using well::truth;

const std::string kNode = "register.tracked";

/// A prediction off by this much, with these deviations of all angles and translations.
Pose predicted(const Vector6d& off_deg_mm, double deg, double mm) {
  return with_deviations(well::pose_at(truth(), off_deg_mm), {deg, deg, deg, mm, mm, mm});
}
std::shared_ptr<const Cost> bowl() { return std::make_shared<well::Bowl>(Matrix6d::Identity(), 100); }
std::shared_ptr<const Cost> with_waves() {
  return std::make_shared<const well::Well>(well::kTruth, well::kFrame, 60, 6);
}

double apart(const Pose& pose) { return well::apart(truth(), pose); }

/// What is known in a frame, with a covariance that most frames take over.
Value known(int frame, double usual_cost = std::nan("")) {
  track::TrackState state;
  state.usual_cost = usual_cost;
  state.usual_covariance = Matrix6d(7 * Matrix6d::Identity());
  state.frame = frame;
  return item(state);
}

TEST(Tracked, FindsTheMinimumNearThePrediction) {
  const auto out = call(kNode, well::searched(bowl(), predicted({1, -1, 2, 1, -1, 2}, 2, 2)));
  EXPECT_LT(apart(out.at("pose").as<Pose>()), 0.05);
  EXPECT_EQ(out.at("stages").as_list<Pose>().names(), (Strings{"predicted", "final"}));
  const Matrix6d covariance = *out.at("pose").as<Pose>().covariance;
  EXPECT_NEAR(std::sqrt(covariance(3, 3)), 0.1, 0.02) << "1 / sqrt(100 * 1)";
}

TEST(Tracked, LooksFurtherWhereTheResultIsUnlikely) {
  // The well has waves: the search ends in one of them unless it looks all around.
  const auto out = call(kNode, well::searched(with_waves(), predicted({2, -2, 9, 3, -3, 9}, 4, 4)), {{"gate", 0.0}});
  const auto stages = out.at("stages").as_list<Pose>();
  ASSERT_EQ(stages.names(), (Strings{"predicted", "near", "final"}));
  EXPECT_LE(out.at("pose").as<Pose>().cost, stages[1].cost);
  EXPECT_LE(apart(out.at("pose").as<Pose>()), apart(stages[1]));
}

TEST(Tracked, LooksFurtherWhereTheCostIsMoreThanUsual) {
  // Any pose agrees with the prediction. Only the cost tells that it ended in a wave of the well.
  const auto stages = [&](double usual_cost) {
    const Inputs in = well::searched(with_waves(), predicted({2, -2, 9, 3, -3, 9}, 10, 20));
    return output_list<Pose>(kNode, "stages", with(in, {{"state", known(3, usual_cost)}}), {{"gate", 1e9}});
  };
  const Strings near{"predicted", "final"}, wide{"predicted", "near", "final"};
  const auto not_yet_known = stages(std::nan(""));
  EXPECT_EQ(not_yet_known.names(), near);
  const double cost = not_yet_known[1].cost;
  EXPECT_EQ(stages(cost).names(), near);
  const auto looked = stages(cost / 2);
  ASSERT_EQ(looked.names(), wide);
  EXPECT_LE(looked[2].cost, looked[1].cost);
}

TEST(Tracked, MostFramesTakeOverACovariance) {
  const auto covariance = [&](int frame) {
    const Inputs in = well::searched(bowl(), predicted({1, -1, 2, 1, -1, 2}, 2, 2));
    return *output<Pose>(kNode, "pose", with(in, {{"state", known(frame)}})).covariance;
  };
  EXPECT_EQ(covariance(3), 7 * Matrix6d::Identity());
  EXPECT_NE(covariance(20), 7 * Matrix6d::Identity()) << "every tenth is new";
}

TEST(Tracked, AStartWithoutACovarianceOrThatIsKnownExactlyIsHardlyKnown) {
  Pose start = predicted({2, -1, 3, 1, 4, -2}, 0, 0);
  // Three deviations of 0 would leave nothing to search; the right pose is 5.9 mm and degrees away.
  Heard heard;
  EXPECT_LT(apart(output<Pose>(kNode, "pose", well::searched(bowl(), start), {}, heard.context)), 0.05);
  EXPECT_EQ(std::count(heard.lines.begin(), heard.lines.end(),
                       "the predicted pose counts as hardly known: its predicted deviations are 0, so its registration "
                       "compared nothing"),
            1);
  start.covariance.reset();
  EXPECT_LT(apart(output<Pose>(kNode, "pose", well::searched(bowl(), start))), 0.05);
}

/// A bowl that says nothing within some distance of a pose, as where an edge lies beyond the reach of an outline.
class MuteNear : public well::Bowl {
 public:
  MuteNear(const Pose& middle, double within) : Bowl(Matrix6d::Identity(), 100), middle_(middle), within_(within) {}
  std::string nothing_compared(const RigidTransform& pose) const override {
    const bool is_near = well::way(middle_.world_from_model, pose, middle_.frame).norm() < within_;
    return is_near ? "view 'a': no edge lies within 6 px of the model's outline" : "";
  }
  std::shared_ptr<const Cost> at_level(const CostLevel&) const override { return std::make_shared<MuteNear>(*this); }

 private:
  Pose middle_;
  double within_;
};

TEST(Tracked, LooksFurtherWhereTheImagesSayNothing) {
  const Pose near = predicted({6, 0, 0, 0, 0, 0}, 4, 4);
  const auto stays = function<Optimizer>(std::make_shared<const well::Listener>());
  const auto out =
      call(kNode, with(well::searched(std::make_shared<const MuteNear>(near, 2), near), {{"optimizer", stays}}));
  EXPECT_EQ(out.at("stages").as_list<Pose>().names(), (Strings{"predicted", "final"}));
  EXPECT_GT(well::apart(near, out.at("pose").as<Pose>()), 2);
}

TEST(Tracked, AFrameThatSaysNothingGivesNoPose) {
  const Inputs mute = well::searched(std::make_shared<const MuteNear>(truth(), 1e9), truth());
  // Taken over, a covariance would look like that of a good pose.
  for (const Inputs& in : {mute, with(mute, {{"state", known(3)}})})
    EXPECT_EQ(refusal(kNode, in),
              "the images say nothing about the pose that was found: view 'a': no edge lies within 6 px of the model's "
              "outline; give a start nearer to the bone, or see whether the masks, the edges and the model are right");
}

}  // namespace marrow::test::tracked_test
