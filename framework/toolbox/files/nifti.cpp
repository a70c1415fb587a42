// SPDX-License-Identifier: Apache-2.0
// NIfTI-1 (.nii, .nii.gz): https://nifti.nimh.nih.gov/nifti-1. The NIfTI library returns zeros for samples that a file
// does not hold, and accepts a header that contradicts itself. So this file has its own reader.
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "byte_stream.hpp"
#include "marrow/domain/error.hpp"
#include "samples.hpp"

namespace marrow::files {
namespace {

constexpr std::size_t kHeaderBytes = 348;

class NiftiHeader {
 public:
  explicit NiftiHeader(const InputFile& file) : what_(file.path().string()) {
    const auto stream = bytes_of_gzip_or_plain(file);
    if (stream->take(raw_.data(), kHeaderBytes) != kHeaderBytes) no_nifti();
    swapped_ = at<std::int32_t>(0) != int(kHeaderBytes);
    if (at<std::int32_t>(0) != int(kHeaderBytes) || std::memcmp(raw_.data() + 344, "n+1", 4) != 0) no_nifti();
  }
  const std::string& what() const { return what_; }
  bool is_swapped() const { return swapped_; }
  template <class T>
  T at(std::size_t place) const {
    std::array<char, sizeof(T)> raw;
    std::memcpy(raw.data(), raw_.data() + place, sizeof(T));
    if (swapped_) std::reverse(raw.begin(), raw.end());
    return std::bit_cast<T>(raw);
  }
  int dim(int k) const { return at<std::int16_t>(40 + 2 * std::size_t(k)); }
  double pixdim(int k) const { return double(at<float>(76 + 4 * std::size_t(k))); }
  /// The header's unit of length in mm.
  double unit_mm() const {
    const int unit = at<std::uint8_t>(123) & 7;
    return unit == 1 ? 1e3 : unit == 3 ? 1e-3 : 1;
  }

