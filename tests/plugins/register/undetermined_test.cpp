// SPDX-License-Identifier: Apache-2.0
// A body of revolution looks the same however it turns about its axis, so no registration knows this turn.
#include <gtest/gtest.h>

#include <marrow/domain/verdict.hpp>

#include "ideal_edges.hpp"
#include "marrow/toolbox/search/predicted_covariance.hpp"
#include "shipped.hpp"

namespace undetermined_test {

/// The pose of a cylinder in two views. The edges lie on the outline that `projector` draws, with noise.
marrow::Pose found(const marrow::Mesh& mesh, const marrow::Value& projector, unsigned seed) {
  marrow::Pose start;
  start.frame = marrow::fragment_frame(mesh);
  start.world_from_model = shapes::centred_at({0, 0, 0});
  ideal_edges::Faults faults;
  faults.noise_px = 0.5;
  faults.seed = seed;
  marrow::Vector6d away;
  away << 2, -3, 10 * double(seed), 1, -1, 2;
  const marrow::RigidTransform truth = marrow::search::moved_by_units(start.world_from_model, start.frame, away);
  const ideal_edges::Scene seen =
      ideal_edges::scene_of(projector.as<marrow::OutlineProjector>(), truth, {0, 90}, faults);
  const auto cost = shipped::call("similarity.contour_distance", {{"projector", projector},
                                                                  {"views", shipped::list(seen.views, "view")},
                                                                  {"edges", shipped::list(seen.edges, "view")}});
  return shipped::call("register.multiresolution",
                       {{"cost", cost.at("cost")},
                        {"optimizer", shipped::call("optimizer.levenberg_marquardt", {}).at("optimizer")},
                        {"start", shipped::item(start)}},
                       {{"scan_rotation_deg", 0.0}, {"scan_translation_mm", 0.0}})
      .at("pose")
      .as<marrow::Pose>();
}

TEST(Undetermined, ABodyOfRevolutionIsNeverTrusted) {
  for (const char* name : {"project.silhouette", "project.silhouette_edges"})
    for (const int facets : {60, 90, 200})
      for (const unsigned seed : {1u, 2u, 3u}) {
        SCOPED_TRACE(std::string(name) + ", " + std::to_string(facets) + " facets, seed " + std::to_string(seed));
        const marrow::Mesh mesh = shapes::cylinder(14, 90, facets);
        const shipped::Inputs model{{"model", shipped::item(mesh)}};  // the projector refers to it
        const marrow::Pose pose = found(mesh, shipped::call(name, model).at("projector"), seed);
        // A turn that is anywhere between -16 and 16 degrees, as far as is looked, has a deviation of 16 / sqrt(3)
        // = 9.2.
        ASSERT_TRUE(pose.covariance);
        EXPECT_GT(marrow::degrees(std::sqrt((*pose.covariance)(2, 2))), 5);
        EXPECT_LT(std::sqrt((*pose.covariance)(5, 5)), 0.5);
        ASSERT_EQ(pose.warnings.size(), 1u);
        EXPECT_EQ(pose.warnings[0].rfind("axial rotation is ", 0), 0u) << pose.warnings[0];
        const auto verdict =
            shipped::call("verdict.predicted", {{"pose", shipped::item(pose)}, {"model", shipped::item(mesh)}});
        EXPECT_NE(verdict.at("verdict").as<marrow::Verdict>().judgement, marrow::Judgement::trusted);
      }
}

}  // namespace undetermined_test
