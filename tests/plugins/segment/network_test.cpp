// SPDX-License-Identifier: Apache-2.0
// A network of one convolution is a soft threshold of the CT, so what it must find is known exactly.
#include <tbb/global_control.h>

#include "tests/plugins/segment/phantom.hpp"
#include "tests/plugins/toolbox/network/written.hpp"

namespace marrow::test::network_test {

constexpr const char* kNode = "segment.network";
constexpr double kThreshold_hu = 600;

const std::string kSlices = R"(marrow-network: 1
name: plain
help: a soft threshold
version: 1.0.0
licence: Apache-2.0
trained: {data: nothing, good_for: tests, not_for: anything else}
input:
  values: hounsfield
  bone: bright
  pixel_px: 1
  normalise: {method: fixed, low: 0, high: 1000}
  size_px: [32, 32]
  overlap_px: 8
outputs:
  classes: {layer: maps, names: [bone], activation: sigmoid}
)";

/// The probability is 0.5 at kThreshold_hu and changes by 1 in about 1000 HU.
std::string soft_threshold() {
  return Convolution{.side = 1, .weights = {4}, .bias = {float(-4 * kThreshold_hu / 1000)}}.bytes();
}

List<SignedField> fields_of(const Written& network, const Volume& volume, const List<Seeds>& seeds,
                            Options options = {}) {
  options["network"] = network.file().string();
  return segmented::fields(kNode, volume, seeds, options);
}

TEST(SegmentNetwork, ASoftThresholdFindsTheVoxelsOfTheThreshold) {
  const bones::BrokenTube tube{.gap_mm = 3};
  const Volume volume = tube.volume();
  const auto found = fields_of(Written(soft_threshold(), kSlices), volume, tube.seeds());
  const auto expected = segmented::fields("segment.threshold", volume, tube.seeds(), {{"threshold_hu", kThreshold_hu}});
  ASSERT_EQ(found.names(), expected.names());
  for (std::size_t f = 0; f < 2; ++f) {
    long differ = 0, all = 0;
    for (std::size_t at = 0; at < found[f].values_mm.size(); ++at) {
      differ += (found[f].values_mm[at] < 0) != (expected[f].values_mm[at] < 0);
      all += expected[f].values_mm[at] < 0;
    }
    EXPECT_GT(all, 10000);
    EXPECT_LT(double(differ), 1e-3 * double(all)) << "only voxels that the fragments contend for may differ";
  }
}

class Pixels : public testing::TestWithParam<std::pair<const char*, double>> {};

TEST_P(Pixels, TheSurfaceLiesBetweenTheVoxels) {
  const bones::BrokenTube tube{.gap_mm = 1.5};
  const auto fields =
      fields_of(Written(soft_threshold(), with(kSlices, "pixel_px: 1", GetParam().first)), tube.volume(), tube.seeds());
  for (std::size_t f = 0; f < 2; ++f) {
    const auto accuracy = tube.compare(fields, f);
    EXPECT_LT(accuracy.mean_mm, GetParam().second);
    EXPECT_LT(std::abs(accuracy.bias_mm), GetParam().second);
  }
  EXPECT_EQ(bones::overlap(fields), 0u);
}

INSTANTIATE_TEST_SUITE_P(Sizes, Pixels,
                         testing::Values(std::pair("pixel_px: 1", 0.15), std::pair("pixel_mm: 0.5", 0.15),
                                         std::pair("pixel_mm: 1.1", 0.25)));

TEST(SegmentNetwork, TakesNeighbouringSlicesInTheirOrder) {
  // Only the slice above counts, so the bone is found one slice too low.
  const Written above(Convolution{.channels = 3, .side = 1, .weights = {0, 0, 4}, .bias = {-2}}.bytes(),
                      with(kSlices, "overlap_px: 8", "overlap_px: 8\n  slices: 3"));
  Volume volume{bones::ct_grid({16, 16, 20}), {}};
  volume.values.assign(volume.grid.count(), -100);
  for (int z = 8; z < 14; ++z)
    for (int y = 4; y < 12; ++y)
      for (int x = 4; x < 12; ++x) volume.values[volume.grid.offset(x, y, z)] = 1100;
  const List<Seeds> seeds = named("block", Seeds{"block", {volume.grid.point_from_index({8, 8, 10})}});
  const auto field = fields_of(above, volume, seeds)[0];
  for (int z = 0; z < 20; ++z) EXPECT_EQ(field.at(8, 8, z) < 0, z >= 7 && z < 13) << "slice " << z;
}

