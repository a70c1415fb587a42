// SPDX-License-Identifier: Apache-2.0
#pragma once
// The headers of NIfTI-1 (348 bytes) and NIfTI-2 (540 bytes). They hold the same fields, at other places and with other
// widths: https://nifti.nimh.nih.gov/nifti-1 and nifti-2.
#include <array>
#include <string>

#include "marrow/toolbox/files/input_file.hpp"

namespace marrow::files {

/// A matrix that maps indices to RAS: three columns with the axes times the voxel's size, then the position of the
/// first voxel.
using NiftiAffine = std::array<std::array<double, 4>, 3>;

struct NiftiHeader {
  std::string what;  ///< the file, for messages
  bool is_swapped = false;
  std::array<long long, 8> dim{};  ///< the number of dimensions, then the size along each
  std::array<double, 8> pixdim{};  ///< the sign of the third axis of the qform, then the size of a voxel
  int type = 0, bits = 0, unit = 0;
  int qform_code = 0, sform_code = 0;
  std::array<double, 3> quaternion{}, offset{};  ///< of the qform
  NiftiAffine sform{};
  double slope = 0, intercept = 0;
  double begin = 0;        ///< offset of the samples, decompressed
  double least_begin = 0;  ///< behind the header and the four bytes that name extensions

  /// The header's unit of length in mm.
  double unit_mm() const { return unit == 1 ? 1e3 : unit == 3 ? 1e-3 : 1; }
};

/// Throws Error unless the file is NIfTI and holds its samples itself. Does not judge the values of the fields.
NiftiHeader read_nifti_header(const InputFile& file);

}  // namespace marrow::files
