// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include "shipped.hpp"
#include "tests/plugins/project/shapes.hpp"
#include "tests/plugins/register/well.hpp"

namespace global_search_test {

using marrow::Cost;
using marrow::Pose;

/// A bowl with waves of 24 degrees or mm, far from where the CT lies; searched with as few poses as this bowl needs.
struct Trial {
  Trial() {
    const marrow::Mesh mesh = shapes::cylinder(14, 120);
    Pose middle;
    middle.frame = marrow::fragment_frame(mesh);
    middle.world_from_model = {"world", mesh.frame};
    truth = well::pose_at(middle, 12, -9, 25, -21, 17, 28);
    inputs["model"] = shipped::item(mesh);
    inputs["cost"] =
        marrow::Value::of<Cost>(std::make_shared<const well::Well>(truth.world_from_model, truth.frame, 1500, 24));
    inputs["optimizer"] = shipped::call("optimizer.nelder_mead", {}).at("optimizer");
  }
  Pose run(const shipped::Options& more = {}) const {
    shipped::Options options{{"poses", std::int64_t(4000)}, {"candidates", std::int64_t(20)}};
    for (const auto& [name, value] : more) options[name] = value;
    return shipped::call("initial.global_search", inputs, options).at("pose").as<Pose>();
  }
  double apart(const Pose& pose) const {
    return well::way(truth.world_from_model, pose.world_from_model, truth.frame).norm();
  }
  Pose truth;
  shipped::Inputs inputs;
};

TEST(GlobalSearch, FindsThePoseAmongManyMinimaWithoutAStart) {
  const Trial trial;
  const Pose found = trial.run();
  EXPECT_LT(trial.apart(found), 0.5);
  EXPECT_GT(found.evaluations, 4000);
  EXPECT_GT(trial.apart(trial.run({{"poses", std::int64_t(1)}})), 5)
      << "from the middle alone it ends in another minimum";
}

TEST(GlobalSearch, TheRangesLieAboutTheStart) {
  Trial trial;
  const Pose far = well::pose_at(trial.truth, 0, 0, 0, 60, 90, 0);
  Pose start = far;
  start.world_from_model = well::pose_at(far, 5, 5, -20, 10, -10, 20).world_from_model;
  trial.inputs["cost"] =
      marrow::Value::of<Cost>(std::make_shared<const well::Well>(far.world_from_model, far.frame, 1500, 24));
  trial.truth = far;
  trial.inputs["start"] = shipped::item(start);
  EXPECT_LT(trial.apart(trial.run()), 0.5);
}

TEST(GlobalSearch, SameBytesAtAnyNumberOfThreads) {
  const Trial trial;
  const auto run = [&](std::size_t threads) {
    tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    return trial.run({{"poses", std::int64_t(500)}, {"candidates", std::int64_t(5)}});
  };
  const Pose a = run(1), b = run(4);
  EXPECT_EQ(a.world_from_model.rotation, b.world_from_model.rotation);
  EXPECT_EQ(a.world_from_model.translation_mm, b.world_from_model.translation_mm);
}

TEST(GlobalSearch, DeclaresAsManyNumbersForEachLevel) {
  const std::string node = "initial.global_search";
  EXPECT_TRUE(shipped::declares(node, marrow::same_length({"contour_spacing_px", "reach_px"})));
  EXPECT_TRUE(shipped::declares(node, marrow::as_many_or_none("pixel_step", "contour_spacing_px")));
}

TEST(GlobalSearch, SaysWhatIsWrong) {
  Trial trial;
  EXPECT_EQ(shipped::refusal("initial.global_search", trial.inputs, {{"reach_px", std::vector<double>{60, 24, 0}}}),
            "reach_px: each number must be positive");
  EXPECT_EQ(shipped::refusal("initial.global_search", trial.inputs, {{"poses", std::int64_t(0)}}),
            "it has no poses to try; give their number, such as 4000, and the ranges to search");
  EXPECT_EQ(shipped::refusal("initial.global_search", trial.inputs, {{"needs_start", true}}),
            "there is no start to search around; give the approximate placement of the fragment, in case.yaml under "
            "'start' (docs/case.md)");
  trial.inputs["model"] = shipped::item(marrow::Mesh{});
  EXPECT_NE(shipped::refusal("initial.global_search", trial.inputs).find("model"), std::string::npos);
}

}  // namespace global_search_test
