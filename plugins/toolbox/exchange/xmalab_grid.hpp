// SPDX-License-Identifier: Apache-2.0
#pragma once
// The files in which XMALab keeps a camera and the distortion that it corrected.
#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "marrow/toolbox/distortion/distortion.hpp"

namespace marrow::exchange {

/// The files of a camera's grid in the folder `data` of an XMALab project: NAME_GridPointsDistorted.csv,
/// NAME_GridPointsReferences.csv and, if not empty, NAME_GridPointsInlier.csv. A line is `u, v` in pixels, or 1 or 0.
struct XmalabGridFiles {
  std::filesystem::path distorted, references, inlier;
};

/// The points of a grid: seen where XMALab detected them, ideal where it put the reference. The size is of the images.
/// Throws Error with the line for a damaged file, and if the files do not have the same number of lines.
distortion::PlatePoints read_xmalab_grid(const XmalabGridFiles& files, int width_px, int height_px);

/// The eight numbers of CAMERA_UndistortionParameter.csv, one a line: OpenCV's k1, k2, p1, p2, k3, k4, k5, k6. Throws
/// Error with the line for a damaged file.
std::vector<double> read_xmalab_parameters(const std::filesystem::path& path);

/// The texts of the three files.
std::string xmalab_distorted(const distortion::PlatePoints& points);
std::string xmalab_references(const distortion::PlatePoints& points);
std::string xmalab_inlier(const distortion::PlatePoints& points);

/// The camera as XMALab exports it ("MayaCam 2.0"): image size, camera matrix, rotation and translation. It is of
/// images without distortion.
std::string xmalab_camera(const Camera& camera);

}  // namespace marrow::exchange
