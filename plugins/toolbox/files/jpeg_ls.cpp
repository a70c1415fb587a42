// SPDX-License-Identifier: Apache-2.0
// Lossless JPEG-LS (ITU T.87) with one component. Names are those of the standard, annex A. As strict as
// jpeg_lossless.cpp.
#include <algorithm>
#include <array>
#include <cstdlib>

#include "jpeg_stream.hpp"

namespace marrow::files {
namespace {

constexpr std::array<int, 32> kRunBits{0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2,  2,  3,  3,  3,  3,
                                       4, 4, 5, 5, 6, 6, 7, 7, 8, 9, 10, 11, 12, 13, 14, 15};

struct Context {
  int a = 0, b = 0, c = 0, n = 1;
};
struct RunContext {
  int a = 0, n = 1, negative = 0;
};

class JpegLsDecoder {
 public:
  explicit JpegLsDecoder(const CodedImage& image) : image_(image) {}

  std::vector<std::byte> run() {
    JpegSegments segments(image_.bytes);
    for (int marker = segments.next(); marker != 0xDA; marker = segments.next()) {
      if (marker == 0xF7)
        precision_ = frame_precision(segments, image_);
      else if (marker == 0xF8)
        read_parameters(segments);
      else if (marker >= 0xC0 && marker <= 0xCF)
        throw CodecNotRead("its pixels are compressed by another kind of JPEG than the header says");
      else if (marker == 0xDD && segments.word(0) != 0)
        throw CodecNotRead("its compressed pixels restart within the image, which is not read");
    }
    if (precision_ == 0) throw CodecError("the compressed pixels have no frame header");
    if (segments.byte(0) == 1 && segments.byte(3) != 0)
      throw CodecNotRead("its pixels are compressed with loss by JPEG-LS, which is not read");
    if (segments.byte(0) != 1 || segments.byte(2) != 0 || segments.byte(3) != 0 || segments.byte(4) != 0 ||
        segments.byte(5) != 0)
      throw CodecError("the scan header of the compressed pixels is damaged");
    prepare();
    return image_.bits_allocated == 8 ? samples<std::uint8_t>(segments.rest())
                                      : samples<std::uint16_t>(segments.rest());
  }

 private:
  void read_parameters(const JpegSegments& segments) {
    if (segments.byte(0) != 1) throw CodecNotRead("its compressed pixels go through a table, which is not read");
    max_value_ = segments.word(1);
    for (std::size_t k = 0; k < 3; ++k) thresholds_[k] = segments.word(3 + 2 * k);
    reset_ = segments.word(9);
  }

  void prepare() {
    if (max_value_ == 0) max_value_ = (1 << precision_) - 1;
    if (reset_ == 0) reset_ = 64;
    const auto clamped = [&](int value, int least) { return value > max_value_ || value < least ? least : value; };
    const int factor = max_value_ >= 128 ? (std::min(max_value_, 4095) + 128) / 256 : 256 / (max_value_ + 1);
    const int basic[3] = {3, 7, 21};
    for (int k = 0, least = 1; k < 3; ++k) {
      int& threshold = thresholds_[std::size_t(k)];
      if (threshold == 0)
        threshold = clamped(
            max_value_ >= 128 ? factor * (basic[k] - k - 2) + k + 2 : std::max(k + 2, basic[k] / factor), least);
      if (threshold < least || threshold > max_value_)
        throw CodecError("the parameters of the compressed pixels are damaged");
      least = threshold;
    }
    if (max_value_ >= 1 << precision_ || reset_ < 3 || reset_ > std::max(255, max_value_))
      throw CodecError("the parameters of the compressed pixels are damaged");
    while (1 << value_bits_ < max_value_ + 1) ++value_bits_;
    const int bits = std::max(2, value_bits_);
    limit_ = 2 * (bits + std::max(8, bits));
    const int start = std::max(2, (max_value_ + 1 + 32) / 64);
    for (Context& context : contexts_) context.a = start;
    for (RunContext& context : run_contexts_) context.a = start;
  }

  int golomb(JpegBits<1>& bits, int k, int limit) const {
    int zeros = 0;
    while (true) {
      const unsigned next = bits.peek16();
      if (next != 0) {
        const int more = __builtin_clz(next) - 16;
        bits.skip(more + 1);
        zeros += more;
        break;
      }
      bits.skip(16);
      zeros += 16;
      if (zeros > limit) break;
    }
    if (zeros > limit - value_bits_ - 1) throw CodecError("the compressed pixels hold an unknown code");
    const int value =
        zeros < limit - value_bits_ - 1 ? zeros << k | int(bits.take(k)) : int(bits.take(value_bits_)) + 1;
    if (value > 2 * (max_value_ + 1)) throw CodecError("the compressed pixels hold a value beyond their range");
    return value;
  }

  int step(int difference) const {
    const int size = std::abs(difference);
    const int level = size == 0               ? 0
                      : size < thresholds_[0] ? 1
                      : size < thresholds_[1] ? 2
                      : size < thresholds_[2] ? 3
                                              : 4;
    return difference < 0 ? -level : level;
  }

  /// The sample for a prediction and its error. The sum wraps around.
  int sample(int predicted, int error) const {
    int value = predicted + error;
    if (value < 0) value += max_value_ + 1;
    if (value > max_value_) value -= max_value_ + 1;
    if (value < 0 || value > max_value_) throw CodecError("the compressed pixels hold a value beyond their range");
    return value;
  }