 private:
  [[noreturn]] void no_nifti() const {
    throw Error(what_ + ": is not a NIfTI-1 file with its samples in it, or is damaged at its start");
  }
  std::string what_;
  std::array<char, kHeaderBytes> raw_{};
  bool swapped_ = false;
};

Samples::Type nifti_type(const NiftiHeader& header) {
  using Type = Samples::Type;
  struct Known {
    int code, bits;
    Type type;
  };
  static constexpr Known kKnown[] = {
      {2, 8, Type::u8},     {256, 8, Type::i8},    {4, 16, Type::i16},    {512, 16, Type::u16}, {8, 32, Type::i32},
      {768, 32, Type::u32}, {1024, 64, Type::i64}, {1280, 64, Type::u64}, {16, 32, Type::f32},  {64, 64, Type::f64}};
  const int code = header.at<std::int16_t>(70), bits = header.at<std::int16_t>(72);
  if (code == 128 || code == 2304)
    throw Error(header.what() + ": has " + std::to_string(code == 128 ? 3 : 4) + " values per voxel; a CT has one");
  for (const Known& known : kKnown) {
    if (known.code != code) continue;
    if (known.bits != bits)
      throw Error(header.what() + ": its header says that samples are of type " + std::to_string(code) +
                  ", which have " + std::to_string(known.bits) + " bits, and that they have " + std::to_string(bits) +
                  " bits; it is damaged: copy or export it again");
    return known.type;
  }
  throw Error(header.what() + ": its samples are of type " + std::to_string(code) +
              ", which is not read; save it as 16 bit integers or float");
}

std::array<long long, 3> size_of(const NiftiHeader& header) {
  const int dimensions = header.dim(0);
  if (dimensions < 1 || dimensions > 7)
    throw Error(header.what() + ": its header tells of " + std::to_string(dimensions) + " dimensions; it is damaged");
  for (int k = 4; k <= dimensions; ++k)
    if (header.dim(k) != 1)
      throw Error(header.what() + ": has " + std::to_string(dimensions) + " dimensions; expected one volume");
  std::array<long long, 3> size{1, 1, 1};
  for (int k = 0; k < std::min(3, dimensions); ++k) size[std::size_t(k)] = header.dim(k + 1);
  return size;
}

/// A matrix that maps indices to RAS: three columns with the axes times the voxel's size, then the position of the
/// first voxel.
using Affine = std::array<std::array<float, 4>, 3>;

bool is_finite(const Affine& affine) {
  for (const auto& row : affine)
    for (const float value : row)
      if (!std::isfinite(value)) return false;
  return true;
}

double dot(const Affine& affine, std::size_t a, std::size_t b) {
  double sum = 0;
  for (const auto& row : affine) sum += double(row[a]) * double(row[b]);
  return sum;
}

/// Whether all its values are finite and none of the three axes is zero.
bool has_lengths(const Affine& affine) {
  return is_finite(affine) && dot(affine, 0, 0) > 0 && dot(affine, 1, 1) > 0 && dot(affine, 2, 2) > 0;
}

/// Whether its axes are at right angles and none is zero.
bool is_straight(const Affine& affine) {
  if (!has_lengths(affine)) return false;
  for (const auto& [a, b] : {std::pair<std::size_t, std::size_t>{0, 1}, {0, 2}, {1, 2}})
    if (std::abs(dot(affine, a, b)) > kRoundedDirection * std::sqrt(dot(affine, a, a) * dot(affine, b, b)))
      return false;
  return true;
}

Affine sform(const NiftiHeader& header) {
  Affine affine;
  for (std::size_t row = 0; row < 3; ++row)
    for (std::size_t k = 0; k < 4; ++k) affine[row][k] = header.at<float>(280 + 16 * row + 4 * k);
  return affine;
}

/// The matrix from the quaternion, as defined in nifti1.h.
Affine qform(const NiftiHeader& header) {
  double b = header.at<float>(256), c = header.at<float>(260), d = header.at<float>(264),
         a = 1 - (b * b + c * c + d * d);
  if (a < 1e-7) {
    const double length = std::sqrt(b * b + c * c + d * d);
    b /= length, c /= length, d /= length, a = 0;
  } else {
    a = std::sqrt(a);
  }
  const double x = header.pixdim(1), y = header.pixdim(2),
               z = header.pixdim(0) < 0 ? -header.pixdim(3) : header.pixdim(3);
  const double m[3][3] = {{(a * a + b * b - c * c - d * d) * x, 2 * (b * c - a * d) * y, 2 * (b * d + a * c) * z},
                          {2 * (b * c + a * d) * x, (a * a + c * c - b * b - d * d) * y, 2 * (c * d - a * b) * z},
                          {2 * (b * d - a * c) * x, 2 * (c * d + a * b) * y, (a * a + d * d - c * c - b * b) * z}};
  Affine affine;
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t k = 0; k < 3; ++k) affine[row][k] = float(m[row][k]);
    affine[row][3] = header.at<float>(268 + 4 * row);
  }
  return affine;
}

/// Whether both put every voxel of the volume at the same position, up to rounding (0.02 mm per axis).
bool are_near(const Affine& one, const Affine& other, const NiftiHeader& header) {
  for (std::size_t row = 0; row < 3; ++row) {
    double apart = std::abs(double(one[row][3]) - double(other[row][3]));
    for (std::size_t k = 0; k < 3; ++k)
      apart += std::abs(double(one[row][k]) - double(other[row][k])) * std::max(0, header.dim(int(k) + 1) - 1);
    if (!(apart * header.unit_mm() < 0.02)) return false;  // also for NaN
  }
  return true;
}

[[noreturn]] void refuse_two_places(const NiftiHeader& header, const Affine& s, int scode, int qcode) {
  const std::string codes =
      "sform (code " + std::to_string(scode) + ") and its qform (code " + std::to_string(qcode) + ")";
  if (!is_straight(s))
    throw Error(
        header.what() + ": its " + codes +
        " do not agree: the sform is a matrix that is sheared (as of a CT with a tilted gantry) or damaged, which "
        "no qform can say; resample it to axes at right angles, or export it again");
  throw Error(header.what() + ": its " + codes +
              " put the same voxels to different places; set the code of the wrong one to 0, or export it again");
}

