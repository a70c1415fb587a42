// SPDX-License-Identifier: Apache-2.0
// Landmarks on a broken femur, and markers on the skin about it.
#include "tests/plugins/simulate/phantoms.hpp"

namespace marrow::test::markers_test {

using namespace simulated;

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
  const auto fragments = landmarks({{"noise_px", 0.0}, {"noise_mm", 0.0}, {"count", std::int64_t(8)}});
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
  const Options many{{"noise_px", 2.0}, {"noise_mm", 0.5}, {"count", std::int64_t(100)}};
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
  const Landmarks found = markers({{"count", std::int64_t(5)}, {"radius_mm", 60.0}, {"length_mm", 100.0}});
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

}  // namespace marrow::test::markers_test
