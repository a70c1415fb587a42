// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <tuple>

#include "dicom_folder.hpp"
#include "dicom_grid.hpp"
#include "header_lines.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/large_memory.hpp"
#include "marrow/base/number_text.hpp"

namespace marrow::files {
namespace {

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