TEST(SegmentNetwork, FragmentsMeetWhereTheNetworkIsLeastSure) {
  Volume volume{bones::ct_grid({12, 12, 40}), {}};
  volume.values.assign(volume.grid.count(), -100);
  for (int z = 4; z < 36; ++z)
    for (int y = 3; y < 9; ++y)
      for (int x = 3; x < 9; ++x) volume.values[volume.grid.offset(x, y, z)] = z == 12 ? 900 : 1300;
  const List<Seeds> seeds = named("low", Seeds{"low", {volume.grid.point_from_index({6, 6, 6})}}, "high",
                                  Seeds{"high", {volume.grid.point_from_index({6, 6, 33})}});
  const auto fields = fields_of(Written(soft_threshold(), kSlices), volume, seeds);
  for (int z = 5; z < 35; ++z) {
    if (z == 12) continue;
    EXPECT_EQ(fields[0].at(6, 6, z) < 0, z < 12) << "slice " << z;
    EXPECT_EQ(fields[1].at(6, 6, z) < 0, z > 12) << "slice " << z;
  }
}

TEST(SegmentNetwork, AddsUpTheClassesThatAreBone) {
  const bones::BrokenTube tube{.gap_mm = 3};
  const Written two(Convolution{.side = 1, .weights = {0, 4, 4}, .bias = {2.4f, -1, -1}}.bytes(),
                    with(kSlices, "names: [bone], activation: sigmoid",
                         "names: [rest, femur, tibia], activation: "
                         "softmax"));
  const Volume volume = tube.volume();
  const Strings both{"femur", "tibia"}, one{"femur"};
  const auto voxels = [&](const Strings& bone) {
    const auto& values = fields_of(two, volume, tube.seeds(), {{"bone", bone}, {"probability", 0.45}})[0].values_mm;
    return std::count_if(values.begin(), values.end(), [](float value) { return value < 0; });
  };
  EXPECT_GT(voxels(both), voxels(one)) << "each of the two has less than half of the probability";
}

TEST(SegmentNetwork, GivesTheSameBytesAtAnyNumberOfThreads) {
  const bones::BrokenTube tube;
  const Volume volume = tube.volume();
  const Written network(soft_threshold(), with(kSlices, "pixel_px: 1", "pixel_mm: 0.6"));
  const auto at = [&](std::size_t threads) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    return fields_of(network, volume, tube.seeds())[0].values_mm;
  };
  EXPECT_TRUE(at(1) == at(4));
}

std::string refusal_of(const std::string& description, Options options = {}) {
  static const Inputs inputs = segmented::inputs(bones::BrokenTube().volume(), bones::BrokenTube().seeds());
  const Written network(soft_threshold(), description);
  options["network"] = network.file().string();
  std::string said = refusal(kNode, inputs, options);
  const std::string file = network.file().string();
  if (said.starts_with(file)) said.replace(0, file.size(), "FILE");
  return said;
}

TEST(SegmentNetwork, SaysWhatDoesNotFit) {
  EXPECT_EQ(refusal_of(with(kSlices, "values: hounsfield", "values: grey_values")),
            "FILE: the network wants values: grey_values, but segment.network can give only hounsfield");
  EXPECT_EQ(refusal_of(kSlices, {{"bone", Strings{"bones"}}}),
            "FILE: the network has no class 'bones'; did you mean 'bone'?");
  EXPECT_EQ(refusal_of(with(kSlices, "classes: {layer: maps, names: [bone],", "edge_strength: {layer: maps,")),
            "FILE: the network has no output 'classes'; it has edge_strength");
  EXPECT_EQ(
      refusal_of(with(kSlices, "bone: bright", "bone: dark")),
      "seeds of fragment 'proximal': the network sees no bone at any of them; its greatest probability there is "
      "0.00, at least 0.50 expected. Move a point into bone, lower probability, or use a network that was trained "
      "for such a CT");
}

}  // namespace marrow::test::network_test