/// If both are given, they must agree, or the sform must be that of the scanner (code 1). An sform that maps to another
/// scan (code 2) is not used if the qform is that of the scanner.
Affine affine_of(const NiftiHeader& header) {
  const int qcode = header.at<std::int16_t>(252), scode = header.at<std::int16_t>(254);
  if (qcode <= 0 && scode <= 0)  // programs then assume different axes, and one of them mirrors the bone
    throw Error(header.what() +
                ": its header does not say which axis is left or right, front or back, up or down (qform_code and "
                "sform_code are 0); export it again with one of them, or as MHA");
  const Affine q = qform(header), s = sform(header);
  if (scode > 0 && is_straight(s) && (qcode <= 0 || scode == 1 || are_near(s, q, header))) return s;
  const bool is_of_other_scan = scode == 2 && qcode == 1 && has_lengths(s);
  if (qcode > 0 && is_straight(q) && (scode <= 0 || is_of_other_scan || are_near(s, q, header))) return q;
  if (qcode > 0 && scode > 0 && is_straight(q)) refuse_two_places(header, s, scode, qcode);
  throw Error(header.what() +
              ": its header does not say where it lies, or by a matrix that is sheared or damaged; resample or export "
              "it again");
}

void read_grid(const NiftiHeader& header, Samples& samples) {
  const double unit_mm = header.unit_mm();
  for (int k = 0; k < 3; ++k) {
    const double length = header.pixdim(k + 1);
    if (!std::isfinite(length) || !(length > 0))
      throw Error(header.what() + ": voxel spacing " + std::to_string(length) + " is not a positive length");
  }
  const Affine affine = affine_of(header);
  for (std::size_t k = 0; k < 3; ++k) {
    double squares = 0;
    for (const auto& row : affine) squares += double(row[k]) * double(row[k]);
    const double length = std::sqrt(squares), said = header.pixdim(int(k) + 1);
    if (std::abs(length - said) > 1e-3 * said)  // it is not known which of the two is right
      throw Error(header.what() + ": its header says twice how large a voxel is along axis " + std::to_string(k + 1) +
                  ": " + std::to_string(length * unit_mm) + " mm by its sform, " + std::to_string(said * unit_mm) +
                  " mm by its pixdim; set both to the right one, or export it again");
    samples.spacing_mm[k] = length * unit_mm;
    for (std::size_t row = 0; row < 3; ++row)
      samples.direction[row * 3 + k] = (row < 2 ? -1.0 : 1.0) * double(affine[row][k]) / length;
  }
  for (std::size_t row = 0; row < 3; ++row)
    samples.origin_mm[row] = (row < 2 ? -1.0 : 1.0) * double(affine[row][3]) * unit_mm;
}

void read_scaling(const NiftiHeader& header, StoredSamples& stored) {
  const double slope = header.at<float>(112), intercept = header.at<float>(116);
  if (slope == 0 || std::isnan(slope)) return;  // no scaling: 0 by nifti1.h, NaN by some programs
  if (!std::isfinite(slope) || !std::isfinite(intercept))
    throw Error(header.what() + ": its header scales samples by a number that is not finite; it is damaged");
  stored.slope = slope;
  stored.intercept = intercept;
}

}  // namespace

VolumeSamples read_nifti(const std::filesystem::path& path) {
  const InputFile file(path);
  const NiftiHeader header(file);
  const auto size = size_of(header);
  StoredSamples stored;
  stored.type = nifti_type(header);
  check_size(path.string(), size, file.size());
  VolumeSamples volume;
  volume.geometry.dimensions = std::min(3, header.dim(0));
  for (std::size_t k = 0; k < 3; ++k) volume.geometry.size[k] = int(size[k]);
  if (volume.geometry.dimensions < 3) return volume;  // one image; the caller refuses it
  read_grid(header, volume.geometry);
  read_scaling(header, stored);
  const double begin = header.at<float>(108);
  if (!(begin >= 352 && begin <= 1e9) || begin != std::floor(begin))
    throw Error(path.string() + ": its header says that samples begin at byte " + std::to_string(begin) +
                "; it is damaged");
  stored.count = volume.geometry.count();
  stored.big_endian = header.is_swapped();
  stored.is_packed = file.text(0, 2) == "\x1F\x8B";
  (stored.is_packed ? stored.skip : stored.begin) = std::uint64_t(begin);
  volume.values = read_floats(file, stored);
  return volume;
}

}  // namespace marrow::files
