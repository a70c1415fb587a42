// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>

#include "marrow/domain/camera.hpp"

namespace marrow::files {

/// Where a view comes from. Its camera is either a value or a file.
struct ViewSource {
  std::string name;
  std::filesystem::path image;
  const Camera* camera = nullptr;
  std::filesystem::path camera_file;
  std::filesystem::path calibration;  ///< may be empty
  int frame = 0;                      ///< of the image file, from 1; 0 = there is only one
};

/// One view whose image is that of a plain pinhole: the distortion that its camera file or calibration tells of is
/// removed here, once. Throws Error.
View read_view_files(const ViewSource& source);

}  // namespace marrow::files
