// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <tuple>

#include "dicom_folder.hpp"
#include "dicom_pixels.hpp"
#include "header_lines.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/large_memory.hpp"
#include "marrow/base/number_text.hpp"

namespace marrow::files {
namespace {

using Vector = std::array<double, 3>;

// The largest distance of a slice from its place in an even, straight grid. Positions that are rounded to one decimal
// may be this far off.
constexpr double kFarthestOff_mm = 0.1 + 1e-6;

constexpr DicomTag kPatient{0x0010, 0x0020, "PatientID"};
constexpr DicomTag kStudy{0x0020, 0x000D, "StudyInstanceUID"};
constexpr DicomTag kFrameOfReference{0x0020, 0x0052, "FrameOfReferenceUID"};
constexpr DicomTag kOrientation{0x0020, 0x0037, "ImageOrientationPatient"};
constexpr DicomTag kRescaleType{0x0028, 0x1054, "RescaleType"};

double dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Vector normalized(const Vector& a) {
  const double factor = 1 / std::sqrt(dot(a, a));
  return {factor * a[0], factor * a[1], factor * a[2]};
}

struct Slice {
  std::string modality, patient, study, frame_of_reference;
  std::string unit;  ///< of its values: HU, US (unspecified), or empty if the header does not say
  DicomPixels pixels;
  Samples samples;         ///< without bytes
  double position_mm = 0;  ///< along the normal of the slices
  bool is_placed = false;  ///< the header gives its position and orientation

