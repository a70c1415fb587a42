// SPDX-License-Identifier: Apache-2.0
#include "tests/plugins/simulate/phantoms.hpp"

namespace marrow::test::markers_test {

using namespace simulated;

// Landmarks on a broken femur, and markers on the skin about it.

/// A broken femur, made only once. It is coarse, because each call checks its surface.
const Value& broken(double resolution_mm) {
  static std::map<double, Value> made;
  Value& phantom = made[resolution_mm];
  if (phantom.is_absent())
    phantom = item(fracture(femur({{"isocentre_from_distal_end_mm", 70.0}, {"resolution_mm", resolution_mm}}),
                            {{"rotation_deg", Numbers{4, -5, 7}}, {"translation_mm", Numbers{5, -4, 6}}}));
  return phantom;
}

/// Two cameras that show its distal 180 mm.
List<Camera> cameras() {
  List<Camera> cameras;
  for (const auto& [name, beta_deg] : {std::pair("frontal", 0.0), std::pair("lateral", 90.0)}) {
    Camera camera = simulated::camera(beta_deg);
    camera.height_px = 1400;
    camera.intrinsics(1, 2) = 0.5 * (1400 - 1);
    cameras.add(name, camera);
  }
  return cameras;
}
List<Landmarks> landmarks(const Options& options, std::uint64_t seed = 1) {
  return output_list<Landmarks>("simulate.landmarks", "landmarks",
                                {{"phantom", broken(2)}, {"cameras", list(cameras(), "view")}}, options, Context(seed));
}
List<Truth> truths() { return output_list<Truth>("simulate.truth", "truths", {{"phantom", broken(2)}}); }

TEST(SimulateLandmarks, WithoutNoiseLieWhereTheTruthHasThem) {
  const auto fragments = landmarks({{"noise_px", 0.0}, {"noise_mm", 0.0}, {"count", 8}});
  const auto exact = truths();
  ASSERT_EQ(fragments.names(), exact.names());
  for (std::size_t f = 0; f < fragments.size(); ++f) {
    const Landmarks& of_fragment = fragments[f];
    ASSERT_EQ(of_fragment.points.size(), 8u);
    ASSERT_EQ(of_fragment.seen.size(), 16u);
    ASSERT_EQ(of_fragment.tracked.size(), 8u);
    for (std::size_t i = 0; i < 8; ++i) {
      const Vector3d world = exact[f].world_from_model * of_fragment.points[i].model_mm;
      EXPECT_LT((of_fragment.tracked[i].world_mm - world).norm(), 1e-9);
      for (std::size_t v = 0; v < 2; ++v) {
        EXPECT_EQ(of_fragment.seen[2 * i + v].view, cameras().name(v));
        EXPECT_LT((of_fragment.seen[2 * i + v].pixel - project(cameras()[v], world)).norm(), 1e-9);
      }
      for (std::size_t j = 0; j < i; ++j)
        EXPECT_GT((of_fragment.points[i].model_mm - of_fragment.points[j].model_mm).norm(), 10) << i << " " << j;
    }
  }
}

TEST(SimulateLandmarks, NoiseHasTheSizeAskedForAndDependsOnTheSeedAlone) {
  const Options many{{"noise_px", 2.0}, {"noise_mm", 0.5}, {"count", 100}};
  const auto fragments = landmarks(many);
  const auto exact = truths();
  const auto seen_by = cameras();
  double pixels = 0, places = 0;
  for (std::size_t f = 0; f < 2; ++f)
    for (std::size_t i = 0; i < 100; ++i) {
      const Vector3d world = exact[f].world_from_model * fragments[f].points[i].model_mm;
      places += (fragments[f].tracked[i].world_mm - world).squaredNorm();
      for (std::size_t v = 0; v < 2; ++v)
        pixels += (fragments[f].seen[2 * i + v].pixel - project(seen_by[v], world)).squaredNorm();
    }
  EXPECT_NEAR(std::sqrt(pixels / 800), 2, 0.15) << "of 800 coordinates";
  EXPECT_NEAR(std::sqrt(places / 600), 0.5, 0.045) << "of 600 coordinates";
  EXPECT_EQ(landmarks(many)[0].seen[5].pixel, fragments[0].seen[5].pixel);
  EXPECT_NE(landmarks(many, 2)[0].seen[5].pixel, fragments[0].seen[5].pixel);
}

TEST(SimulateLandmarks, SaysWhatIsWrong) {
  Camera aside = simulated::camera();  // with pixels of 1 micrometre
  aside.intrinsics(0, 0) = aside.intrinsics(1, 1) = 1e6;
  EXPECT_EQ(refusal("simulate.landmarks", {{"phantom", broken(2)}, {"cameras", per_view("frontal", aside)}}),
            "simulate.landmarks: all views together show too little of every fragment for 6 landmarks; choose fewer, "
            "or turn the cameras to a fragment");
}

const Fragment& distal() { return phantom::distal_fragment(broken(6).as<Phantom>()); }

/// Without errors but for those of the options.
Landmarks markers(const Options& options = {}, std::uint64_t seed = 1) {
  const auto all = output_list<Landmarks>(
      "simulate.skin_markers", "landmarks", {{"phantom", broken(6)}},
      with({{"noise_mm", 0.0}, {"common_rotation_deg", 0.0}, {"common_shift_mm", 0.0}}, options), Context(seed));
  return *all.find("distal");
}
/// A place in the model, along the axes of the distal fragment.
Vector3d in_axes(const Vector3d& model_mm) {
  return distal().frame.axes.transpose() * (model_mm - distal().frame.origin_mm);
}
/// Where a marker is tracked, in the model.
Vector3d tracked_in_model(const Landmarks& found, std::size_t i) {
  return inverse(distal().world_from_ct) * found.tracked[i].world_mm;
}
/// How far from its true place a marker is tracked.
Vector3d off_mm(const Landmarks& found, std::size_t i) {
  return found.tracked[i].world_mm - distal().world_from_ct * found.points[i].model_mm;
}

TEST(SimulateSkinMarkers, LieAroundTheLongAxisAndAlongIt) {
  const Landmarks found = markers({{"count", 5}, {"radius_mm", 60.0}, {"length_mm", 100.0}});
  ASSERT_EQ(found.points.size(), 5u);
  double low = 1e9, high = -1e9;
  Vector2d sum = Vector2d::Zero();
  for (const auto& point : found.points) {
    const Vector3d at = in_axes(point.model_mm);
    EXPECT_NEAR(at.head<2>().norm(), 60, 6.001);
    low = std::min(low, at.z());
    high = std::max(high, at.z());
    sum += at.head<2>();
  }
  EXPECT_NEAR(low, -50, 3);
  EXPECT_NEAR(high, 50, 3);
  EXPECT_LT(sum.norm() / 5, 20) << "they are all around the limb";
  EXPECT_EQ(found.points[4].name, "m5");
}

TEST(SimulateSkinMarkers, WithoutErrorsAreTrackedWhereTheTruthHasThem) {
  const Landmarks found = markers();
  ASSERT_EQ(found.tracked.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(found.tracked[i].name, found.points[i].name);
    EXPECT_LT(off_mm(found, i).norm(), 1e-9);
  }
}

TEST(SimulateSkinMarkers, AFalseRotationTurnsAllOfThemAboutTheLongAxis) {
  const Landmarks found = markers({{"false_rotation_deg", 20.0}});
  const Matrix3d turn = rotation_from_vector({0, 0, radians(20)});
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_LT((in_axes(tracked_in_model(found, i)) - turn * in_axes(found.points[i].model_mm)).cwiseAbs().maxCoeff(),
              1e-9);
}

TEST(SimulateSkinMarkers, ErrorsHaveTheDeviationsThatWereAsked) {
  constexpr int kRuns = 200;
  double own = 0, turn = 0, shift = 0;
  for (std::uint64_t seed = 1; seed <= kRuns; ++seed) {
    const Landmarks noisy = markers({{"noise_mm", 3.0}}, seed), turned = markers({{"common_rotation_deg", 6.0}}, seed),
                    shifted = markers({{"common_shift_mm", 4.0}}, seed);
    for (std::size_t i = 0; i < 4; ++i) {
      own += off_mm(noisy, i).squaredNorm();
      EXPECT_LT((off_mm(shifted, i) - off_mm(shifted, 0)).norm(), 1e-9);
    }
    const Vector3d a = in_axes(turned.points[0].model_mm), b = in_axes(tracked_in_model(turned, 0));
    turn += std::pow(degrees(std::atan2(a.x() * b.y() - a.y() * b.x(), a.x() * b.x() + a.y() * b.y())), 2);
    shift += off_mm(shifted, 0).squaredNorm();
  }
  EXPECT_NEAR(std::sqrt(own / (12 * kRuns)), 3, 0.1);
  EXPECT_NEAR(std::sqrt(turn / kRuns), 6, 0.5);
  EXPECT_NEAR(std::sqrt(shift / (3 * kRuns)), 4, 0.25);
}

TEST(SimulateSkinMarkers, DependOnTheSeedAlone) {
  const auto place = [](std::uint64_t seed) { return markers({{"noise_mm", 3.0}}, seed).tracked[2].world_mm; };
  EXPECT_EQ(place(5), place(5));
  EXPECT_NE(place(5), place(6));
}

// A fragment on a hexapod: the commands, its true pose, and how far the errors move it.

const Phantom& broken() {
  static const Phantom made = fracture(femur(), {{"height_fraction", 0.4}});
  return made;
}
List<Pose> sweeps(const Options& options = {{"turn_step_deg", 15.0}}) {
  return output_list<Pose>("simulate.sweeps", "commands", {}, options);
}

Inputs commanded(const List<Pose>& commands) {
  return {{"phantom", item(broken())}, {"commands", list(commands, "position")}};
}
/// Without errors but for those of the options.
Outputs hexapod(const List<Pose>& commands, const Options& options = {}, std::uint64_t seed = 1) {
  return call("simulate.hexapod", commanded(commands),
              with({{"leg_sd_mm", 0.0}, {"joint_sd_mm", 0.0}, {"mount_sd_deg", 0.0}, {"mount_sd_mm", 0.0}}, options),
              Context(seed));
}
List<Truth> truths(const Outputs& made, const std::string& port = "platform") { return made.at(port).as_list<Truth>(); }

/// Errors of the platform's motions from the first position, in degrees and mm, root mean square.
std::array<double, 2> errors(const Options& options) {
  const List<Pose> commands = sweeps({});
  const List<Truth> found = truths(hexapod(commands, options)), exact = truths(hexapod(commands));
  double turn2 = 0, shift2 = 0;
  for (std::size_t i = 1; i < found.size(); ++i) {
    const auto motion = [&](const List<Truth>& list) {
      return inverse(list[0].world_from_model) * list[i].world_from_model;
    };
    const RigidTransform error = inverse(motion(exact)) * motion(found);
    turn2 += std::pow(degrees(vector_from_rotation(error.rotation).norm()), 2);
    shift2 += error.translation_mm.squaredNorm();
  }
  return {std::sqrt(turn2 / double(found.size() - 1)), std::sqrt(shift2 / double(found.size() - 1))};
}

TEST(SimulateSweeps, BeginAtNeutralAndGoFromThereToEitherSide) {
  EXPECT_EQ(sweeps({}).size(), 94u);  // 3 x 31 and the neutral one
  const List<Pose> commands = sweeps({{"axes", Strings{"y"}}, {"max_rotation_deg", 5.0}, {"turn_step_deg", 2.5}});
  EXPECT_EQ(commands.names(), (Strings{"neutral", "ry+00.00", "ry+02.50", "ry+05.00", "ry-02.50", "ry-05.00"}));
  const RigidTransform& last = commands[5].world_from_model;
  EXPECT_NEAR(degrees(vector_from_rotation(last.rotation).y()), -5, 1e-9);
  EXPECT_LT((last * Vector3d(0, 0, 90) - Vector3d(0, 0, 90)).norm(), 1e-9);
}

TEST(SimulateSweeps, NamesTellAllStepsApart) {
  const auto names = [](double range_deg, double step_deg) {
    return sweeps({{"axes", Strings{"z"}}, {"max_rotation_deg", range_deg}, {"turn_step_deg", step_deg}}).names();
  };
  EXPECT_EQ(names(0.03, 0.015), (Strings{"neutral", "rz+00.000", "rz+00.015", "rz+00.030", "rz-00.015", "rz-00.030"}));
  EXPECT_EQ(names(0.5, 0.5), (Strings{"neutral", "rz+00.00", "rz+00.50", "rz-00.50"}));
  EXPECT_EQ(names(1, 1.0 / 3)[2], "rz+00.333333");
}

TEST(SimulateHexapod, WithoutErrorsItDoesWhatItIsTold) {
  const List<Pose> commands = sweeps({{"max_rotation_deg", 15.0}, {"turn_step_deg", 15.0}});
  const Outputs made = hexapod(commands);
  const List<Truth> platform = truths(made), fragment = truths(made, "fragment");
  const RigidTransform home = platform[0].world_from_model,
                       platform_from_ct = inverse(home) * fragment[0].world_from_model;
  for (std::size_t i = 0; i < commands.size(); ++i) {
    const RigidTransform motion = inverse(home) * platform[i].world_from_model,
                         mounted = inverse(platform[i].world_from_model) * fragment[i].world_from_model;
    EXPECT_LT((motion.rotation - commands[i].world_from_model.rotation).norm(), 1e-9) << commands.name(i);
    EXPECT_LT(shift_between_mm(motion, commands[i].world_from_model), 1e-7);
    EXPECT_LT((mounted.rotation - platform_from_ct.rotation).norm(), 1e-9);
    EXPECT_LT(shift_between_mm(mounted, platform_from_ct), 1e-7);
  }
  EXPECT_LT((made.at("start").as<Pose>().world_from_model.rotation - fragment[0].world_from_model.rotation).norm(),
            1e-9);
  // The fragment stands on its fracture, with its middle at the given place.
  const Fragment& distal = phantom::distal_fragment(broken());
  EXPECT_LT((fragment[0].world_from_model * distal.frame.origin_mm - Vector3d(3, -4, 5)).norm(), 1e-7);
  double lowest = 1e9;
  for (const auto& triangle : distal.outer.triangles)
    for (const auto corner : triangle)
      lowest = std::min(lowest, (platform_from_ct * distal.outer.vertices_mm[corner]).z());
  EXPECT_NEAR(lowest, 5, 1e-9);
  EXPECT_NEAR((platform_from_ct.rotation * distal.frame.axes.col(2)).z(), -1, 1e-9);
}

TEST(SimulateHexapod, ErrorsMoveThePlatformByAsMuchAsTheyShould) {
  // Legs of 0.02 mm: 0.01 to 0.02 degrees at each end of the motion; joints of 0.05 mm: 0.007 degrees, because most of
  // their error is the same at home; both of 0.1 mm: 0.08 degrees.
  const auto legs = errors({{"leg_sd_mm", 0.02}}), joints = errors({{"joint_sd_mm", 0.05}}),
             both = errors({{"leg_sd_mm", 0.1}, {"joint_sd_mm", 0.1}});
  EXPECT_GT(legs[0], 0.012);
  EXPECT_LT(legs[0], 0.035);
  EXPECT_GT(joints[0], 0.002);
  EXPECT_LT(joints[0], 0.02);
  EXPECT_GT(both[0], 0.05);
  EXPECT_LT(both[0], 0.16);
  EXPECT_GT(both[1], 0.08);
  EXPECT_LT(both[1], 0.5);
}

TEST(SimulateHexapod, AHexapodKeepsItsJointsAndARunItsMounting) {
  const List<Pose> commands = sweeps();
  const auto platform = [&](const Options& options, std::uint64_t seed) {
    return truths(hexapod(commands, options, seed))[1].world_from_model.translation_mm;
  };
  EXPECT_EQ(platform({{"joint_sd_mm", 0.05}}, 1), platform({{"joint_sd_mm", 0.05}}, 2));
  EXPECT_NE(platform({{"joint_sd_mm", 0.05}}, 1), platform({{"joint_sd_mm", 0.05}, {"platform_seed", 2}}, 1));
  EXPECT_NE(platform({{"leg_sd_mm", 0.05}}, 1), platform({{"leg_sd_mm", 0.05}}, 2));
  const auto mounted = [&](std::uint64_t seed, std::size_t i) {
    const Outputs made = hexapod(commands, {{"mount_sd_deg", 2.0}}, seed);
    return inverse(truths(made)[i].world_from_model) * truths(made, "fragment")[i].world_from_model;
  };
  EXPECT_LT((mounted(1, 0).rotation - mounted(1, 3).rotation).norm(), 1e-9);
  EXPECT_GT(turn_between_deg(mounted(1, 0), mounted(2, 0)), 0.5);
  EXPECT_LT(turn_between_deg(mounted(1, 0), mounted(2, 0)), 15);
}

TEST(SimulateHexapod, SaysTheLengthsOfItsLegs) {
  const auto legs = hexapod(sweeps()).at("legs").as_list<Metrics>();
  // At home: from 150 (cos 12, -sin 12) to 90 (cos 48, -sin 48), 220 mm higher.
  EXPECT_NEAR(figure(item(legs[0]), "leg1"),
              std::hypot(std::hypot(150 * std::cos(radians(12)) - 90 * std::cos(radians(48)),
                                    150 * std::sin(radians(12)) - 90 * std::sin(radians(48))),
                         220),
              1e-9);
}

TEST(SimulateHexapod, RefusesWhatItCannotDo) {
  const std::string text = refusal("simulate.hexapod", commanded(sweeps()), {{"stroke_mm", 10.0}});
  EXPECT_BEGINS(text, "simulate.hexapod: motion 'rx+15.00' is outside the hexapod's workspace: leg 1 would be ");
  EXPECT_EQ(refusal("simulate.hexapod", commanded(sweeps()), {{"fragment", "middle"}}),
            "simulate.hexapod: the phantom has no fragment 'middle', only proximal, distal");
}

}  // namespace marrow::test::markers_test
