// SPDX-License-Identifier: Apache-2.0
#pragma once
// Projection data of xReg in HDF5: for each X-ray image its camera, and where it shows landmarks.
#include <filesystem>
#include <string>
#include <vector>

#include "marrow/toolbox/exchange/cameras.hpp"

namespace marrow::exchange {

/// A landmark as an image shows it.
struct ShownLandmark {
  std::string name;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
};

/// A camera as xReg keeps it. In the frame "origin-at-focal-pt-det-pos-z" it is as marrow's; in the two other
/// frames the images are seen from the detector: the camera looks along -z, or its origin is on the detector and z runs
/// to the source. Pixels count from the centre of the first one, (column, row).
struct XregProjection {
  int width_px = 0, height_px = 0;
  double column_spacing_mm = 0, row_spacing_mm = 0;
  std::string frame;  ///< the file's word
  Eigen::Matrix3d intrinsic = Eigen::Matrix3d::Identity();
  Eigen::Matrix4d extrinsic = Eigen::Matrix4d::Identity();  ///< camera from world, mm
  std::vector<ShownLandmark> landmarks;                     ///< ordered by name
};

/// All projections of the file, without the images; or the one camera of a file that holds only that. Throws Error with
/// the key of a value that is missing, has another shape or type, or cannot be that of a camera.
std::vector<XregProjection> read_xreg(const std::filesystem::path& path);

/// The camera, and the landmarks, of a projection whose image is turned over as `mirror` says. `what` names the
/// projection. Throws Error as camera_of() does.
Camera camera_of(const XregProjection& projection, Mirror mirror, const std::string& what);
std::vector<ShownLandmark> landmarks_of(const XregProjection& projection, Mirror mirror);

/// A projection for a camera of marrow, in the frame that needs no turning over, with these landmarks.
XregProjection xreg_projection(const Camera& camera, const Eigen::Vector2d& pixel_mm,
                               std::vector<ShownLandmark> landmarks);
/// A whole file with these projections, without images. The same values give the same bytes.
std::string xreg_bytes(const std::vector<XregProjection>& projections);

}  // namespace marrow::exchange
