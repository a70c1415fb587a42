// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "marrow/domain/calibration.hpp"
#include "marrow/domain/camera.hpp"
#include "marrow/domain/list.hpp"
#include "marrow/runtime/node/context.hpp"
#include "marrow/toolbox/files/camera_file.hpp"

namespace marrow::read {

/// The files of a view. The camera is `*camera` if that is not null, else it is read from `camera_file`.
struct ViewSource {
  std::string name;
  std::filesystem::path image;
  const Camera* camera = nullptr;
  std::filesystem::path camera_file;
  std::filesystem::path calibration;  ///< may be empty
  std::filesystem::path distortion;   ///< may be empty
  int frame = 0;                      ///< of the image file, from 1; 0: the file must have only one
  std::string mirror = "none";        ///< as files::turned_over() takes it; the camera is that of the image afterwards
  int projection = -1;                ///< as CameraReading has it
  std::vector<double> pixel_mm{}, corner_mm{};
  double scale = 1;  ///< as CameraReading has it
};

/// The camera of this name. Throws Error with the known names if there is none.
const Camera& camera_of_view(const std::string& view, const List<Camera>& cameras);

/// How the images of a view were taken.
struct ViewCamera {
  files::CameraInFile camera;
  std::optional<Calibration> calibration;  ///< its camera matrix replaces the camera's
};

/// Reads the camera of a view whose image is `image`, its calibration and its distortion. Warns as doubt_about_unit()
/// does. Throws Error if a file cannot be read, or does not fit the image, or if two of them describe a distortion.
ViewCamera read_view_camera(const ViewSource& source, const Image& image, const Context& context);

/// A view with a plain pinhole camera: a distortion is removed from the image. Throws Error if sizes do not match.
View view_of(const std::string& name, Image image, const ViewCamera& camera);

/// A view, and how exactly its camera is known.
struct ViewAsStated {
  View view;
  geometry::CameraDeviations camera_deviations;
};

/// Reads a view. Throws Error as the functions above do, or if the image cannot be read.
ViewAsStated read_view_files(const ViewSource& source, const Context& context);

}  // namespace marrow::read
