// SPDX-License-Identifier: Apache-2.0
#include "plugins/refine/sight.hpp"
#include "split.hpp"

namespace marrow::test::refine_cameras_test {

TEST(RefineCameras, FindsHowTheCamerasAreOffAgainstEachOther) {
  const RigidTransform frontal = motion({0.3, -0.2, 0.4}, {0.8, 0.5, -3}),
                       lateral = motion({-0.4, 0.3, 0.1}, {2, -0.7, 0.6});
  const auto outputs = call("refine.cameras", inputs({Bone({frontal, lateral})}));
  const RigidTransform wanted = inverse(frontal) * lateral, is = inverse(found(outputs, 0)) * found(outputs, 1);
  EXPECT_LT(turn_between_deg(wanted, is), 0.02);
  EXPECT_LT(shift_between_mm(wanted, is), 0.1);
}

/// That another form of the cost gives the same pose.
template <class Form>
void expect_same(double most_mm, double most_rad, double part_of_covariance) {
  Bone bone({motion({0.3, -0.2, 0.4}, {0.8, 0.5, -3}), motion({-0.4, 0.3, 0.1}, {2, -0.7, 0.6})});
  const Pose wanted = output_list<Pose>("refine.cameras", "poses", inputs({bone}))[0];
  bone.cost = std::make_shared<Form>(bone.cost);
  const Pose pose = output_list<Pose>("refine.cameras", "poses", inputs({bone}))[0];
  EXPECT_LT(shift_between_mm(pose.world_from_model, wanted.world_from_model), most_mm);
  EXPECT_LT(geodesic_angle_rad(pose.world_from_model.rotation, wanted.world_from_model.rotation), most_rad);
  EXPECT_LT((*pose.covariance - *wanted.covariance).norm(), part_of_covariance * wanted.covariance->norm());
}
TEST(RefineCameras, ACostOfViewsGivesTheSame) { expect_same<SplitInViews>(1e-6, 1e-8, 1e-6); }
TEST(RefineCameras, ACostWithDerivativesGivesTheSame) { expect_same<SplitWithDerivatives>(0.02, 2e-4, 0.05); }

TEST(RefineCameras, HalfOfAnErrorGoesToEachOfTwoViews) {
  // v of both images is y of the world, so nothing tells which of the two cameras is too high by 2 mm.
  const auto outputs = call("refine.cameras", inputs({Bone({kNone, motion({0, 0, 0}, {0, 2, 0})})}));
  EXPECT_NEAR(figure(motions(outputs, 0), "shift_v_mm"), -1, 0.02);
  EXPECT_NEAR(figure(motions(outputs, 1), "shift_v_mm"), 1, 0.02);
  EXPECT_NEAR(figure(motions(outputs, 0), "shift_u_mm"), 0, 0.02);
  const Pose pose = outputs.at("poses").as_list<Pose>()[0];
  EXPECT_NEAR(pose.world_from_model.translation_mm.y(), 41, 0.02);
  // What the images do not show, as in far_off_test.cpp: 0.2089 of 0.3125 degrees are left.
  EXPECT_NEAR(figure(motions(outputs, 0), "predicted_rotation_u_deg"), 0.2089, 0.005);
  EXPECT_NEAR(figure(motions(outputs, 0), "determined_rotation_u"), 55.3, 2) << "of the variance";
  EXPECT_GT((*pose.covariance)(3, 3), 0.01) << "the pose is not known better than the cameras";
}

TEST(RefineCameras, TheReferenceStaysAndTheOthersGoByIt) {
  const RigidTransform off = motion({-0.4, 0.3, 0.1}, {0.6, 1, -0.7});
  std::vector<Bone> bones{Bone({kNone, off}, 1e6)};
  const RigidTransform right = bones[0].pose.world_from_model;
  bones[0].pose = well::pose_at(bones[0].pose, 0.2, 0.1, -0.1, 0.3, 0.5, -0.3);
  const auto outputs = call("refine.cameras", inputs(bones), {{"reference_view", std::string("frontal")}});
  const auto is_near = [](const RigidTransform& is, const RigidTransform& wanted) {
    return turn_between_deg(wanted, is) < 0.01 && shift_between_mm(wanted, is) < 0.05;
  };
  EXPECT_TRUE(is_near(found(outputs, 0), kNone));
  EXPECT_TRUE(is_near(found(outputs, 1), off)) << "the whole error goes to the other camera";
  const Pose pose = outputs.at("poses").as_list<Pose>()[0];
  EXPECT_LT(well::way(right, pose.world_from_model, pose.frame).norm(), 0.02);
  EXPECT_LT(std::sqrt(pose.covariance->diagonal().maxCoeff()), 0.075)
      << "the cameras add nothing but what the outline may be off: 0.2 px, which are 0.07 mm at the bone";
}

/// A thin shaft: a shift along a view's depth changes its cost a thousand times less than one across. Each view likes
/// one pose best, with the noise of Split.
class Shaft : public Cost {
 public:
  Shaft(std::vector<RigidTransform> best, FragmentFrame frame) : best_(std::move(best)), frame_(frame) {}
  double value(const RigidTransform& pose) const override {
    return 0.5 * (value_in_view(0, pose) + value_in_view(1, pose));
  }
  std::shared_ptr<const Cost> at_level(const CostLevel&) const override { return std::make_shared<Shaft>(*this); }
  std::size_t view_count() const override { return 2; }
  double value_in_view(std::size_t view, const RigidTransform& pose) const override {
    return 0.5 * off(view, pose).squaredNorm();
  }
  Numbers without_each_block(const RigidTransform& pose) const override {
    Numbers values;
    for (std::size_t v = 0; v < 2; ++v)
      for (int block = 0; block < 64; ++block)
        values.push_back(value(pose) + (block < 6 ? 0.5e-3 * off(v, pose)[block] : 0));
    return values;
  }

