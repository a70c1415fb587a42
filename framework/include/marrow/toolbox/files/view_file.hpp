// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>

#include "marrow/domain/camera.hpp"

namespace marrow::files {

/// The files of a view. The camera is `*camera` if that is not null, else it is read from `camera_file`.
struct ViewSource {
  std::string name;
  std::filesystem::path image;
  const Camera* camera = nullptr;
  std::filesystem::path camera_file;
  std::filesystem::path calibration;  ///< may be empty
  int frame = 0;                      ///< of the image file, from 1; 0: the file must have only one
};

/// Reads a view. If the camera file or the calibration describes a distortion, it is removed from the image here, so
/// the result has a plain pinhole camera. Throws Error if a file cannot be read, if sizes do not match, or if camera
/// file and calibration both describe a distortion.
View read_view_files(const ViewSource& source);

}  // namespace marrow::files
