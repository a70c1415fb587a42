// SPDX-License-Identifier: Apache-2.0
#include "plugins/render/landscape.cpp"

#include <gtest/gtest.h>

namespace {

/// A bowl about a known pose: squared offset in degrees and mm about a frame away from the origin.
class Bowl : public marrow::Cost {
 public:
  Bowl(marrow::RigidTransform floor, marrow::FragmentFrame frame)
      : floor_(std::move(floor)), frame_(std::move(frame)) {}
  double value(const marrow::RigidTransform& pose) const override {
    const marrow::Vector6d motion = marrow::motion_between(floor_, pose, frame_);
    return motion.head<3>().squaredNorm() * marrow::degrees(1) * marrow::degrees(1) + motion.tail<3>().squaredNorm();
  }
  std::shared_ptr<const marrow::Cost> at_level(const marrow::CostLevel&) const override { return nullptr; }

 private:
  marrow::RigidTransform floor_;
  marrow::FragmentFrame frame_;
};

class NotANumber : public marrow::Cost {
 public:
  double value(const marrow::RigidTransform&) const override { return std::nan(""); }
  std::shared_ptr<const marrow::Cost> at_level(const marrow::CostLevel&) const override { return nullptr; }
};

marrow::Pose some_pose() {
  marrow::Pose pose;
  pose.world_from_model.rotation = marrow::rotation_from_vector({0.1, -0.2, 0.3});
  pose.world_from_model.translation_mm = {5, 6, 7};
  pose.frame.origin_mm = {10, 20, 300};
  return pose;
}

TEST(Landscape, FindsTheFloorAlongEachAxis) {
  const marrow::Pose pose = some_pose();
  for (int axis = 0; axis < 6; ++axis) {
    marrow::Vector6d motion = marrow::Vector6d::Zero();
    motion[axis] = axis < 3 ? marrow::radians(2.5) : 2.5;
    const Bowl bowl(marrow::moved(pose.world_from_model, pose.frame, motion), pose.frame);
    const Profile profile = sample(bowl, pose, axis, {});
    ASSERT_EQ(profile.costs.size(), 81u);
    EXPECT_NEAR(profile.offsets.front(), -10, 1e-12);
    EXPECT_NEAR(profile.offsets.back(), 10, 1e-12);
    ASSERT_TRUE(profile.least);
    EXPECT_NEAR(profile.least->x, 2.5, 1e-12);
    EXPECT_NEAR(profile.least->y, 0, 1e-9);
    EXPECT_NEAR(profile.costs[40], 6.25, 1e-6);   // at the pose itself
    EXPECT_NEAR(profile.costs[80], 56.25, 1e-6);  // 10 - 2.5 squared
    EXPECT_EQ(title(axis, profile),
              std::string(kTitles[std::size_t(axis)]) + ": least at +2.50 " + (axis < 3 ? "deg" : "mm"));
  }
}

TEST(Landscape, DrawsSixPlotsWithTheirMarks) {
  const marrow::Pose pose = some_pose();
  marrow::Vector6d motion = marrow::Vector6d::Zero();
  motion[0] = marrow::radians(5);
  const marrow::Truth truth{marrow::moved(pose.world_from_model, pose.frame, motion)};
  marrow::Context context;
  const cv::Mat picture = landscape(Bowl(truth.world_from_model, pose.frame), pose, &truth, {}, context).pixels;
  EXPECT_EQ(picture.cols, 3 * 500);
  EXPECT_GT(picture.rows, 600);
  const auto count = [&](const cv::Rect& area, const cv::Scalar& colour) {
    int pixels = 0;
    for (int y = area.y; y < area.br().y; ++y)
      for (int x = area.x; x < area.br().x; ++x)
        pixels += picture.at<cv::Vec3b>(y, x) == cv::Vec3b(uchar(colour[0]), uchar(colour[1]), uchar(colour[2]));
    return pixels;
  };
  for (int axis = 0; axis < 6; ++axis)
    EXPECT_GT(count({axis % 3 * 500, axis / 3 * 300, 500, 300}, kBlue), 100) << "curve " << axis;
  // The axis of the first plot runs from 64 to 486 for -10 to +10 degrees: the truth at +5 lies at 380.5.
  EXPECT_GT(count({378, 28, 6, 228}, kOrange), 50);
}

TEST(Landscape, CostsThatAreNotFiniteGiveAPictureThatSaysSo) {
  EXPECT_EQ(title(2, sample(NotANumber(), some_pose(), 2, {})), "rotation about the long axis: no finite cost");
  marrow::Context context;
  EXPECT_FALSE(landscape(NotANumber(), some_pose(), nullptr, {}, context).pixels.empty());
}

TEST(Plot, TicksAreRound) {
  EXPECT_EQ(round_ticks(-10, 10, 4), (std::vector<double>{-10, -5, 0, 5, 10}));
  EXPECT_EQ(round_ticks(0.3, 4.2, 4), (std::vector<double>{1, 2, 3, 4}));
  EXPECT_TRUE(round_ticks(1, 1, 4).empty());
  EXPECT_TRUE(round_ticks(0, std::nan(""), 4).empty());
}

TEST(Landscape, DeclarationHasNoFault) {
  marrow::Plugin plugin;
  marrow_register_nodes(plugin);
  for (const auto& node : plugin.nodes) EXPECT_EQ(node.faults, std::vector<std::string>{}) << node.info.name;
}

}  // namespace
