// SPDX-License-Identifier: Apache-2.0
// The slices of a CT, and the grid that they form. Those of a tilted gantry lie sheared; they are resampled to a
// straight grid.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <tuple>

#include "dicom_folder.hpp"
#include "dicom_pixels.hpp"
#include "header_lines.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/large_memory.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/domain/transform.hpp"

namespace marrow::files {
namespace {

constexpr DicomTag kPatient{0x0010, 0x0020, "PatientID"};
constexpr DicomTag kStudy{0x0020, 0x000D, "StudyInstanceUID"};
constexpr DicomTag kFrameOfReference{0x0020, 0x0052, "FrameOfReferenceUID"};
constexpr DicomTag kRescaleType{0x0028, 0x1054, "RescaleType"};

struct DicomSlice {
  std::string modality, patient, study, frame_of_reference;
  std::string unit;  ///< of its values: HU, US (unspecified), or empty if the header does not say
  DicomPixels pixels;
  int number = 1;          ///< of the frame in its file
  int frame = 1;           ///< the same in `pixels`, which may hold only this one
  Samples samples;         ///< without bytes
  double position_mm = 0;  ///< along the normal of the slices
  bool is_placed = false;  ///< the header gives its position and orientation

  const std::filesystem::path& path() const { return pixels.path; }
  /// For messages: its file and, of several, its frame.
  std::string name() const;
};

struct SliceGrid {
  Samples geometry;  ///< without bytes
  /// By how many pixels each slice is shifted against the one before, along rows and columns; zeros if they lie
  /// straight.
  Eigen::Vector2d step_px = Eigen::Vector2d::Zero();
  double tilt_deg = 0;
  /// The grid's first pixel, counted from that of the first slice: the straight grid holds all slices whole.
  Eigen::Vector2i first_px = Eigen::Vector2i::Zero();

