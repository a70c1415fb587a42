// SPDX-License-Identifier: Apache-2.0
#include "dicom_slices.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"

namespace marrow::files {
namespace {

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

}  // namespace

std::string DicomSlice::name() const {
  return pixels.frames == 1 ? path().filename().string() : formatted("{} frame {}", path().filename().string(), number);
}

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

}  // namespace marrow::files
