// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "shipped.hpp"

namespace landmarks_test {

/// A broken femur, the true poses of its fragments, and two cameras that show its distal 180 mm.
struct Broken {
  Broken() {
    const auto bone =
        shipped::call("simulate.femur", {}, {{"isocentre_from_distal_end_mm", 70.0}, {"resolution_mm", 2.0}})
            .at("bone");
    phantom = shipped::call(
                  "simulate.fracture", {{"bone", bone}},
                  {{"rotation_deg", std::vector<double>{4, -5, 7}}, {"translation_mm", std::vector<double>{5, -4, 6}}})
                  .at("phantom");
    truths = shipped::call("simulate.truth", {{"phantom", phantom}}).at("truths");
    cameras = shipped::call("camera.carm", {},
                            {{"names", std::vector<std::string>{"frontal", "lateral"}},
                             {"alpha_deg", std::vector<double>{0, 0}},
                             {"beta_deg", std::vector<double>{0, 90}},
                             {"source_to_detector_mm", 1000.0},
                             {"source_to_isocentre_mm", 600.0},
                             {"width_px", std::int64_t(512)},
                             {"height_px", std::int64_t(1400)},
                             {"pixel_mm", 0.586}})
                  .at("camera");
  }
  marrow::List<marrow::Landmarks> landmarks(const shipped::Options& options, std::uint64_t seed = 1) const {
    return shipped::call("simulate.landmarks", {{"phantom", phantom}, {"cameras", cameras}}, options,
                         marrow::Context(seed))
        .at("landmarks")
        .as_list<marrow::Landmarks>();
  }
  marrow::Value phantom, truths, cameras;
};

TEST(SimulateLandmarks, WithoutNoiseLieWhereTheTruthHasThem) {
  const Broken broken;
  const auto cameras = broken.cameras.as_list<marrow::Camera>();
  const auto truths = broken.truths.as_list<marrow::Truth>();
  const auto fragments = broken.landmarks({{"noise_px", 0.0}, {"noise_mm", 0.0}, {"count", std::int64_t(8)}});
  ASSERT_EQ(fragments.names(), truths.names());
  for (std::size_t f = 0; f < fragments.size(); ++f) {
    const marrow::Landmarks& landmarks = fragments[f];
    ASSERT_EQ(landmarks.points.size(), 8u);
    ASSERT_EQ(landmarks.seen.size(), 16u);
    ASSERT_EQ(landmarks.tracked.size(), 8u);
    for (std::size_t i = 0; i < 8; ++i) {
      const Eigen::Vector3d world = truths[f].world_from_model * landmarks.points[i].model_mm;
      EXPECT_LT((landmarks.tracked[i].world_mm - world).norm(), 1e-9);
      for (std::size_t v = 0; v < 2; ++v) {
        EXPECT_EQ(landmarks.seen[2 * i + v].view, cameras.name(v));
        EXPECT_LT((landmarks.seen[2 * i + v].pixel - project(cameras[v], world)).norm(), 1e-9);
      }
      for (std::size_t j = 0; j < i; ++j)
        EXPECT_GT((landmarks.points[i].model_mm - landmarks.points[j].model_mm).norm(), 10) << i << " " << j;
    }
  }
}

TEST(SimulateLandmarks, NoiseHasTheSizeAskedForAndDependsOnTheSeedAlone) {
  const Broken broken;
  const auto cameras = broken.cameras.as_list<marrow::Camera>();
  const auto truths = broken.truths.as_list<marrow::Truth>();
  const shipped::Options many{{"noise_px", 2.0}, {"noise_mm", 0.5}, {"count", std::int64_t(100)}};
  const auto fragments = broken.landmarks(many);
  double pixels = 0, places = 0;
  for (std::size_t f = 0; f < 2; ++f)
    for (std::size_t i = 0; i < 100; ++i) {
      const Eigen::Vector3d world = truths[f].world_from_model * fragments[f].points[i].model_mm;
      places += (fragments[f].tracked[i].world_mm - world).squaredNorm();
      for (std::size_t v = 0; v < 2; ++v)
        pixels += (fragments[f].seen[2 * i + v].pixel - project(cameras[v], world)).squaredNorm();
    }
  EXPECT_NEAR(std::sqrt(pixels / 800), 2, 0.15) << "of 800 coordinates";
  EXPECT_NEAR(std::sqrt(places / 600), 0.5, 0.045) << "of 600 coordinates";
  EXPECT_EQ(broken.landmarks(many)[0].seen[5].pixel, fragments[0].seen[5].pixel);
  EXPECT_NE(broken.landmarks(many, 2)[0].seen[5].pixel, fragments[0].seen[5].pixel);
}

TEST(SimulateLandmarks, SaysWhatIsWrong) {
  const Broken broken;
  const auto aside = shipped::call("camera.carm", {},
                                   {{"names", std::vector<std::string>{"frontal"}},
                                    {"alpha_deg", std::vector<double>{0}},
                                    {"beta_deg", std::vector<double>{0}},
                                    {"source_to_detector_mm", 1000.0},
                                    {"source_to_isocentre_mm", 600.0},
                                    {"width_px", std::int64_t(512)},
                                    {"height_px", std::int64_t(512)},
                                    {"pixel_mm", 0.001}})
                         .at("camera");
  EXPECT_EQ(shipped::refusal("simulate.landmarks", {{"phantom", broken.phantom}, {"cameras", aside}}),
            "simulate.landmarks: all views together show too little of every fragment for 6 landmarks; choose fewer, "
            "or turn the cameras to a fragment");
}

}  // namespace landmarks_test
