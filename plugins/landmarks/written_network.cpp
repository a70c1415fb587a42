// SPDX-License-Identifier: Apache-2.0
// A network of one convolution of 1 x 1 pixels as an ONNX file. Field numbers are those of onnx.proto.
#include "written_network.hpp"

#include <cstdint>
#include <cstring>
#include <fstream>

namespace marrow::conformance {
namespace {

constexpr int kSide_px = 64;

std::string varint(std::uint64_t number) {
  std::string bytes;
  for (; number > 127; number >>= 7) bytes += char((number & 127) | 128);
  return bytes + char(number);
}
std::string whole(int field, std::uint64_t value) { return varint(std::uint64_t(field) << 3) + varint(value); }
std::string part(int field, const std::string& bytes) {
  return varint(std::uint64_t(field) << 3 | 2) + varint(bytes.size()) + bytes;
}

std::string tensor(const std::string& name, const std::vector<int>& sides, const std::vector<float>& values) {
  std::string bytes, raw(values.size() * sizeof(float), '\0');
  for (const int side : sides) bytes += whole(1, std::uint64_t(side));
  std::memcpy(raw.data(), values.data(), raw.size());
  return bytes + whole(2, 1) + part(8, name) + part(9, raw);
}

std::string shape(const std::string& name, int channels) {
  std::string dimensions;
  for (const int side : {1, channels, kSide_px, kSide_px}) dimensions += part(1, whole(1, std::uint64_t(side)));
  return part(1, name) + part(2, part(1, whole(1, 1) + part(2, dimensions)));
}

std::string model(int channels) {
  const std::string sides = part(1, "kernel_shape") + whole(8, 1) + whole(8, 1) + whole(20, 7);
  const std::string layer = part(1, "image") + part(1, "weights") + part(1, "bias") + part(2, "points") +
                            part(3, "layer") + part(4, "Conv") + part(5, sides);
  const std::string graph =
      part(1, layer) + part(2, "network") +
      part(5, tensor("weights", {channels, 1, 1, 1}, std::vector<float>(std::size_t(channels), 1))) +
      part(5, tensor("bias", {channels}, std::vector<float>(std::size_t(channels), 0))) + part(11, shape("image", 1)) +
      part(12, shape("points", channels));
  return whole(1, 6) + part(7, graph) + part(8, part(1, "") + whole(2, 11));
}

}  // namespace

std::filesystem::path written_network(const std::filesystem::path& folder, const std::vector<std::string>& names) {
  std::ofstream(folder / "network.onnx", std::ios::binary) << model(int(names.size()));
  const std::filesystem::path description = folder / "network.yaml";
  std::ofstream text(description);
  text << "marrow-network: 1\nname: bright\nhelp: for checks\nversion: 1.0.0\nlicence: Apache-2.0\n"
          "trained: {data: nothing, good_for: checks, not_for: anything else}\n"
          "input:\n  values: line_integrals\n  bone: bright\n  pixel_px: 2\n"
          "  normalise: {method: percentiles, low: 1, high: 99}\n"
       << "  size_px: [" << kSide_px << ", " << kSide_px << "]\n  overlap_px: 16\n"
       << "outputs:\n  heat_maps:\n    layer: points\n    names: [";
  for (std::size_t i = 0; i < names.size(); ++i) text << (i ? ", " : "") << names[i];
  text << "]\n    activation: none\n";
  return description;
}

}  // namespace marrow::conformance
