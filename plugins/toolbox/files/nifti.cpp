// SPDX-License-Identifier: Apache-2.0
// The NIfTI library returns zeros for samples that a file does not hold, and
// accepts a header that contradicts itself. So this file has its own reader.
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "nifti.hpp"
#include "samples.hpp"

namespace marrow::files {
namespace {

/// How much more than 1 the squared length of a quaternion's part may be, because its numbers are rounded. What is
/// longer is no rotation.
constexpr double kRoundedQuaternion = 1e-5;

Samples::Type nifti_type(const NiftiHeader& header) {
  using Type = Samples::Type;
  struct Known {
    int code, bits;
    Type type;
  };
  static constexpr Known kKnown[] = {
      {2, 8, Type::u8},     {256, 8, Type::i8},    {4, 16, Type::i16},    {512, 16, Type::u16}, {8, 32, Type::i32},
      {768, 32, Type::u32}, {1024, 64, Type::i64}, {1280, 64, Type::u64}, {16, 32, Type::f32},  {64, 64, Type::f64}};
  const int code = header.type, bits = header.bits;
  if (code == 128 || code == 2304)
    throw Error(formatted("{}: has {} values per voxel; a CT has one", header.what, code == 128 ? 3 : 4));
  for (const Known& known : kKnown) {
    if (known.code != code) continue;
    if (known.bits != bits)
      throw Error(
          formatted("{}: its header says that samples are of type {}, which have {} bits, and that they have {} bits; "
                    "it is damaged: copy or export it again",
                    header.what, code, known.bits, bits));
    return known.type;
  }
  throw Error(formatted("{}: its samples are of type {}, which is not read; save it as 16 bit integers or float",
                        header.what, code));
}

std::array<long long, 3> size_of(const NiftiHeader& header) {
  const long long dimensions = header.dim[0];
  if (dimensions < 1 || dimensions > 7)
    throw Error(formatted("{}: its header tells of {} dimensions; it is damaged", header.what, dimensions));
  for (std::size_t k = 4; k <= std::size_t(dimensions); ++k)
    if (header.dim[k] != 1)
      throw Error(formatted("{}: has {} dimensions; expected one volume", header.what, dimensions));
  std::array<long long, 3> size{1, 1, 1};
  for (std::size_t k = 0; k < std::min<std::size_t>(3, std::size_t(dimensions)); ++k) size[k] = header.dim[k + 1];
  return size;
}

bool is_finite(const NiftiAffine& affine) {
  for (const auto& row : affine)
    for (const double value : row)
      if (!std::isfinite(value)) return false;
  return true;
}

double dot(const NiftiAffine& affine, std::size_t a, std::size_t b) {
  double sum = 0;
  for (const auto& row : affine) sum += row[a] * row[b];
  return sum;
}

/// Whether all its values are finite and none of the three axes is zero.
bool has_lengths(const NiftiAffine& affine) {
  return is_finite(affine) && dot(affine, 0, 0) > 0 && dot(affine, 1, 1) > 0 && dot(affine, 2, 2) > 0;
}

/// Whether its axes are at right angles and none is zero.
bool is_straight(const NiftiAffine& affine) {
  if (!has_lengths(affine)) return false;
  for (const auto& [a, b] : {std::pair<std::size_t, std::size_t>{0, 1}, {0, 2}, {1, 2}})
    if (std::abs(dot(affine, a, b)) > kRoundedDirection * std::sqrt(dot(affine, a, a) * dot(affine, b, b)))
      return false;
  return true;
}

/// The matrix from the quaternion, as defined in nifti1.h. Throws Error if it is no rotation.
NiftiAffine qform(const NiftiHeader& header) {
  auto [b, c, d] = header.quaternion;
  const double squared = b * b + c * c + d * d;
  if (squared > 1 + kRoundedQuaternion)
    throw Error(formatted(
        "{}: the quaternion (b, c, d) of its qform has the length {:.6g}, but that of a rotation is at most 1; it is "
        "damaged, or was written wrongly: export it again, or set qform_code to 0 if its sform is right",
        header.what, std::sqrt(squared)));
  double a = 1 - squared;
  if (a < 1e-7) {
    const double length = std::sqrt(squared);
    b /= length, c /= length, d /= length, a = 0;
  } else {
    a = std::sqrt(a);
  }
  const double x = header.pixdim[1], y = header.pixdim[2],
               z = header.pixdim[0] < 0 ? -header.pixdim[3] : header.pixdim[3];
  const auto& [along_x, along_y, along_z] = header.offset;
  return {{{(a * a + b * b - c * c - d * d) * x, 2 * (b * c - a * d) * y, 2 * (b * d + a * c) * z, along_x},
           {2 * (b * c + a * d) * x, (a * a + c * c - b * b - d * d) * y, 2 * (c * d - a * b) * z, along_y},
           {2 * (b * d - a * c) * x, 2 * (c * d + a * b) * y, (a * a + d * d - c * c - b * b) * z, along_z}}};
}

/// Whether both put every voxel of the volume at the same position, up to rounding (0.02 mm per axis).
bool are_near(const NiftiAffine& one, const NiftiAffine& other, const NiftiHeader& header) {
  for (std::size_t row = 0; row < 3; ++row) {
    double apart = std::abs(one[row][3] - other[row][3]);
    for (std::size_t k = 0; k < 3; ++k)
      apart += std::abs(one[row][k] - other[row][k]) * double(std::max(0ll, header.dim[k + 1] - 1));
    if (!(apart * header.unit_mm() < 0.02)) return false;  // also for NaN
  }
  return true;
}

[[noreturn]] void refuse_two_places(const NiftiHeader& header, const NiftiAffine& s, int scode, int qcode) {
  const std::string codes = formatted("sform (code {}) and its qform (code {})", scode, qcode);
  if (!is_straight(s))
    throw Error(
        header.what + ": its " + codes +
        " do not agree: the sform is a matrix that is sheared (as of a CT with a tilted gantry) or damaged, which "
        "no qform can say; resample it to axes at right angles, or export it again");
  throw Error(header.what + ": its " + codes +
              " put the same voxels to different places; set the code of the wrong one to 0, or export it again");
}

/// If both are given, they must agree, or the sform must be that of the scanner (code 1). An sform that maps to another
/// scan (code 2) is not used if the qform is that of the scanner.
NiftiAffine affine_of(const NiftiHeader& header) {
  const int qcode = header.qform_code, scode = header.sform_code;
  if (qcode <= 0 && scode <= 0)  // programs then assume different axes, and one of them mirrors the bone
    throw Error(header.what +
                ": its header does not say which axis is left or right, front or back, up or down (qform_code and "
                "sform_code are 0); export it again with one of them, or as MHA");
  const NiftiAffine& s = header.sform;
  if (scode > 0 && is_straight(s) && (qcode <= 0 || scode == 1)) return s;
  const NiftiAffine q = qcode > 0 ? qform(header) : NiftiAffine{};
  if (scode > 0 && is_straight(s) && are_near(s, q, header)) return s;
  const bool is_of_other_scan = scode == 2 && qcode == 1 && has_lengths(s);
  if (qcode > 0 && is_straight(q) && (scode <= 0 || is_of_other_scan || are_near(s, q, header))) return q;
  if (qcode > 0 && scode > 0 && is_straight(q)) refuse_two_places(header, s, scode, qcode);
  throw Error(header.what +
              ": its header does not say where it lies, or by a matrix that is sheared or damaged; resample or export "
              "it again");
}

void read_grid(const NiftiHeader& header, Samples& samples) {
  const double unit_mm = header.unit_mm();
  for (std::size_t k = 1; k <= 3; ++k)
    if (const double length = header.pixdim[k]; !std::isfinite(length) || !(length > 0))
      throw Error(formatted("{}: voxel spacing {:f} is not a positive length", header.what, length));
  const NiftiAffine affine = affine_of(header);
  for (std::size_t k = 0; k < 3; ++k) {
    const double length = std::sqrt(dot(affine, k, k)), said = header.pixdim[k + 1];
    if (std::abs(length - said) > 1e-3 * said)  // it is not known which of the two is right
      throw Error(
          formatted("{}: its header says twice how large a voxel is along axis {}: {:f} mm by its sform, {:f} mm by "
                    "its pixdim; set both to the right one, or export it again",
                    header.what, k + 1, length * unit_mm, said * unit_mm));
    samples.spacing_mm[k] = length * unit_mm;
    for (std::size_t row = 0; row < 3; ++row)
      samples.direction[row * 3 + k] = (row < 2 ? -1.0 : 1.0) * affine[row][k] / length;
  }
  for (std::size_t row = 0; row < 3; ++row) samples.origin_mm[row] = (row < 2 ? -1.0 : 1.0) * affine[row][3] * unit_mm;
}

void read_scaling(const NiftiHeader& header, StoredSamples& stored) {
  if (header.slope == 0 || std::isnan(header.slope)) return;  // no scaling: 0 by nifti1.h, NaN by some programs
  if (!std::isfinite(header.slope) || !std::isfinite(header.intercept))
    throw Error(header.what + ": its header scales samples by a number that is not finite; it is damaged");
  stored.slope = header.slope;
  stored.intercept = header.intercept;
}

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

VolumeSamples read_nifti(const std::filesystem::path& path, bool is_placed) {
  const InputFile file(path);
  const NiftiHeader header = read_nifti_header(file);
  const auto size = size_of(header);
  StoredSamples stored;
  stored.type = nifti_type(header);
  check_size(path.string(), size, file.size());
  VolumeSamples volume;
  volume.geometry.dimensions = int(std::min(3ll, header.dim[0]));
  for (std::size_t k = 0; k < 3; ++k) volume.geometry.size[k] = int(size[k]);
  if (volume.geometry.dimensions < 3 && is_placed) return volume;  // one image; the caller refuses it
  if (is_placed) read_grid(header, volume.geometry);
  read_scaling(header, stored);
  volume.geometry.type = stored.type_of_values();
  const double begin = header.begin;
  if (!(begin >= header.least_begin && begin <= 1e9) || begin != std::floor(begin))
    throw Error(formatted("{}: its header says that samples begin at byte {:f}; it is damaged", path.string(), begin));
  stored.count = volume.geometry.count();
  stored.big_endian = header.is_swapped;
  stored.is_packed = file.text(0, 2) == "\x1F\x8B";
  (stored.is_packed ? stored.skip : stored.begin) = std::uint64_t(begin);
  volume.values = read_floats(file, stored);
  return volume;
}

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