 private:
  /// How far a pose is off, in degrees and mm along the view's u, v and depth, the depth 30 times less.
  Vector6d off(std::size_t view, const RigidTransform& pose) const {
    Vector6d way = well::way(best_[view], pose, frame_);
    const Matrix3d to_camera = views()[view].camera.camera_from_world.rotation * best_[view].rotation * frame_.axes;
    way.tail<3>() = (to_camera * way.tail<3>()).cwiseProduct(Vector3d(1, 1, 1 / 30.0));
    return way;
  }
  std::vector<RigidTransform> best_;
  FragmentFrame frame_;
};

// A shaft looks 2 mm too far away in the reference, because its outline is 0.2 px too narrow there. The other camera is
// right, and stays. Without a doubt about the outline it would be moved by the whole 2 mm.
TEST(RefineCameras, HowLargeABoneLooksInTheReferenceMovesNoOtherCamera) {
  const RigidTransform deeper = motion({0, 0, 0}, {0, 0, 2});
  Bone bone({kNone, kNone});
  const RigidTransform right = bone.pose.world_from_model;
  bone.cost = std::make_shared<Shaft>(std::vector{deeper * right, right}, bone.pose.frame);
  const auto outputs = call("refine.cameras", inputs({bone}), {{"reference_view", std::string("frontal")}});
  EXPECT_LT((found(outputs, 0).translation_mm - kNone.translation_mm).norm(), 1e-9) << "the reference stays";
  EXPECT_LT((found(outputs, 1).translation_mm - kNone.translation_mm).norm(), 0.6);
  const Pose pose = outputs.at("poses").as_list<Pose>()[0];
  EXPECT_LT(well::way(right, pose.world_from_model, pose.frame).norm(), 0.6);
  EXPECT_GT(std::sqrt(pose.covariance->bottomRightCorner<3, 3>().trace()), 0.3) << "and the pose is that uncertain";
}

TEST(RefineCameras, CamerasThatAreRightStay) {
  std::vector<Bone> bones{Bone({kNone, kNone})};
  const RigidTransform right = bones[0].pose.world_from_model;
  bones[0].pose = well::pose_at(bones[0].pose, 0.5, -0.3, 0.2, 0.4, 0.1, -0.6);
  const auto outputs = call("refine.cameras", inputs(bones));
  const Pose pose = outputs.at("poses").as_list<Pose>()[0];
  EXPECT_LT(well::way(right, pose.world_from_model, pose.frame).norm(), 0.01);
  for (std::size_t v = 0; v < 2; ++v) {
    EXPECT_LT((found(outputs, v).translation_mm - kNone.translation_mm).norm(), 0.01);
    // Across u of one view lies the depth of the other, so hardly anything of a shared shift counts for the other.
    const double expected_mm = std::sqrt(1 / 3.0 + 25 / 2.0 * std::pow(600 / 1700.0, 2));
    EXPECT_NEAR(figure(motions(outputs, v), "predicted_shift_u_mm"), expected_mm, 0.1 * expected_mm)
        << "no image shows whether both are off together";
  }
}

TEST(RefineCameras, WhereImagesHardlyTellHowFarTheCamerasAreOffTheDeviationsSaySo) {
  const auto deviation_mm = [&](double information) {
    // Relative to a camera that is right, so that no shared error is left.
    const auto outputs = call("refine.cameras", inputs({Bone({kNone, kNone}, information)}),
                              {{"reference_view", std::string("lateral")}});
    return figure(motions(outputs, 0), "predicted_shift_u_mm");
  };
  const double expected_mm = std::sqrt(1 / 3.0 + 25 / 2.0 * std::pow(600 / 1700.0, 2));
  // The lateral's depth lies across the frontal image, and may be off by 0.2 px of the outline.
  const double outline_mm = 0.2 * 600 / 1700;
  EXPECT_NEAR(deviation_mm(1e4), std::hypot(expected_mm / 100, outline_mm), 0.003) << "they are right";
  EXPECT_GT(deviation_mm(10), expected_mm / 20) << "they are most probably right";
  EXPECT_LT(deviation_mm(10), expected_mm / 2);
}

TEST(RefineCameras, SaysWhatTheImagesDoNotDetermine) {
  Heard heard;
  const auto is_said = [&] {
    return std::any_of(heard.lines.begin(), heard.lines.end(), [](const std::string& line) {
      return line.starts_with("view 'frontal': the images do not determine its camera's rotation about u (") &&
             line.ends_with("; what is expected of them counts in the poses' deviations");
    });
  };
  call("refine.cameras", inputs({Bone({kNone, kNone}, 1e-4)}), {}, heard.context);
  EXPECT_TRUE(is_said());
  heard.lines.clear();
  const auto outputs = call("refine.cameras", inputs({Bone({kNone, kNone}, 1e6)}),
                            {{"reference_view", std::string("lateral")}}, heard.context);
  EXPECT_FALSE(is_said());
  for (const char* name : {"determined_rotation_u", "determined_shift_v", "determined_shift_depth"})
    EXPECT_GT(figure(motions(outputs, 0), name), 99) << name;
}

TEST(RefineCameras, TwoBonesShareTheCameras) {
  const RigidTransform frontal = motion({0.4, 0, -0.3}, {1, 1, 0}), lateral = motion({0, 0.5, 0}, {0, -1.5, 1});
  const std::vector<Bone> bones{Bone({frontal, lateral}), Bone({frontal, lateral}, 1e4, -60)};
  const auto poses = output_list<Pose>("refine.cameras", "poses", inputs(bones));
  const RigidTransform wanted = inverse(bones[0].pose.world_from_model) * bones[1].pose.world_from_model,
                       is = inverse(poses[0].world_from_model) * poses[1].world_from_model;
  EXPECT_LT(turn_between_deg(wanted, is), 0.02);
  EXPECT_LT(shift_between_mm(wanted, is), 0.03) << "the reduction does not feel the cameras";
}

TEST(RefineCameras, WhatBothBonesAreOffByInCommonDoesNotCountBetweenThem) {
  // v of both images is y of the world, so nothing tells how high both bones and cameras are together.
  const RigidTransform high = motion({0, 0, 0}, {0, 2, 0});
  const auto outputs = call("refine.cameras", inputs({Bone({kNone, high}, 1e6), Bone({kNone, high}, 1e6, -60)}));
  const auto poses = outputs.at("poses").as_list<Pose>(), relative = outputs.at("relative").as_list<Pose>();
  const auto along_y = [](const Pose& pose) {
    const Vector3d y = (pose.world_from_model.rotation * pose.frame.axes).transpose() * Vector3d::UnitY();
    return std::sqrt(y.dot(pose.covariance->bottomRightCorner<3, 3>() * y));
  };
  EXPECT_LT(relative[0].covariance->norm(), 1e-9) << "the first bone relative to itself";
  EXPECT_EQ(relative[1].world_from_model.translation_mm, poses[1].world_from_model.translation_mm);
  EXPECT_GT(along_y(poses[1]), 0.2);
  EXPECT_LT(along_y(relative[1]), 0.1 * along_y(poses[1]));
}

/// At a coarse level, each view likes a pose that is 0.6 mm away.
class Levels : public Split {
 public:
  Levels(const Bone& bone, const RigidTransform& best, double away_mm)
      : Split(std::vector(2, motion({0, 0, 0}, {0, away_mm, 0}) * best), bone.pose.frame, 1e4),
        bone_(bone),
        best_(best) {}
  std::shared_ptr<const Cost> at_level(const CostLevel& level) const override {
    return std::make_shared<Levels>(bone_, best_, level.pixel_step > 1 ? 0.6 : 0);
  }

