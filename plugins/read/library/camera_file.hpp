// SPDX-License-Identifier: Apache-2.0
#pragma once
// The camera of any file that marrow reads: its own YAML, and the files of XMALab, MayaCam, plastimatch, RTK, xReg and
// JointTrack.
#include <filesystem>
#include <string>

#include "marrow/toolbox/exchange/camera_matrix.hpp"
#include "marrow/toolbox/files/camera_file.hpp"

namespace marrow::read {

/// `own` is marrow's YAML.
enum class CameraFormat { own, xmalab, maya, plastimatch, rtk, xreg, jointtrack };

/// By the end of the name: .yaml and .yml are marrow's, .xml RTK's, .h5 and .hdf5 xReg's. Any other file is a text: of
/// plastimatch, JointTrack or a MayaCam if it begins as their files do, else of XMALab.
CameraFormat camera_format(const std::filesystem::path& path);

/// What a file of another program leaves open.
struct CameraReading {
  int projection = -1;       ///< RTK and xReg: its number, from 0; -1: the file must hold only one
  exchange::ImageSize size;  ///< size_px: plastimatch, RTK, JointTrack; the others: RTK
  exchange::Mirror mirror = exchange::Mirror::none;  ///< RTK and xReg: how the image was turned over
  double scale = 1;                                  ///< all but marrow's YAML: converts the file's unit to mm
};

/// The camera in a file of any format. Only marrow's own YAML holds a distortion. `size.size_px` may be given for any
/// format. Throws Error for any other value that the format does not need, if the camera's images have another size
/// than `size_px`, if the file holds several projections and none is chosen, and as the format's reader does.
files::CameraInFile read_camera(const std::filesystem::path& path, const CameraReading& reading);

/// files::doubt_about_distance() of a camera from this file, with the file's name; empty for marrow's own format, which
/// is always in mm.
std::string doubt_about_unit(const std::filesystem::path& path, const Camera& camera, double scale);

}  // namespace marrow::read
