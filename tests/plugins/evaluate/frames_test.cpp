// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "marrow/toolbox/track/track_state.hpp"
#include "shipped.hpp"

namespace frames_test {

using marrow::List;
using marrow::Metrics;
using marrow::track::TrackState;

List<Metrics> figures(const std::vector<double>& values) {
  List<Metrics> list;
  for (std::size_t i = 0; i < values.size(); ++i)
    list.add(std::to_string(i + 1), Metrics{{{"mtre_mm", values[i], "mm"}, {"axial_deg", -values[i], "deg"}}});
  return list;
}

const shipped::Options kBoth{{"figures", std::vector<std::string>{"mtre_mm", "axial_deg"}}};

TEST(Frames, AreSummedUp) {
  const auto sums =
      shipped::call("evaluate.frames", {{"metrics", shipped::list(figures({3, 1, 2, 10, 4}), "frame")}}, kBoth)
          .at("metrics");
  EXPECT_EQ(shipped::figure(sums, "frames"), 5);
  EXPECT_EQ(shipped::figure(sums, "median_mtre_mm"), 3);
  EXPECT_EQ(shipped::figure(sums, "worst_axial_deg"), 10) << "the sign does not count";
  EXPECT_NEAR(shipped::figure(sums, "rms_axial_deg"), std::sqrt(130 / 5.0), 1e-12);
}

TEST(Frames, HaveQuantilesAsNumpyHasThem) {
  // numpy.quantile([1, 3], [0.5, 0.95]) and of [3, 1, 2, 10]: between two ranks, the value is between theirs.
  const auto sums_of = [](const std::vector<double>& values) {
    return shipped::call("evaluate.frames", {{"metrics", shipped::list(figures(values), "frame")}}, kBoth)
        .at("metrics");
  };
  EXPECT_NEAR(shipped::figure(sums_of({1, 3}), "median_mtre_mm"), 2, 1e-12);
  EXPECT_NEAR(shipped::figure(sums_of({1, 3}), "p95_mtre_mm"), 2.9, 1e-12);
  EXPECT_NEAR(shipped::figure(sums_of({3, 1, 2, 10}), "median_axial_deg"), 2.5, 1e-12);
  EXPECT_NEAR(shipped::figure(sums_of({3, 1, 2, 10}), "p95_axial_deg"), 8.95, 1e-12);
}

TEST(Frames, LostOnesDoNotCount) {
  List<TrackState> states;
  for (int i = 0; i < 3; ++i) {
    TrackState state;
    if (i != 1) state.measured.emplace();
    states.add(std::to_string(i + 1), state);
  }
  const shipped::Inputs inputs{{"metrics", shipped::list(figures({1, 99, 3}), "frame")},
                               {"states", shipped::list(states, "frame")}};
  const auto sums = shipped::call("evaluate.frames", inputs, kBoth).at("metrics");
  EXPECT_EQ(shipped::figure(sums, "frames_lost"), 1);
  EXPECT_EQ(shipped::figure(sums, "worst_mtre_mm"), 3);
  shipped::Inputs fewer = inputs;
  fewer["metrics"] = shipped::list(figures({1, 99}), "frame");
  EXPECT_EQ(shipped::refusal("evaluate.frames", fewer), "the states are of other frames than the figures: 3 and 2");
  EXPECT_EQ(shipped::refusal("evaluate.frames", inputs, {{"figures", std::vector<std::string>{"mtre"}}}),
            "frame '1' has no figure 'mtre'; there are mtre_mm, axial_deg");
}

}  // namespace frames_test