  const std::filesystem::path& path() const { return pixels.path; }
};

Vector column(const Samples& samples, int k) {
  return {samples.direction[k], samples.direction[3 + k], samples.direction[6 + k]};
}

/// Reads origin and axes. The axes are made orthonormal, because headers give them with few digits.
void place(const DicomHeader& header, Slice& slice) {
  const auto position = header.numbers(kImagePosition, 3), orientation = header.numbers(kOrientation, 6),
             spacing = header.numbers(kPixelSpacing, 2);
  slice.is_placed = position && orientation;
  if (!slice.is_placed) return;
  if (!spacing)
    throw Error(slice.path().string() + ": does not say how large its pixels are; " + kPixelSpacing.text() +
                " is missing");
  slice.samples.spacing_mm = {(*spacing)[1], (*spacing)[0], 1};  // DICOM gives the distance of rows (y) first
  std::copy(position->begin(), position->end(), slice.samples.origin_mm.begin());
  const Vector row{(*orientation)[0], (*orientation)[1], (*orientation)[2]},
      down{(*orientation)[3], (*orientation)[4], (*orientation)[5]};
  if (std::abs(dot(row, row) - 1) > 1e-2 || std::abs(dot(down, down) - 1) > 1e-2 || std::abs(dot(row, down)) > 1e-3)
    throw Error(slice.path().string() + ": " + kOrientation.text() +
                " is no pair of axes at right angles; its header is wrong: export it again");
  const Vector z = normalized(cross(row, down)), x = normalized(cross(down, z)), y = cross(z, x);
  for (std::size_t k = 0; k < 3; ++k) {
    slice.samples.direction[3 * k] = x[k];
    slice.samples.direction[3 * k + 1] = y[k];
    slice.samples.direction[3 * k + 2] = z[k];
  }
  slice.position_mm = dot(slice.samples.origin_mm, z);
}

Slice read_slice(const std::filesystem::path& path) {
  const DicomFile file(path);
  const DicomHeader header(file, 1);
  Slice slice;
  slice.pixels = read_dicom_pixels(file, 1);
  slice.modality = header.text(kModality).value_or("");
  slice.patient = header.text(kPatient).value_or("");
  slice.study = header.text(kStudy).value_or("");
  slice.frame_of_reference = header.text(kFrameOfReference).value_or("");
  slice.unit = header.text(kRescaleType).value_or("");
  if (slice.pixels.frames != 1)
    throw Error(path.string() + ": is a multi-frame DICOM file; convert it to NIfTI or MHA (dcm2niix does)");
  if (slice.pixels.channels != 1) throw Error(path.string() + ": has colours; a CT slice has one value per pixel");
  slice.samples.size = {slice.pixels.columns, slice.pixels.rows, 1};
  place(header, slice);
  return slice;
}

/// "passed over 3 files that are no slices of the series: DICOMDIR, report.dcm (SR), notes.txt"
std::string note_about(const std::vector<std::string>& passed_over) {
  constexpr std::size_t kMost = 20;
  if (passed_over.empty()) return {};
  std::string note = "passed over what is no slice of the series: ";
  for (std::size_t i = 0; i < std::min(kMost, passed_over.size()); ++i) note += (i ? ", " : "") + passed_over[i];
  if (passed_over.size() > kMost) note += formatted(" and {} more", passed_over.size() - kMost);
  return note;
}

/// If one slice says how its values become HU and another one does not, the latter is damaged.
void check_same_scaling(const DicomPixels& slice, const DicomPixels& first) {
  for (const auto& [name, is_given, first_is_given] :
       {std::tuple{"RescaleSlope", slice.gives_slope, first.gives_slope},
        std::tuple{"RescaleIntercept", slice.gives_intercept, first.gives_intercept}}) {
    if (is_given == first_is_given) continue;
    const auto& [with, without] = is_given ? std::tie(slice.path, first.path) : std::tie(first.path, slice.path);
    throw Error(without.string() + ": its header has no " + name + ", but that of " + with.string() +
                " has one; a series has it in all slices or in none: export it again");
  }
}

/// A slice that was replaced, or has a damaged description of its pixels, may still give plausible numbers.
void check_same_pixels(const DicomPixels& slice, const DicomPixels& first) {
  if (slice.is_signed == first.is_signed && slice.bits_stored == first.bits_stored) return;
  const auto kind = [](const DicomPixels& pixels) {
    return formatted("{} bits {} a sign", pixels.bits_stored, pixels.is_signed ? "with" : "without");
  };
  throw Error(slice.path.string() + ": its pixels have " + kind(slice) + ", those of " + first.path.string() + " " +
              kind(first) + "; slices of one series have the same: export the series again");
}

/// Slices of two patients, studies or frames of reference have no common grid, even if their positions fit.
void check_same_patient(const Slice& slice, const Slice& first) {
  const std::tuple<const DicomTag&, const std::string&, const std::string&> all[] = {
      {kPatient, slice.patient, first.patient},
      {kStudy, slice.study, first.study},
      {kFrameOfReference, slice.frame_of_reference, first.frame_of_reference}};
  for (const auto& [tag, value, first_value] : all)
    if (value != first_value)
      throw Error(slice.path().string() + ": has another " + tag.text() + " than " + first.path().string() +
                  "; slices of one series have the same: export the series again");
}

/// Mean distance between slices; the spacing of the volume.
double spacing_of(const std::vector<Slice>& slices) {
  return (slices.back().position_mm - slices.front().position_mm) / double(slices.size() - 1);
}

double longest(const std::vector<Vector>& vectors) {
  double most = 0;
  for (const Vector& one : vectors) most = std::max(most, std::sqrt(dot(one, one)));
  return most;
}

/// The mean is taken because the position of any single one may be rounded, too.
double farthest_from_mean(std::vector<Vector> vectors) {
  Vector mean{};
  for (const Vector& one : vectors)
    for (std::size_t k = 0; k < 3; ++k) mean[k] += one[k] / double(vectors.size());
  for (Vector& one : vectors)
    for (std::size_t k = 0; k < 3; ++k) one[k] -= mean[k];
  return longest(vectors);
}

/// Checks each slice against its place in the whole grid, because small errors of single steps add up over a long bone.
void check_places(const std::filesystem::path& folder, const std::vector<Slice>& slices) {
  const Slice& first = slices[0];
  const Vector normal = column(first.samples, 2);
  const double spacing_mm = spacing_of(slices);
  double along_mm = 0;
  std::vector<Vector> sideways;
  for (std::size_t i = 0; i < slices.size(); ++i) {
    Vector off = slices[i].samples.origin_mm;
    for (std::size_t k = 0; k < 3; ++k) off[k] -= first.samples.origin_mm[k];
    const double along = dot(off, normal);
    for (std::size_t k = 0; k < 3; ++k) off[k] -= along * normal[k];
    sideways.push_back(off);
    along_mm = std::max(along_mm, std::abs(along - spacing_mm * double(i)));
  }
  if (farthest_from_mean(sideways) > kFarthestOff_mm)
    throw Error(
        formatted("{}: the slices are shifted sideways, by up to {:.4g} mm (a tilted gantry); resample the series to a "
                  "straight grid first",
                  folder.string(), longest(sideways)));
  if (along_mm > kFarthestOff_mm)
    throw Error(
        formatted("{}: the slices are unevenly spaced; some lie up to {:.4g} mm from where even ones of {:.4g} mm "
                  "would; resample the series to an even grid first",
                  folder.string(), along_mm, spacing_mm));
}

/// Throws Error if two slices lie at the same place, or if one is missing between two. Where slices are closer than
/// 0.2 mm, check_places() alone would not notice a missing one.
void check_gaps(const std::filesystem::path& folder, const std::vector<Slice>& slices) {
  std::vector<double> gaps;
  for (std::size_t i = 1; i < slices.size(); ++i) gaps.push_back(slices[i].position_mm - slices[i - 1].position_mm);
  // Not the mean of the two in the middle: if a slice is missing in one of two gaps, the short one is usual.
  std::vector<double> sorted = gaps;
  const auto middle = sorted.begin() + std::ptrdiff_t((sorted.size() - 1) / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  for (std::size_t i = 0; i < gaps.size(); ++i) {
    const std::string between =
        slices[i].path().filename().string() + " and " + slices[i + 1].path().filename().string();
    if (gaps[i] < 1e-3)
      throw Error(folder.string() + ": " + between + " lie at the same place; the series has a slice twice");
    if (gaps[i] > 1.5 * *middle + 1e-3)
      throw Error(
          formatted("{}: {:.4g} mm between {}, {:.4g} mm between most slices; a slice is missing or the series is "
                    "unevenly spaced",
                    folder.string(), gaps[i], between, *middle));
  }
}

/// Throws Error unless the slices form one grid: same size, same directions, evenly spaced along their normal.
void check_slices(const std::filesystem::path& folder, const std::vector<Slice>& slices) {
  const Slice& first = slices[0];
  if (slices.size() < 2) throw Error(folder.string() + ": the series has 1 slice; a volume needs at least 2");
  for (const Slice& slice : slices) {
    if (slice.modality != "CT")
      throw Error(slice.path().string() + ": is of modality '" + slice.modality +
                  "'; expected CT, whose values are Hounsfield units");
    if (!slice.unit.empty() && slice.unit != "HU" && slice.unit != "US")
      throw Error(slice.path().string() + ": its values are no Hounsfield units: " + kRescaleType.text() + " is '" +
                  shown(slice.unit) + "', expected HU; choose the series with the CT itself");
    if (!slice.is_placed)
      throw Error(slice.path().string() +
                  ": the slice does not say where it lies (ImagePositionPatient, ImageOrientationPatient are missing)");
    if (slice.pixels.has_table)
      throw Error(slice.path().string() +
                  ": its values go through a table (ModalityLUTSequence), which is not read; export it as HU");
    check_same_patient(slice, first);
    check_same_scaling(slice.pixels, first.pixels);
    check_same_pixels(slice.pixels, first.pixels);
    bool same = slice.samples.size == first.samples.size;
    for (int i = 0; i < 9; ++i) same = same && std::abs(slice.samples.direction[i] - first.samples.direction[i]) < 1e-4;
    for (int i = 0; i < 2; ++i)
      same = same && std::abs(slice.samples.spacing_mm[i] - first.samples.spacing_mm[i]) < 1e-5;
    if (!same)
      throw Error(slice.path().string() + ": has another size, spacing or direction than " + first.path().string());
  }
  if (!first.pixels.gives_slope || !first.pixels.gives_intercept)
    throw Error(
        first.path().string() + ": its header has no " +
        (first.pixels.gives_slope ? "RescaleIntercept (0028,1052)" : "RescaleSlope (0028,1053)") +
        ", nor has any other slice's, so which values are Hounsfield units is not known; export the series again");
  check_gaps(folder, slices);
  check_places(folder, slices);
}

}  // namespace

VolumeSamples read_dicom_series(const std::filesystem::path& folder, const std::string& series_uid) {
  const SeriesFiles files = files_of_series(folder, series_uid);
  std::vector<Slice> slices;
  for (const auto& path : files.slices) slices.push_back(read_slice(path));
  std::stable_sort(slices.begin(), slices.end(),
                   [](const Slice& a, const Slice& b) { return a.position_mm < b.position_mm; });
  check_slices(folder, slices);
  VolumeSamples series;
  series.note = note_about(files.passed_over);
  series.geometry = slices[0].samples;
  series.geometry.dimensions = 3;
  series.geometry.size[2] = int(slices.size());
  series.geometry.spacing_mm[2] = spacing_of(slices);
  const std::size_t pixels = slices[0].samples.count();
  for (std::size_t k = 0; k < slices.size(); ++k) {
    const Samples slice = read_dicom_frame(slices[k].pixels, 1);
    if (series.values.empty()) resize_large(series.values, pixels * slices.size());
    scaled_values(slices[k].pixels, slice, series.values.data() + k * pixels);
    make_padding_air(slices[k].pixels, series.values.data() + k * pixels, pixels);
  }
  return series;
}

}  // namespace marrow::files
