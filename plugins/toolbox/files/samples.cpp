// SPDX-License-Identifier: Apache-2.0
#include "samples.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cstring>

#include "byte_stream.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/large_memory.hpp"
#include "marrow/base/number_text.hpp"

namespace marrow::files {
namespace {

static_assert(std::endian::native == std::endian::little, "samples are taken as they are where they are little-endian");

/// As floats these fit into 64 MB. So few samples are harmless at any compression ratio.
constexpr double kFewSamples = 1 << 24;

template <class T>
void convert(const std::byte* bytes, std::size_t count, bool swapped, float* values) {
  for (std::size_t i = 0; i < count; ++i) {
    std::array<std::byte, sizeof(T)> raw;
    std::memcpy(raw.data(), bytes + i * sizeof(T), sizeof(T));
    if (swapped) std::reverse(raw.begin(), raw.end());
    values[i] = float(std::bit_cast<T>(raw));
  }
}

template <class T>
void convert_either(const std::byte* bytes, std::size_t count, bool swapped, float* values) {
  swapped ? convert<T>(bytes, count, true, values) : convert<T>(bytes, count, false, values);
}

void convert(Samples::Type type, const std::byte* bytes, std::size_t count, bool swapped, float* values) {
  using Type = Samples::Type;
  switch (type) {
    case Type::u8:
      return convert_either<std::uint8_t>(bytes, count, false, values);
    case Type::i8:
      return convert_either<std::int8_t>(bytes, count, false, values);
    case Type::u16:
      return convert_either<std::uint16_t>(bytes, count, swapped, values);
    case Type::i16:
      return convert_either<std::int16_t>(bytes, count, swapped, values);
    case Type::u32:
      return convert_either<std::uint32_t>(bytes, count, swapped, values);
    case Type::i32:
      return convert_either<std::int32_t>(bytes, count, swapped, values);
    case Type::u64:
      return convert_either<std::uint64_t>(bytes, count, swapped, values);
    case Type::i64:
      return convert_either<std::int64_t>(bytes, count, swapped, values);
    case Type::f32:
      return convert_either<float>(bytes, count, swapped, values);
    case Type::f64:
      return convert_either<double>(bytes, count, swapped, values);
  }
}

void scale(float* values, std::size_t count, double slope, double intercept) {
  if (slope == 1 && intercept == 0) return;
  for (std::size_t i = 0; i < count; ++i) values[i] = float(double(values[i]) * slope + intercept);
}

void convert(const StoredSamples& stored, const std::byte* bytes, std::size_t count, float* values) {
  convert(stored.type, bytes, count, stored.big_endian, values);
  scale(values, count, stored.slope, stored.intercept);
}

constexpr std::size_t kPart = 1 << 17;  // number of samples that are converted at once

void read_plain(const InputFile& file, const StoredSamples& stored, std::vector<float>& values) {
  const std::size_t width = bytes_each(stored.type);
  const std::uint64_t held = file.size() - std::min(file.size(), stored.begin);
  if (held != stored.count * width)
    throw Error(formatted("{}: is {}{} bytes of samples expected, got {}; copy or export it again",
                          file.path().string(),
                          held < stored.count * width ? "cut off or damaged: "
                                                      : "damaged, or its header tells of other samples than it holds: ",
                          stored.count * width, held));
  resize_large(values, stored.count);
  tbb::parallel_for(std::size_t(0), (stored.count + kPart - 1) / kPart, [&](std::size_t part) {
    const std::size_t first = part * kPart, count = std::min(kPart, stored.count - first);
    std::vector<std::byte> bytes(count * width);
    file.read(stored.begin + first * width, bytes.data(), bytes.size());
    convert(stored, bytes.data(), count, values.data() + first);
  });
}

void read_packed(const InputFile& file, const StoredSamples& stored, std::vector<float>& values) {
  const std::size_t width = bytes_each(stored.type);
  const auto stream = unpacked_bytes(file, stored.begin, file.size());
  std::vector<std::byte> bytes(kPart * width);
  for (std::uint64_t left = stored.skip; left > 0;) {
    const std::size_t count = std::size_t(std::min<std::uint64_t>(left, bytes.size()));
    take_all(*stream, file, bytes.data(), count);
    left -= count;
  }
  // Memory grows with the data that are there, not with the size that the header claims.
  for (std::size_t first = 0; first < stored.count; first += kPart) {
    const std::size_t count = std::min(kPart, stored.count - first);
    take_all(*stream, file, bytes.data(), count * width);
    if (values.size() < first + count)
      values.resize(first + count < stored.count / 8 ? std::max(first + count, 2 * values.size()) : stored.count);
    convert(stored, bytes.data(), count, values.data() + first);
  }
  expect_end(*stream, file);  // also verifies the checksum
  if (const std::uint64_t behind = stream->bytes_behind(); behind > 0)
    throw Error(formatted(
        "{}: is damaged: {} bytes follow the end of its compressed samples, none expected; copy or export it again",
        file.path().string(), behind));
}

}  // namespace

std::size_t bytes_each(Samples::Type type) {
  static constexpr std::size_t kBytes[] = {1, 1, 2, 2, 4, 4, 8, 8, 4, 8};
  return kBytes[int(type)];
}

void check_size(const std::string& what, const std::array<long long, 3>& size, std::uint64_t stored_bytes,
                double most_samples_per_byte) {
  for (const long long length : size)
    if (length < 1 || length > 100000)
      throw Error(formatted("{}: its header gives a size of {}; expected 1 to 100000", what, length));
  const double samples = double(size[0]) * double(size[1]) * double(size[2]);
  if (samples > std::max(kFewSamples, most_samples_per_byte * double(stored_bytes)))
    throw Error(
        formatted("{}: its header claims {} x {} x {} samples, but the file has only {} bytes; it is cut off or its "
                  "header is wrong, unless nearly all samples are alike: then save it without compression",
                  what, size[0], size[1], size[2], stored_bytes));
}

std::vector<float> read_floats(const InputFile& file, const StoredSamples& stored) {
  std::vector<float> values;
  stored.is_packed ? read_packed(file, stored, values) : read_plain(file, stored, values);
  return values;
}

std::vector<float> to_float(const Samples& samples) {
  std::vector<float> values(samples.count());
  convert(samples.type, samples.bytes.data(), values.size(), false, values.data());
  scale(values.data(), values.size(), samples.slope, samples.intercept);
  return values;
}

}  // namespace marrow::files