  int regular(JpegBits<1>& bits, int left, int above, int corner, int q) {
    const int sign = q < 0 ? -1 : 1;
    Context& context = contexts_[std::size_t(std::abs(q))];
    int predicted = corner >= std::max(left, above)   ? std::min(left, above)
                    : corner <= std::min(left, above) ? std::max(left, above)
                                                      : left + above - corner;
    predicted = std::clamp(predicted + sign * context.c, 0, max_value_);
    int k = 0;
    while (context.n << k < context.a && k < 16) ++k;
    const int mapped = golomb(bits, k, limit_);
    const bool is_turned = k == 0 && 2 * context.b <= -context.n;
    const int error =
        is_turned ? (mapped % 2 ? (mapped - 1) / 2 : -mapped / 2 - 1) : (mapped % 2 ? -(mapped + 1) / 2 : mapped / 2);
    update(context, error);
    return sample(predicted, sign * error);
  }

  void update(Context& context, int error) const {
    context.b += error;
    context.a += std::abs(error);
    if (context.n == reset_) {
      context.a >>= 1;
      context.b = context.b >= 0 ? context.b >> 1 : -((1 - context.b) >> 1);
      context.n >>= 1;
    }
    ++context.n;
    if (context.b <= -context.n) {
      context.b = std::max(context.b + context.n, 1 - context.n);
      context.c = std::max(context.c - 1, -128);
    } else if (context.b > 0) {
      context.b = std::min(context.b - context.n, 0);
      context.c = std::min(context.c + 1, 127);
    }
  }

  /// Number of samples that equal the one on the left, at most `most`.
  std::size_t run_length(JpegBits<1>& bits, std::size_t most) {
    std::size_t length = 0;
    while (bits.take(1)) {
      const std::size_t whole = std::size_t(1) << kRunBits[std::size_t(run_index_)],
                        count = std::min(whole, most - length);
      length += count;
      if (count == whole) run_index_ = std::min(31, run_index_ + 1);
      if (length == most) return length;
    }
    length += bits.take(kRunBits[std::size_t(run_index_)]);
    if (length >= most) throw CodecError("a run of the compressed pixels is too long");
    return length;
  }

  int interruption(JpegBits<1>& bits, int left, int above) {
    const bool are_equal = left == above;
    RunContext& context = run_contexts_[are_equal ? 1 : 0];
    const int size = context.a + (are_equal ? context.n >> 1 : 0);
    int k = 0;
    while (context.n << k < size && k < 16) ++k;
    const int mapped = golomb(bits, k, limit_ - kRunBits[std::size_t(run_index_)] - 1),
              shifted = mapped + int(are_equal);
    const bool is_odd = shifted % 2;
    const int absolute = (shifted + is_odd) / 2;
    const int error = (k != 0 || 2 * context.negative >= context.n) == is_odd ? -absolute : absolute;
    context.negative += error < 0;
    context.a += (mapped + 1 - int(are_equal)) >> 1;
    if (context.n == reset_) {
      context.a >>= 1;
      context.n >>= 1;
      context.negative >>= 1;
    }
    ++context.n;
    run_index_ = std::max(0, run_index_ - 1);
    return are_equal ? sample(left, error) : sample(above, above > left ? error : -error);
  }

  /// Rows have one more sample on both sides, for positions outside the image.
  void decode_row(JpegBits<1>& bits, const std::vector<int>& above, std::vector<int>& row) {
    const std::size_t columns = std::size_t(image_.columns);
    for (std::size_t at = 1; at <= columns;) {
      const int left = row[at - 1], corner = above[at - 1], up = above[at], right = above[at + 1];
      const int q = 81 * step(right - up) + 9 * step(up - corner) + step(corner - left);
      if (q != 0) {
        row[at++] = regular(bits, left, up, corner, q);
        continue;
      }
      const std::size_t length = run_length(bits, columns + 1 - at);
      std::fill_n(row.begin() + std::ptrdiff_t(at), length, left);
      at += length;
      if (at > columns) break;
      row[at] = interruption(bits, left, above[at]);
      ++at;
    }
  }

  template <class T>
  std::vector<std::byte> samples(std::string_view coded) {
    const std::size_t columns = std::size_t(image_.columns), rows = std::size_t(image_.rows);
    std::vector<std::byte> bytes(columns * rows * sizeof(T));
    T* to = reinterpret_cast<T*>(bytes.data());
    std::vector<int> above(columns + 2), row(columns + 2);
    JpegBits<1> bits(coded);
    for (std::size_t v = 0; v < rows; ++v, to += columns, std::swap(above, row)) {
      above[columns + 1] = above[columns];
      row[0] = above[1];
      decode_row(bits, above, row);
      std::transform(row.begin() + 1, row.end() - 1, to, [](int value) { return T(value); });
    }
    if (bits.marker() != 0xD9) throw CodecError("the compressed pixels have no end");
    return bytes;
  }

  const CodedImage& image_;
  int precision_ = 0, max_value_ = 0, reset_ = 0, value_bits_ = 0, limit_ = 0, run_index_ = 0;
  std::array<int, 3> thresholds_{};
  std::array<Context, 365> contexts_;
  std::array<RunContext, 2> run_contexts_;
};

}  // namespace

std::vector<std::byte> decode_jpeg_ls(const CodedImage& image) { return JpegLsDecoder(image).run(); }

}  // namespace marrow::files
