// SPDX-License-Identifier: Apache-2.0
#pragma once
// A network of one convolution in a folder of its own, with its description.
#include <cstdint>
#include <cstring>
#include <fstream>
#include <vector>

#include "marrow/base/temporary_folder.hpp"

namespace marrow::test {

inline const std::string kPlain = R"(marrow-network: 1
name: plain
help: a network of one convolution
version: 1.0.0
licence: Apache-2.0
trained: {data: nothing, good_for: tests, not_for: anything else}
input:
  values: grey_values
  bone: bright
  pixel_px: 1
  normalise: {method: fixed, low: 0, high: 1}
  size_px: [32, 32]
  overlap_px: 8
outputs:
  edge_strength: {layer: maps, activation: none}
)";

/// The text with another one in the place of `from`, which must be there.
inline std::string with(std::string text, const std::string& from, const std::string& to) {
  return text.replace(text.find(from), from.size(), to);
}

class Written {
 public:
  Written(const std::string& model, const std::string& description = kPlain) {
    std::ofstream(file()) << description;
    std::ofstream(folder_.path() / "plain.onnx", std::ios::binary) << model;
  }
  std::filesystem::path file() const { return folder_.path() / "plain.yaml"; }

 private:
  TemporaryFolder folder_{new_temporary_folder("network")};
};

// Writes a network of one convolution as an ONNX file, without a library for it. Field numbers are those of onnx.proto.

namespace onnx_bytes {

inline std::string varint(std::uint64_t number) {
  std::string bytes;
  for (; number > 127; number >>= 7) bytes += char((number & 127) | 128);
  return bytes + char(number);
}
inline std::string whole(int field, std::uint64_t value) { return varint(std::uint64_t(field) << 3) + varint(value); }
inline std::string part(int field, const std::string& bytes) {
  return varint(std::uint64_t(field) << 3 | 2) + varint(bytes.size()) + bytes;
}
inline std::string tensor(const std::string& name, const std::vector<int>& sides, const std::vector<float>& values) {
  std::string bytes;
  for (const int side : sides) bytes += whole(1, std::uint64_t(side));
  std::string raw(values.size() * sizeof(float), '\0');
  std::memcpy(raw.data(), values.data(), raw.size());
  return bytes + whole(2, 1) + part(8, name) + part(9, raw);
}
inline std::string numbers(const std::string& name, const std::vector<int>& values) {
  std::string bytes = part(1, name);
  for (const int value : values) bytes += whole(8, std::uint64_t(value));
  return part(5, bytes + whole(20, 7));
}
inline std::string shape(const std::string& name, const std::vector<int>& sides) {
  std::string dimensions;
  for (const int side : sides) dimensions += part(1, whole(1, std::uint64_t(side)));
  return part(1, name) + part(2, part(1, whole(1, 1) + part(2, dimensions)));
}

}  // namespace onnx_bytes

/// The input "image" of 1 x channels x rows x columns, and the output "maps": its convolution with square kernels of
/// `side` (weights by output channel, input channel, row, column), at every stride-th pixel. An odd side keeps the
/// size.
struct Convolution {
  int rows = 32, columns = 32, channels = 1, side = 3, stride = 1;
  std::vector<float> weights, bias;
  std::string type = "Conv";

  std::string bytes() const {
    using namespace onnx_bytes;
    const int outs = int(bias.size()), pad = stride > 1 ? 0 : side / 2;
    std::string node = part(1, "image") + part(1, "w") + part(1, "b") + part(2, "maps") + part(3, "first_layer");
    node += part(4, type) + numbers("kernel_shape", {side, side}) + numbers("pads", {pad, pad, pad, pad}) +
            numbers("strides", {stride, stride});
    const std::string graph =
        part(1, node) + part(2, "network") + part(5, tensor("w", {outs, channels, side, side}, weights)) +
        part(5, tensor("b", {outs}, bias)) + part(11, shape("image", {1, channels, rows, columns})) +
        part(12, shape("maps", {1, outs, rows / stride, columns / stride}));
    return whole(1, 6) + part(7, graph) + part(8, part(1, "") + whole(2, 11));
  }
};

}  // namespace marrow::test