 private:
  const Bone& bone_;
  RigidTransform best_;
};

TEST(RefineCameras, TheLastPixelStepDecidesThePoses) {
  const Bone bone({});
  Bone levels = bone;
  levels.cost = std::make_shared<Levels>(bone, bone.pose.world_from_model, 0);
  const auto off_mm = [&](Numbers steps) {
    const auto poses = output_list<Pose>("refine.cameras", "poses", inputs({levels}), {{"pixel_step", steps}});
    return shift_between_mm(poses[0].world_from_model, bone.pose.world_from_model);
  };
  EXPECT_NEAR(off_mm({3}), 0.6, 0.02);
  EXPECT_NEAR(off_mm({3, 1}), 0, 0.02);
  EXPECT_EQ(refusal("refine.cameras", inputs({bone}), {{"pixel_step", Numbers{}}}),
            "pixel_step: there is no level; give a number for one at least");
}

TEST(RefineCameras, TheViewsKeepTheirImagesAndNames) {
  const auto after = output_list<View>("refine.cameras", "views", inputs({Bone({kNone, kNone})}));
  EXPECT_EQ(after.names(), (Strings{"frontal", "lateral"}));
  EXPECT_EQ(after[0].camera.intrinsics, views()[0].camera.intrinsics);
  EXPECT_EQ(cv::countNonZero(after[1].image.pixels != views()[1].image.pixels), 0);
}

TEST(RefineCameras, WarnsOfCamerasThatAreFarOff) {
  Heard heard;
  call("refine.cameras", inputs({Bone({kNone, motion({3, 3, 3}, {0, 9, 0})})}), {}, heard.context);
  ASSERT_EQ(heard.warnings.size(), 2u);
  EXPECT_EQ(heard.warnings[0].find("view 'frontal': its camera is off by "), 0u) << heard.warnings[0];
  EXPECT_NE(heard.warnings[0].find(
                " times what the options expect; is it the camera of this image, and are the poses right?"),
            std::string::npos)
      << heard.warnings[0];
  heard.warnings.clear();
  call("refine.cameras", inputs({Bone({kNone, motion({0, 0, 0}, {0, 1, 0})})}), {{"max_iterations", std::int64_t(1)}},
       heard.context);
  EXPECT_EQ(heard.warnings, Strings{"the cameras still moved after 1 iterations; raise max_iterations"});
}

TEST(RefineCameras, ACostOfViewsNeedsItsBlocks) {
  Bone blind({kNone, kNone}, 0);
  blind.cost = std::make_shared<SplitInViews>(blind.cost);
  EXPECT_EQ(refusal("refine.cameras", inputs({blind})),
            "the cost gives no values without each block of the images; use a cost that predicts deviations, such as "
            "that of the contour");
}

TEST(RefineCameras, SaysWhatIsWrong) {
  const Bone bone({kNone, kNone});
  List<View> behind;
  for (View view : views()) {
    view.camera.camera_from_world.translation_mm.z() = -600;
    behind.add(view.name, view);
  }
  EXPECT_EQ(refusal("refine.cameras", inputs({Bone({kNone})}, views(1))),
            "there is one view only; a camera is corrected by comparing it with others, so give two views or more");
  EXPECT_EQ(refusal("refine.cameras", inputs({})), "there is no bone; wire the pose of at least one");
  EXPECT_EQ(refusal("refine.cameras", inputs({Bone({kNone, kNone, kNone})})),
            "the cost of 'distal' compares 3 views, but there are 2; make it of the same views");
  EXPECT_EQ(refusal("refine.cameras", inputs({Bone({kNone, kNone}, 0)})),
            "the cost gives no values without each block of the images; use a cost that predicts deviations, such as "
            "that of the contour");
  EXPECT_EQ(refusal("refine.cameras", inputs({Bone({kNone, kNone}, 1e4, 40)}, behind)),
            "view 'frontal': the bones do not lie in front of its camera; look at the overlays first");
  EXPECT_EQ(refusal("refine.cameras", inputs({Bone({})})),
            "the cost of 'distal' cannot be split into views: it compares no views, or it holds more than them, such "
            "as a prior; give the cost of the images alone");
  EXPECT_EQ(refusal("refine.cameras", inputs({bone}), {{"reference_view", std::string("frontl")}}),
            "reference_view: there is no view 'frontl'; did you mean 'frontal'?");
  Bone negative = bone;
  negative.pose.covariance = Matrix6d(-Matrix6d::Identity());
  EXPECT_EQ(refusal("refine.cameras", inputs({negative})),
            "the pose of 'distal': the covariance has the negative variance -1 in row 1, column 1; a covariance is "
            "symmetric and has no negative eigenvalue");
  auto other = inputs({bone});
  other["poses"] = inputs({bone, bone})["poses"];
  EXPECT_EQ(refusal("refine.cameras", other),
            "costs and poses are not of the same bones; wire both from nodes that are called for each fragment");
}

/// In some views it says nothing.
class PartlyBlind : public Split {
 public:
  PartlyBlind(const Bone& bone, std::size_t silent)
      : Split({bone.pose.world_from_model, bone.pose.world_from_model}, bone.pose.frame, 1e4), silent_(silent) {}
  Strings silent_views(const RigidTransform&) const override {
    const Strings all{"view 'frontal': it is black", "view 'lateral': it is black"};
    return {all.end() - std::ptrdiff_t(silent_), all.end()};
  }
  std::string nothing_compared(const RigidTransform&) const override {
    return silent_ == 2 ? "view 'frontal': it is black; view 'lateral': it is black" : "";
  }
  std::shared_ptr<const Cost> at_level(const CostLevel&) const override { return std::make_shared<PartlyBlind>(*this); }

