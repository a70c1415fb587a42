// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/network/description.hpp"
#include "harness/message_of.hpp"
#include "harness/node_test.hpp"
#include "written.hpp"

namespace marrow::test::description_test {

using network::Output, network::read_description;

std::string fault_of(const std::string& text) {
  const Written written("", text);
  return message_of([&] { read_description(written.file()); });
}

TEST(NetworkDescription, IsRead) {
  const std::string outputs = R"(outputs:
  classes: {layer: kinds, names: [background, bone, metal], activation: softmax}
  heat_maps: {layer: points, names: [a, b], activation: sigmoid, stride_px: 4, deviation_factor: 1.5}
)";
  std::string text = kPlain.substr(0, kPlain.find("outputs:")) + outputs;
  text = with(with(text, "pixel_px: 1", "pixel_mm: 0.8"), "[32, 32]", "[64, 96]");
  const Written written("", with(text, "bone: bright", "bone: dark"));
  const network::Description read = read_description(written.file());
  EXPECT_EQ(read.model.filename(), "plain.onnx");
  EXPECT_EQ(read.good_for, "tests");
  EXPECT_EQ(read.input.size_px, cv::Size(96, 64)) << "rows come first in the file";
  EXPECT_EQ(read.input.pixel_mm, 0.8);
  EXPECT_FALSE(read.input.bone_is_bright);
  ASSERT_EQ(read.outputs.size(), 2u);
  EXPECT_EQ(read.outputs[0].channels(), 3);
  const Output& maps = network::output_of(read, Output::Kind::heat_maps);
  EXPECT_EQ(maps.names, (Strings{"a", "b"}));
  EXPECT_EQ(maps.stride_px, 4);
  EXPECT_EQ(maps.deviation_factor, 1.5);
  EXPECT_NE(message_of([&] {
              network::output_of(read, Output::Kind::edge_strength);
            }).find("the network has no output 'edge_strength'; it has classes, heat_maps"),
            std::string::npos);
  EXPECT_NE(message_of([&] {
              network::expect_values(read, {network::Values::hounsfield}, "segment.network");
            }).find("wants values: grey_values, but segment.network can give only hounsfield"),
            std::string::npos);
}

struct Fault {
  const char *from, *to, *says;
};
class NetworkDescriptionFaults : public testing::TestWithParam<Fault> {};

TEST_P(NetworkDescriptionFaults, AreSaid) {
  const std::string said = fault_of(with(kPlain, GetParam().from, GetParam().to));
  EXPECT_NE(said.find(GetParam().says), std::string::npos) << said;
}

INSTANTIATE_TEST_SUITE_P(
    Each, NetworkDescriptionFaults,
    testing::Values(
        Fault{"marrow-network: 1", "marrow-network: 2", "marrow-network"},
        Fault{"licence:", "license:", "did you mean 'licence'?"},
        Fault{"values: grey_values", "values: grey", "expected line_integrals, grey_values, hounsfield; got 'grey'"},
        Fault{"bone: bright", "bone: white", "expected bright, dark; got 'white'"},
        Fault{"pixel_px: 1", "pixel_px: 1\n  pixel_mm: 1",
              "expected one of pixel_mm (its size at the bone) and "
              "pixel_px (in pixels of the image), got both"},
        Fault{"pixel_px: 1", "pixel_px: 0", "pixel_px: expected 0.1 to 100, got 0"},
        Fault{"low: 0, high: 1", "low: 2, high: 1", "high: expected more than low, 2, got 1"},
        Fault{"method: fixed", "method: deviation", "the method 'deviation' takes no numbers"},
        Fault{"[32, 32]", "[32, 32.5]", "expected whole numbers of rows and columns, 8 to 4096, got 32.5"},
        Fault{"overlap_px: 8", "overlap_px: 17", "expected at most half the tile's shorter side, 16, got 17"},
        Fault{"overlap_px: 8", "overlap_px: 8\n  slices: 2", "expected an odd number, so that one is in the middle"},
        Fault{"overlap_px: 8", "overlap_px: 8\n  slices: 3", "only a CT has slices"},
        Fault{"activation: none", "activation: softmax", "only classes exclude each other"},
        Fault{"activation: none", "activation: none, stride_px: 3",
              "must be multiples of the stride of 'edge_strength', 3"},
        Fault{"activation: none", "activation: none, names: [a]", "names"},
        Fault{"edge_strength: {layer: maps, activation: none}", "{}",
              "expected classes, edge_strength, heat_maps; got none"},
        Fault{"edge_strength: {layer: maps,", "classes: {layer: maps, names: [a, a],", "one occurs twice"},
        Fault{"edge_strength: {layer: maps,", "classes: {layer: maps,",
              "expected the names of its channels, got none"}));

}  // namespace marrow::test::description_test
