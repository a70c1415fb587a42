// SPDX-License-Identifier: Apache-2.0
// The NIfTI library hands on zeros for samples that a file does not hold. So it is made sure here that all of them are
// there.
#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <memory>

#include "marrow/domain/error.hpp"
#include "samples.hpp"

namespace marrow::read {
namespace {

constexpr int kHeaderBytes = 348;  // of NIfTI-1

template <class T>
T number_at(const std::array<char, kHeaderBytes>& header, int at, bool swapped) {
  std::array<char, sizeof(T)> raw;
  std::memcpy(raw.data(), header.data() + at, sizeof(T));
  if (swapped) std::reverse(raw.begin(), raw.end());
  return std::bit_cast<T>(raw);
}

/// Where the samples end, by the header: dim[8] at byte 40, bitpix at 72, vox_offset at 108. 0 where the header is
/// none.
double claimed_end(const std::array<char, kHeaderBytes>& header) {
  const bool swapped = number_at<std::int32_t>(header, 0, false) != kHeaderBytes;
  if (swapped && number_at<std::int32_t>(header, 0, true) != kHeaderBytes) return 0;
  double bytes = number_at<std::int16_t>(header, 72, swapped) / 8.0;
  const int dimensions = number_at<std::int16_t>(header, 40, swapped);
  for (int k = 1; k <= dimensions && k < 8; ++k) bytes *= number_at<std::int16_t>(header, 40 + 2 * k, swapped);
  return bytes + double(number_at<float>(header, 108, swapped));
}

}  // namespace

void check_nifti_data(const std::filesystem::path& path) {
  // gzread takes a file that is not packed as it is.
  const std::unique_ptr<gzFile_s, int (*)(gzFile)> file(gzopen(path.c_str(), "rb"), gzclose);
  if (!file) throw Error(path.string() + ": cannot be read");
  std::array<char, kHeaderBytes> header{};
  if (gzread(file.get(), header.data(), kHeaderBytes) != kHeaderBytes || claimed_end(header) <= 0)
    throw Error(path.string() + ": is not a NIfTI-1 file, or is damaged at its start");
  const double expected = claimed_end(header);
  double got = kHeaderBytes;
  std::array<char, 1 << 16> part;
  for (int count = 1; count > 0 && got < expected; got += std::max(count, 0))
    count = gzread(file.get(), part.data(), unsigned(part.size()));
  if (!(got >= expected))
    throw Error(path.string() + ": is cut off or damaged: " + std::to_string(std::uintmax_t(expected)) +
                " bytes expected, got " + std::to_string(std::uintmax_t(got)));
}

}  // namespace marrow::read