 private:
  std::size_t silent_;
};

TEST(RefineCameras, ABoneOfWhichTheImagesSayNothingIsNoPose) {
  std::vector<Bone> bones{Bone({kNone, kNone}), Bone({kNone, kNone})};
  bones[1].cost = std::make_shared<PartlyBlind>(bones[1], 2);
  EXPECT_EQ(refusal("refine.cameras", inputs(bones)),
            "the images say nothing about the pose of 'proximal': view 'frontal': it is black; view 'lateral': it is "
            "black; leave this bone out, or see whether its pose, its masks and its edges are right");
  bones[1].cost = std::make_shared<PartlyBlind>(bones[1], 1);
  const auto poses = output_list<Pose>("refine.cameras", "poses", inputs(bones));
  EXPECT_EQ(poses[0].warnings, Strings{});
  EXPECT_EQ(poses[1].warnings, Strings{"view 'lateral': it is black; only the other views count"});
}

View view_at_600_mm() {
  View view = view_of("", before_origin(pinhole(2000, 200, 200, {{100, 100}}), 600));
  view.camera.intrinsics(1, 1) = 500;
  return view;
}

// At 600 mm, 5 px of root mean square are 5 / sqrt(2) px along u and along v: 3.54 * 0.3 mm and 3.54 * 1.2 mm. The
// shift of 1 mm is 1 / sqrt(3) along each axis. A tenth of the shift by the principal point, 5 px * 0.3 mm, is the
// limit of the model, and so is 0.001 mm.
TEST(Sight, AnErrorOfTheCentreIsInMillimetresAlongEachAxis) {
  const auto deviation = refine::sight_of(view_at_600_mm(), {0, 0, 0}, {}).deviation();
  const double shift2 = (1 + 1e-6 + 0.15 * 0.15) / 3;
  EXPECT_NEAR(deviation[3], std::sqrt(shift2 + 12.5 * 0.3 * 0.3), 1e-12);
  EXPECT_NEAR(deviation[4], std::sqrt(shift2 + 12.5 * 1.2 * 1.2), 1e-12);
  EXPECT_NEAR(deviation[5], std::sqrt(shift2 + 36), 1e-12) << "1 % of 600 mm";
}

// The ray through a pixel 1 px to the right turns by 1 / 2000 about v. So a bone that is seen from the same side has
// turned as much, and has moved by 600 / 2000 mm.
TEST(Sight, AnErrorOfTheCentreTurnsTheBoneAboutTheSource) {
  const auto sight = refine::sight_of(view_at_600_mm(), {0, 0, 0}, {.turn_deg = 0, .shift_mm = 0});
  EXPECT_NEAR(sight.covariance(1, 3), 12.5 * degrees(1 / 2000.0) * 0.3, 1e-12);
  EXPECT_NEAR(sight.covariance(0, 4), -12.5 * degrees(1 / 500.0) * 1.2, 1e-12);
}

TEST(Sight, WhatIsStatedAboutACameraTakesThePlaceOfWhatIsExpected) {
  geometry::CameraDeviations stated;
  stated.focal_percent = 5, stated.source_mm = 40;
  const refine::Sight sight = refine::sight_of(view_at_600_mm(), {0, 0, 0}, {}, stated);
  EXPECT_NEAR(sight.deviation()[5], std::sqrt((1 + 1e-6 + 0.15 * 0.15) / 3 + 900 + 1600), 1e-9);
  EXPECT_NEAR(sight.covariance(1, 3), 12.5 * degrees(1 / 2000.0) * 0.3, 1e-12) << "the centre as expected";
}

TEST(Sight, NumbersAreTheInverseOfTheMotion) {
  const refine::Sight sight = refine::sight_of(view_at_600_mm(), {3, -8, 20}, {});
  const Vector6d numbers{12, -7, 4, 10, -20, 30};
  EXPECT_LT((sight.numbers(sight.motion(numbers)) - numbers).norm(), 1e-9);
}

}  // namespace marrow::test::refine_cameras_test
