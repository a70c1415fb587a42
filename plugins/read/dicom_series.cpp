// SPDX-License-Identifier: Apache-2.0
#include <itkGDCMImageIO.h>
#include <itkMultiThreaderBase.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <map>

#include "itk_samples.hpp"
#include "marrow/domain/error.hpp"

namespace marrow::read {
namespace {

using Vector = std::array<double, 3>;

double dot(const Vector& a, const Vector& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

struct Slice {
  std::filesystem::path path;
  std::string series, description, modality;
  Samples samples;
  double position_mm = 0;  ///< along the normal of the slices
  bool is_placed = false;  ///< says where it lies
};

bool looks_like_dicom(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  char head[132] = {};
  stream.read(head, sizeof head);
  return stream.gcount() == sizeof head && std::equal(head + 128, head + 132, "DICM");
}

std::string tag(itk::GDCMImageIO& io, const std::string& name) {
  std::string value;
  io.GetValueFromTag(name, value);
  while (!value.empty() && (value.back() == ' ' || value.back() == '\0')) value.pop_back();
  return value;
}

Vector column(const Samples& samples, int k) {
  return {samples.direction[k], samples.direction[3 + k], samples.direction[6 + k]};
}

Slice read_slice(const std::filesystem::path& path) {
  check_dicom_file(path);
  const auto io = itk::GDCMImageIO::New();
  Slice slice;
  slice.path = path;
  slice.samples = read_through(*io, path, "DICOM");
  slice.series = tag(*io, "0020|000e");
  slice.description = tag(*io, "0008|103e");
  slice.modality = tag(*io, "0008|0060");
  const std::string what = path.string();
  if (slice.samples.size[2] != 1)
    throw Error(what + ": is a multi-frame DICOM file; convert it to NIfTI or MHA (dcm2niix does)");
  if (slice.samples.components != 1) throw Error(what + ": has colours; a CT slice has one value per pixel");
  slice.is_placed = !tag(*io, "0020|0032").empty() && !tag(*io, "0020|0037").empty();
  slice.position_mm = dot({slice.samples.origin_mm[0], slice.samples.origin_mm[1], slice.samples.origin_mm[2]},
                          column(slice.samples, 2));
  return slice;
}

/// The DICOM files of a folder by series. Other files (a licence, a note) are passed over.
std::map<std::string, std::vector<Slice>> read_folder(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> paths;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    if (entry.is_regular_file()) paths.push_back(entry.path());
  std::sort(paths.begin(), paths.end());
  std::map<std::string, std::vector<Slice>> series;
  for (const auto& path : paths) {
    if (path.filename() == "DICOMDIR") continue;
    if (looks_like_dicom(path)) {
      Slice slice = read_slice(path);
      series[slice.series].push_back(std::move(slice));
    } else if (path.extension() == ".dcm") {
      throw Error(path.string() + ": is not a DICOM file, or is damaged at its start");
    }
  }
  return series;
}

std::vector<Slice> choose_series(const std::filesystem::path& folder, const std::string& series_uid) {
  auto series = read_folder(folder);
  if (series.empty()) throw Error(folder.string() + ": holds no DICOM file");
  std::string all;
  for (const auto& [uid, slices] : series)
    all += "\n    " + uid + " (" + slices[0].modality + ", " + std::to_string(slices.size()) + " slices" +
           (slices[0].description.empty() ? "" : ", " + slices[0].description) + ")";
  if (series_uid.empty() && series.size() > 1)
    throw Error(folder.string() + ": holds " + std::to_string(series.size()) +
                " series; name one with series_uid:" + all);
  const auto chosen = series_uid.empty() ? series.begin() : series.find(series_uid);
  if (chosen == series.end()) throw Error(folder.string() + ": holds no series " + series_uid + "; it holds:" + all);
  return std::move(chosen->second);
}

std::string millimetres(double length) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g mm", length);
  return text;
}

/// That the slices belong to one grid: same size, same directions, evenly spaced along their normal.
void check_slices(const std::filesystem::path& folder, const std::vector<Slice>& slices) {
  const Slice& first = slices[0];
  if (slices.size() < 2) throw Error(folder.string() + ": the series has 1 slice; a volume needs at least 2");
  for (const Slice& slice : slices) {
    if (slice.modality != "CT")
      throw Error(slice.path.string() + ": is of modality '" + slice.modality +
                  "'; expected CT, whose values are Hounsfield units");
    if (!slice.is_placed)
      throw Error(slice.path.string() +
                  ": the slice does not say where it lies (ImagePositionPatient, ImageOrientationPatient are missing)");
    bool same = slice.samples.size == first.samples.size;
    for (int i = 0; i < 9; ++i) same = same && std::abs(slice.samples.direction[i] - first.samples.direction[i]) < 1e-4;
    for (int i = 0; i < 2; ++i)
      same = same && std::abs(slice.samples.spacing_mm[i] - first.samples.spacing_mm[i]) < 1e-5;
    if (!same)
      throw Error(slice.path.string() + ": has another size, spacing or direction than " + first.path.string());
  }
  std::vector<double> gaps;
  for (std::size_t i = 1; i < slices.size(); ++i) gaps.push_back(slices[i].position_mm - slices[i - 1].position_mm);
  std::vector<double> sorted = gaps;
  std::nth_element(sorted.begin(), sorted.begin() + sorted.size() / 2, sorted.end());
  const double usual = sorted[sorted.size() / 2];
  for (std::size_t i = 0; i < gaps.size(); ++i) {
    const std::string between = slices[i].path.filename().string() + " and " + slices[i + 1].path.filename().string();
    if (gaps[i] < 1e-3)
      throw Error(folder.string() + ": " + between + " lie at the same place; the series has a slice twice");
    if (std::abs(gaps[i] - usual) > 0.01 * usual + 1e-3)
      throw Error(folder.string() + ": " + millimetres(gaps[i]) + " between " + between + ", " + millimetres(usual) +
                  " between most slices; a slice is missing or the series is unevenly spaced");
    for (int k = 0; k < 3; ++k) {
      const double step = slices[i + 1].samples.origin_mm[k] - slices[i].samples.origin_mm[k];
      if (std::abs(step - gaps[i] * column(first.samples, 2)[k]) > 0.02 * usual + 1e-2)
        throw Error(folder.string() + ": the slices are shifted sideways between " + between +
                    " (a tilted gantry); resample the series to a straight grid first");
    }
  }
}

}  // namespace

DicomSeries read_dicom_series(const std::filesystem::path& folder, const std::string& series_uid) {
  itk::MultiThreaderBase::SetGlobalDefaultNumberOfThreads(1);
  std::vector<Slice> slices = choose_series(folder, series_uid);
  std::stable_sort(slices.begin(), slices.end(),
                   [](const Slice& a, const Slice& b) { return a.position_mm < b.position_mm; });
  check_slices(folder, slices);
  DicomSeries series;
  series.geometry = slices[0].samples;
  series.geometry.bytes.clear();
  series.geometry.dimensions = 3;
  series.geometry.size[2] = int(slices.size());
  series.geometry.spacing_mm[2] = (slices.back().position_mm - slices.front().position_mm) / double(slices.size() - 1);
  for (const Slice& slice : slices) {
    const std::vector<float> values = to_float(slice.samples);
    series.values.insert(series.values.end(), values.begin(), values.end());
  }
  return series;
}

}  // namespace marrow::read
