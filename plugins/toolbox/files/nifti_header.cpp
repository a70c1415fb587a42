// SPDX-License-Identifier: Apache-2.0
#include "nifti_header.hpp"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>

#include "byte_stream.hpp"
#include "marrow/base/error.hpp"

namespace marrow::files {
namespace {

constexpr std::size_t kFirstBytes = 348, kSecondBytes = 540;

/// The numbers of a header in its byte order.
class NiftiBytes {
 public:
  explicit NiftiBytes(const InputFile& file) {
    count_ = bytes_of_gzip_or_plain(file)->take(raw_.data(), raw_.size());
    const auto size = at<std::int32_t>(0);
    is_swapped_ = size != int(kFirstBytes) && size != int(kSecondBytes);
  }
  /// Whether it is a header of this size, with this text at this place.
  bool is(std::size_t size, std::size_t place, std::string_view magic) const {
    return count_ >= size && at<std::int32_t>(0) == int(size) &&
           std::memcmp(raw_.data() + place, magic.data(), magic.size()) == 0;
  }
  bool is_swapped() const { return is_swapped_; }

  template <class T>
  T at(std::size_t place) const {
    std::array<char, sizeof(T)> raw;
    std::memcpy(raw.data(), raw_.data() + place, sizeof(T));
    if (is_swapped_) std::reverse(raw.begin(), raw.end());
    return std::bit_cast<T>(raw);
  }
  /// Numbers that follow each other.
  template <class T, class Values>
  void fill(Values& values, std::size_t place) const {
    for (std::size_t k = 0; k < values.size(); ++k)
      values[k] = typename Values::value_type(at<T>(place + k * sizeof(T)));
  }

 private:
  std::array<char, kSecondBytes> raw_{};
  std::size_t count_ = 0;
  bool is_swapped_ = false;
};

void take_first_version(const NiftiBytes& bytes, NiftiHeader& header) {
  bytes.fill<std::int16_t>(header.dim, 40);
  header.type = bytes.at<std::int16_t>(70);
  header.bits = bytes.at<std::int16_t>(72);
  bytes.fill<float>(header.pixdim, 76);
  header.begin = bytes.at<float>(108);
  header.slope = bytes.at<float>(112);
  header.intercept = bytes.at<float>(116);
  header.unit = bytes.at<std::uint8_t>(123) & 7;
  header.qform_code = bytes.at<std::int16_t>(252);
  header.sform_code = bytes.at<std::int16_t>(254);
  bytes.fill<float>(header.quaternion, 256);
  bytes.fill<float>(header.offset, 268);
  for (std::size_t row = 0; row < 3; ++row) bytes.fill<float>(header.sform[row], 280 + 16 * row);
  header.least_begin = kFirstBytes + 4;
}

void take_second_version(const NiftiBytes& bytes, NiftiHeader& header) {
  header.type = bytes.at<std::int16_t>(12);
  header.bits = bytes.at<std::int16_t>(14);
  bytes.fill<std::int64_t>(header.dim, 16);
  bytes.fill<double>(header.pixdim, 104);
  header.begin = double(bytes.at<std::int64_t>(168));
  header.slope = bytes.at<double>(176);
  header.intercept = bytes.at<double>(184);
  header.qform_code = bytes.at<std::int32_t>(344);
  header.sform_code = bytes.at<std::int32_t>(348);
  bytes.fill<double>(header.quaternion, 352);
  bytes.fill<double>(header.offset, 376);
  for (std::size_t row = 0; row < 3; ++row) bytes.fill<double>(header.sform[row], 400 + 32 * row);
  header.unit = bytes.at<std::int32_t>(500) & 7;
  header.least_begin = kSecondBytes + 4;
}

}  // namespace

NiftiHeader read_nifti_header(const InputFile& file) {
  const NiftiBytes bytes(file);
  NiftiHeader header;
  header.what = file.path().string();
  header.is_swapped = bytes.is_swapped();
  using namespace std::string_view_literals;
  if (bytes.is(kFirstBytes, 344, "n+1\0"sv))
    take_first_version(bytes, header);
  else if (bytes.is(kSecondBytes, 4, "n+2\0\r\n\x1A\n"sv))
    take_second_version(bytes, header);
  else if (bytes.is(kFirstBytes, 344, "ni1\0"sv) || bytes.is(kSecondBytes, 4, "ni2\0"sv))
    throw Error(
        header.what +
        ": is not a NIfTI file with its samples in it: they are in an .img file beside this header; save both as "
        "one file (.nii)");
  else
    throw Error(header.what + ": is not a NIfTI file with its samples in it, or is damaged at its start");
  return header;
}

}  // namespace marrow::files
