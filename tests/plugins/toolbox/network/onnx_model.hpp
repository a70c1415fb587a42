// SPDX-License-Identifier: Apache-2.0
#pragma once
// Writes a network of one convolution as an ONNX file, without a library for it. Field numbers are those of onnx.proto.
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

namespace marrow::test {

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