  std::size_t slice_pixels() const { return std::size_t(geometry.size[0]) * std::size_t(geometry.size[1]); }
};

// The largest distance of a slice from its place in an even grid. Positions that are rounded to one decimal may be this
// far off.
constexpr double kFarthestOff_mm = 0.1 + 1e-6;
constexpr double kMostTilt_deg = 45;  // gantries tilt by 30
constexpr double kWidest = 10;
constexpr float kAir_hu = -1000;

Eigen::Vector3d axis(const Samples& samples, int k) {
  return {samples.direction[k], samples.direction[3 + k], samples.direction[6 + k]};
}

Eigen::Vector3d origin(const Samples& samples) { return Eigen::Map<const Eigen::Vector3d>(samples.origin_mm.data()); }

double spacing_of(const std::vector<DicomSlice>& slices) {
  return (slices.back().position_mm - slices.front().position_mm) / double(slices.size() - 1);
}

/// Throws Error if two slices lie at the same place, or if one is missing between two. Where slices are closer than
/// 0.2 mm, check_places() alone would not notice a missing one.
void check_gaps(const std::string& what, const std::vector<DicomSlice>& slices) {
  std::vector<double> gaps;
  for (std::size_t i = 1; i < slices.size(); ++i) gaps.push_back(slices[i].position_mm - slices[i - 1].position_mm);
  // Not the mean of the two in the middle: if a slice is missing in one of two gaps, the short one is usual.
  std::vector<double> sorted = gaps;
  const auto middle = sorted.begin() + std::ptrdiff_t((sorted.size() - 1) / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  for (std::size_t i = 0; i < gaps.size(); ++i) {
    const std::string between = slices[i].name() + " and " + slices[i + 1].name();
    if (gaps[i] < 1e-3) throw Error(what + ": " + between + " lie at the same place; the series has a slice twice");
    if (gaps[i] > 1.5 * *middle + 1e-3)
      throw Error(
          formatted("{}: {:.4g} mm between {}, {:.4g} mm between most slices; a slice is missing or the series is "
                    "unevenly spaced",
                    what, gaps[i], between, *middle));
  }
}

/// A line through the offsets of all slices, because any single one may be rounded.
struct Line {
  Eigen::Vector2d start, step;
  double farthest(const std::vector<Eigen::Vector2d>& offsets) const {
    double most = 0;
    for (std::size_t i = 0; i < offsets.size(); ++i)
      most = std::max(most, (offsets[i] - start - double(i) * step).norm());
    return most;
  }
};

Line fitted(const std::vector<Eigen::Vector2d>& offsets, bool is_level) {
  const double count = double(offsets.size()), middle = (count - 1) / 2;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero(), slope = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& one : offsets) mean += one / count;
  if (is_level) return {mean, slope};
  for (std::size_t i = 0; i < offsets.size(); ++i) slope += (double(i) - middle) * (offsets[i] - mean);
  slope /= count * (count * count - 1) / 12;
  return {mean - middle * slope, slope};
}

/// How far each slice lies from the first one along rows and columns. Each is checked against its place in the whole
/// grid, because small errors of single steps add up over a long bone.
std::vector<Eigen::Vector2d> sideways_mm(const std::string& what, const std::vector<DicomSlice>& slices) {
  const Samples& first = slices[0].samples;
  const double spacing_mm = spacing_of(slices);
  double farthest_mm = 0;
  std::vector<Eigen::Vector2d> sideways;
  for (std::size_t i = 0; i < slices.size(); ++i) {
    const Eigen::Vector3d off = origin(slices[i].samples) - origin(first);
    sideways.emplace_back(off.dot(axis(first, 0)), off.dot(axis(first, 1)));
    farthest_mm = std::max(farthest_mm, std::abs(off.dot(axis(first, 2)) - spacing_mm * double(i)));
  }
  if (farthest_mm > kFarthestOff_mm)
    throw Error(
        formatted("{}: the slices are unevenly spaced; some lie up to {:.4g} mm from where even ones of {:.4g} mm "
                  "would; resample the series to an even grid first",
                  what, farthest_mm, spacing_mm));
  return sideways;
}

/// Makes room for all slices of a tilted gantry.
void straighten(const std::string& what, const Eigen::Vector2d& step_mm, SliceGrid& grid) {
  Samples& geometry = grid.geometry;
  grid.tilt_deg = degrees(std::atan2(step_mm.norm(), geometry.spacing_mm[2]));
  if (grid.tilt_deg > kMostTilt_deg)
    throw Error(
        formatted("{}: the slices lie sheared by {:.4g} degrees, more than a gantry tilts; export the series "
                  "again",
                  what, grid.tilt_deg));
  for (int k = 0; k < 2; ++k) {
    grid.step_px[k] = step_mm[k] / geometry.spacing_mm[k];
    const double whole = grid.step_px[k] * (geometry.size[2] - 1);
    if (std::abs(whole) > kWidest * geometry.size[k])
      throw Error(
          formatted("{}: the last slice lies {:.4g} mm beside the first one, more than {:g} times its width; "
                    "export the series again",
                    what, std::abs(whole) * geometry.spacing_mm[k], kWidest));
    // A shift that is a whole number up to rounding needs no further pixel.
    grid.first_px[k] = std::min(0, int(std::floor(whole + 1e-3)));
    geometry.size[k] += int(std::ceil(std::abs(whole) - 1e-3));
    for (int axis = 0; axis < 3; ++axis)
      geometry.origin_mm[axis] += geometry.direction[3 * axis + k] * geometry.spacing_mm[k] * grid.first_px[k];
  }
}

constexpr DicomTag kOrientation{0x0020, 0x0037, "ImageOrientationPatient"};

/// Reads origin and axes. The axes are made orthonormal, because headers give them with few digits.
void place(const DicomHeader& header, DicomSlice& slice) {
  const auto position = header.numbers(kImagePosition, 3), orientation = header.numbers(kOrientation, 6),
             spacing = header.numbers(kPixelSpacing, 2);
  slice.is_placed = position && orientation;
  if (!slice.is_placed) return;
  if (!spacing)
    throw Error(slice.path().string() + ": does not say how large its pixels are; " + kPixelSpacing.text() +
                " is missing");
  if (!((*spacing)[0] > 0 && (*spacing)[1] > 0))
    throw Error(formatted("{}: {} is {:f} x {:f} mm; its header is wrong: export it again", slice.path().string(),
                          kPixelSpacing.text(), (*spacing)[0], (*spacing)[1]));
  slice.samples.spacing_mm = {(*spacing)[1], (*spacing)[0], 1};  // DICOM gives the distance of rows (y) first
  std::copy(position->begin(), position->end(), slice.samples.origin_mm.begin());
  const Eigen::Vector3d row(orientation->data()), down(orientation->data() + 3);
  if (std::abs(row.squaredNorm() - 1) > 1e-2 || std::abs(down.squaredNorm() - 1) > 1e-2 ||
      std::abs(row.dot(down)) > 1e-3)
    throw Error(slice.path().string() + ": " + kOrientation.text() +
                " is no pair of axes at right angles; its header is wrong: export it again");
  const Eigen::Vector3d z = row.cross(down).normalized(), x = down.cross(z).normalized(), y = z.cross(x);
  for (int k = 0; k < 3; ++k) {
    slice.samples.direction[3 * k] = x[k];
    slice.samples.direction[3 * k + 1] = y[k];
    slice.samples.direction[3 * k + 2] = z[k];
  }
  slice.position_mm = Eigen::Map<const Eigen::Vector3d>(slice.samples.origin_mm.data()).dot(z);
}

/// Keeps the parts of the slice's own frame, because an enhanced file may have thousands.
void keep_own_parts(DicomSlice& slice) {
  DicomPixels& pixels = slice.pixels;
  if (pixels.first_part_of_frame.empty()) return;
  const auto part = [&](int frame) {
    return pixels.frame_parts.begin() + std::ptrdiff_t(pixels.first_part_of_frame[std::size_t(frame)]);
  };
  pixels.frame_parts = {part(slice.frame - 1), part(slice.frame)};
  pixels.first_part_of_frame = {0, pixels.frame_parts.size()};
  slice.frame = 1;
}

DicomSlice read_slice(const DicomFile& file, int frame) {
  const DicomHeader header(file, frame);
  DicomSlice slice;
  slice.pixels = read_dicom_pixels(file, frame);
  slice.number = slice.frame = frame;
  slice.modality = header.text(kModality).value_or("");
  slice.patient = header.text(kPatient).value_or("");
  slice.study = header.text(kStudy).value_or("");
  slice.frame_of_reference = header.text(kFrameOfReference).value_or("");
  slice.unit = slice.pixels.table ? slice.pixels.table->type : header.text(kRescaleType).value_or("");
  if (slice.pixels.channels != 1)
    throw Error(file.path().string() + ": has colours; a CT slice has one value per pixel");
  slice.samples.size = {slice.pixels.columns, slice.pixels.rows, 1};
  place(header, slice);
  return slice;
}

/// `slices` are sorted by position. Throws Error, beginning with `what`, if they form no grid: if one is missing, given
/// twice, unevenly spaced, or shifted otherwise than a tilted gantry shifts it.
SliceGrid grid_of_slices(const std::string& what, const std::vector<DicomSlice>& slices) {
  check_gaps(what, slices);
  const std::vector<Eigen::Vector2d> sideways = sideways_mm(what, slices);
  SliceGrid grid;
  grid.geometry = slices[0].samples;
  grid.geometry.dimensions = 3;
  grid.geometry.size[2] = int(slices.size());
  grid.geometry.spacing_mm[2] = spacing_of(slices);
  if (fitted(sideways, true).farthest(sideways) <= kFarthestOff_mm) return grid;
  const Line line = fitted(sideways, false);
  if (const double off_mm = line.farthest(sideways); off_mm > kFarthestOff_mm)
    throw Error(
        formatted("{}: the slices are shifted sideways, up to {:.4g} mm from where a tilted gantry would put "
                  "them; export the series again, or resample it to a straight grid first",
                  what, off_mm));
  straighten(what, line.step, grid);
  return grid;
}

/// Puts the values of slice `k` of a tilted gantry into the volume. Between pixels they are interpolated linearly;
/// beside the slice is air.
void put_slice(const SliceGrid& grid, const std::vector<float>& slice, const std::array<int, 3>& slice_size, int k,
               float* volume) {
  float* to = volume + std::size_t(k) * grid.slice_pixels();
  // Where the grid's first pixel lies in the slice: whole pixels and the rest, which is the same for all pixels.
  std::array<int, 2> whole;
  std::array<float, 2> rest;
  for (int axis = 0; axis < 2; ++axis) {
    const double at = grid.first_px[axis] - grid.step_px[axis] * k;
    whole[axis] = int(std::floor(at + 1e-6));
    rest[axis] = float(std::max(0.0, at - whole[axis]));
    if (rest[axis] < 1e-5f) rest[axis] = 0;
  }
  const auto value = [&](int x, int y) {
    return x >= 0 && y >= 0 && x < slice_size[0] && y < slice_size[1]
               ? slice[std::size_t(y) * std::size_t(slice_size[0]) + std::size_t(x)]
               : kAir_hu;
  };
  for (int v = 0; v < grid.geometry.size[1]; ++v)
    for (int u = 0; u < grid.geometry.size[0]; ++u, ++to) {
      const int x = u + whole[0], y = v + whole[1];
      const auto in_row = [&](int row) {
        return rest[0] == 0 ? value(x, row) : (1 - rest[0]) * value(x, row) + rest[0] * value(x + 1, row);
      };
      *to = rest[1] == 0 ? in_row(y) : (1 - rest[1]) * in_row(y) + rest[1] * in_row(y + 1);
    }
}

std::string DicomSlice::name() const {
  return pixels.frames == 1 ? path().filename().string() : formatted("{} frame {}", path().filename().string(), number);
}

/// What the header says of the one slice of a file, or of each frame of an enhanced one. Throws Error if the pixels
/// cannot be those of a CT.
std::vector<DicomSlice> read_dicom_slices(const std::filesystem::path& path) {
  const DicomFile file(path);
  std::vector<DicomSlice> slices{read_slice(file, 1)};
  const int frames = slices[0].pixels.frames;
  if (frames > 1 && !find_element(path, file.elements(), kFrameGroups))
    throw Error(path.string() +
                ": is a multi-frame DICOM file that does not say where its frames lie "
                "(PerFrameFunctionalGroupsSequence is missing); convert it to NIfTI or MHA (dcm2niix does)");
  for (int frame = 2; frame <= frames; ++frame) slices.push_back(read_slice(file, frame));
  for (DicomSlice& slice : slices) keep_own_parts(slice);
  return slices;
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
       {std::tuple{"ModalityLUTSequence", slice.table.has_value(), first.table.has_value()},
        std::tuple{"RescaleSlope", slice.gives_slope, first.gives_slope},
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
void check_same_patient(const DicomSlice& slice, const DicomSlice& first) {
  const std::tuple<const DicomTag&, const std::string&, const std::string&> all[] = {
      {kPatient, slice.patient, first.patient},
      {kStudy, slice.study, first.study},
      {kFrameOfReference, slice.frame_of_reference, first.frame_of_reference}};
  for (const auto& [tag, value, first_value] : all)
    if (value != first_value)
      throw Error(slice.path().string() + ": has another " + tag.text() + " than " + first.path().string() +
                  "; slices of one series have the same: export the series again");
}

/// The values must be Hounsfield units, by a table or by slope and intercept.
void check_scaling(const std::vector<DicomSlice>& slices) {
  const DicomPixels& first = slices[0].pixels;
  for (const DicomSlice& slice : slices) {
    if (!slice.unit.empty() && slice.unit != "HU" && slice.unit != "US")
      throw Error(slice.path().string() + ": its values are no Hounsfield units: " +
                  (slice.pixels.table ? "ModalityLUTType (0028,3004)" : kRescaleType.text()) + " is '" +
                  shown(slice.unit) + "', expected HU; choose the series with the CT itself");
    check_same_scaling(slice.pixels, first);
  }
  if (!first.table && (!first.gives_slope || !first.gives_intercept))
    throw Error(first.path.string() + ": its header has no " +
                (first.gives_slope ? "RescaleIntercept (0028,1052)" : "RescaleSlope (0028,1053)") +
                ", nor has any other slice's, so which values are Hounsfield units is not known; export the series "
                "again");
}

/// Throws Error unless the slices are CT of one patient, with the same size and directions.
void check_slices(const std::string& what, const std::vector<DicomSlice>& slices) {
  const DicomSlice& first = slices[0];
  if (slices.size() < 2) throw Error(what + ": the series has 1 slice; a volume needs at least 2");
  for (const DicomSlice& slice : slices) {
    if (slice.modality != "CT")
      throw Error(slice.path().string() + ": is of modality '" + slice.modality +
                  "'; expected CT, whose values are Hounsfield units");
    if (!slice.is_placed)
      throw Error(slice.path().string() +
                  ": the slice does not say where it lies (ImagePositionPatient, ImageOrientationPatient are missing)");
    check_same_patient(slice, first);
    check_same_pixels(slice.pixels, first.pixels);
    bool same = slice.samples.size == first.samples.size;
    for (int i = 0; i < 9; ++i) same = same && std::abs(slice.samples.direction[i] - first.samples.direction[i]) < 1e-4;
    for (int i = 0; i < 2; ++i)
      same = same && std::abs(slice.samples.spacing_mm[i] - first.samples.spacing_mm[i]) < 1e-5;
    if (!same)
      throw Error(slice.path().string() + ": has another size, spacing or direction than " + first.path().string());
  }
  check_scaling(slices);
}

VolumeSamples volume_of(const std::string& what, std::vector<DicomSlice> slices, const std::string& note) {
  std::stable_sort(slices.begin(), slices.end(),
                   [](const DicomSlice& a, const DicomSlice& b) { return a.position_mm < b.position_mm; });
  check_slices(what, slices);
  const SliceGrid grid = grid_of_slices(what, slices);
  VolumeSamples series;
  series.geometry = grid.geometry;
  series.note = note;
  if (grid.tilt_deg > 0)
    series.note +=
        formatted("{}the gantry was tilted by {:.1f} degrees, so the slices were resampled to a straight grid",
                  note.empty() ? "" : "; ", grid.tilt_deg);
  const bool is_tilted = grid.tilt_deg > 0;
  std::vector<float> values(is_tilted ? slices[0].samples.count() : 0);
  for (std::size_t k = 0; k < slices.size(); ++k) {
    const Samples slice = read_dicom_frame(slices[k].pixels, slices[k].frame);
    if (series.values.empty()) resize_large(series.values, grid.slice_pixels() * slices.size());
    float* const to = is_tilted ? values.data() : series.values.data() + k * grid.slice_pixels();
    scaled_values(slices[k].pixels, slice, to);
    make_padding_air(slices[k].pixels, to, slice.count());
    if (is_tilted) put_slice(grid, values, slice.size, int(k), series.values.data());
  }
  return series;
}

}  // namespace

VolumeSamples read_dicom_series(const std::filesystem::path& folder, const std::string& series_uid) {
  const SeriesFiles files = files_of_series(folder, series_uid);
  std::vector<DicomSlice> slices;
  for (const auto& path : files.slices)
    for (DicomSlice& slice : read_dicom_slices(path)) slices.push_back(std::move(slice));
  return volume_of(folder.string(), std::move(slices), note_about(files.passed_over));
}

VolumeSamples read_dicom_frames(const std::filesystem::path& path) {
  std::vector<DicomSlice> slices = read_dicom_slices(path);
  if (slices.size() == 1)
    throw Error(path.string() + ": is one DICOM file; a volume is a folder of DICOM slices (name the folder)");
  return volume_of(path.string(), std::move(slices), "");
}

}  // namespace marrow::files
