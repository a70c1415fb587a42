// SPDX-License-Identifier: Apache-2.0
#include "tests/harness/threads.hpp"
#include "tests/plugins/project/shapes.hpp"
#include "tests/plugins/register/well.hpp"

namespace marrow::test::global_search_test {

/// A bowl with waves of 24 degrees or mm, far from where the CT lies; searched with as few poses as this bowl needs.
struct Trial {
  Trial() {
    const Mesh mesh = shapes::cylinder(14, 120);
    Pose middle;
    middle.frame = fragment_frame(mesh);
    truth = well::pose_at(middle, 12, -9, 25, -21, 17, 28);
    inputs["model"] = item(mesh);
    inputs["cost"] = Value::of<Cost>(std::make_shared<const well::Well>(truth.world_from_model, truth.frame, 1500, 24));
    inputs["optimizer"] = call("optimizer.nelder_mead", {}).at("optimizer");
  }
  Pose run(const Options& more = {}) const {
    return output<Pose>("initial.global_search", "pose", inputs,
                        with({{"poses", std::int64_t(4000)}, {"candidates", std::int64_t(20)}}, more));
  }
  double apart(const Pose& pose) const { return well::apart(truth, pose); }
  Pose truth;
  Inputs inputs;
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
  trial.inputs["cost"] = Value::of<Cost>(std::make_shared<const well::Well>(far.world_from_model, far.frame, 1500, 24));
  trial.truth = far;
  trial.inputs["start"] = item(start);
  EXPECT_LT(trial.apart(trial.run()), 0.5);
}

TEST(GlobalSearch, SameBytesAtAnyNumberOfThreads) {
  const Trial trial;
  const auto run = [&](std::size_t threads) {
    return with_threads(threads, [&] {
      return trial.run({{"poses", std::int64_t(500)}, {"candidates", std::int64_t(5)}});
    });
  };
  const Pose a = run(1), b = run(4);
  EXPECT_EQ(a.world_from_model.rotation, b.world_from_model.rotation);
  EXPECT_EQ(a.world_from_model.translation_mm, b.world_from_model.translation_mm);
}

TEST(GlobalSearch, DeclaresAsManyNumbersForEachLevel) {
  const std::string node = "initial.global_search";
  EXPECT_TRUE(declares(node, same_length({"contour_spacing_px", "reach_px"})));
  EXPECT_TRUE(declares(node, as_many_or_none("pixel_step", "contour_spacing_px")));
}

TEST(GlobalSearch, SaysWhatIsWrong) {
  Trial trial;
  EXPECT_EQ(refusal("initial.global_search", trial.inputs, {{"reach_px", Numbers{60, 24, 0}}}),
            "reach_px: each number must be positive");
  EXPECT_EQ(refusal("initial.global_search", trial.inputs, {{"poses", std::int64_t(0)}}),
            "it has no poses to try; give their number, such as 4000, and the ranges to search");
  EXPECT_EQ(refusal("initial.global_search", trial.inputs, {{"needs_start", true}}),
            "there is no start to search around; give the approximate placement of the fragment, in case.yaml under "
            "'start' (docs/case.md)");
  trial.inputs["model"] = item(Mesh{});
  EXPECT_NE(refusal("initial.global_search", trial.inputs).find("model"), std::string::npos);
}

}  // namespace marrow::test::global_search_test
