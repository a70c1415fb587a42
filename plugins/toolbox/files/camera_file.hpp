// SPDX-License-Identifier: Apache-2.0
#pragma once
// Cameras in files of marrow and XMALab, and as other systems give them: a projection matrix, or a source and a
// detector in the world. Lengths that no bone or device has, and the unit that they are likely in.
#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>

#include "marrow/domain/calibration.hpp"
#include "marrow/toolbox/distortion/distortion.hpp"
#include "marrow/toolbox/files/strict_yaml.hpp"
#include "marrow/toolbox/geometry/camera_deviations.hpp"

namespace marrow::files {

/// A camera as read from its file: the pinhole model, how exactly it is known, and the distortion that is still in its
/// images: the radial one of the base or a measured one, not both.
struct CameraInFile : DistortedCamera {
  distortion::Distortion measured;
  geometry::CameraDeviations deviations{};  ///< how exactly it is known

  bool is_distorted() const { return !distortion.is_none() || !measured.is_none(); }
};

/// Removes the camera's distortion, if there is one, from a view with its image. Throws Error as
/// marrow::remove_distortion() or distortion::straighten() does.
void straighten(View& view, const CameraInFile& camera);
/// The mask of the straight image, as straightened_mask() makes it.
cv::Mat1b straightened_mask(const cv::Mat1b& original, const CameraInFile& camera);
/// The mask of the original image, as original_mask() makes it.
cv::Mat1b original_mask(const cv::Mat1b& straight, const CameraInFile& camera);

/// Reads a camera from marrow's YAML (.yaml, .yml) or from XMALab's text (any other extension). The text has four
/// blocks "image size", "camera matrix", "rotation" and "translation", with numbers separated by commas. x_camera = R
/// x_world + t in mm, in OpenCV's pixel convention. Only the YAML can hold a distortion. Throws Error if the file
/// cannot be read, or for missing or wrong values.
CameraInFile read_camera_file(const std::filesystem::path& path);

/// A number with its standard deviation, if that is stated.
struct StatedNumber {
  double value = 0;
  std::optional<double> deviation;
};
/// From `key: 1000` or `key: {value: 1000, deviation: 20}`. The value lies within the limits, and the deviation is not
/// negative. Faults are noted in the map's file.
std::optional<StatedNumber> stated_number_within(const YamlMap& map, const std::string& key, double least, double most);

/// What a C-arm's distances state: errors of the distance to the detector and of the pixels change the focal length.
geometry::CameraDeviations deviations_by_distances(const StatedNumber& source_to_detector_mm,
                                                   const StatedNumber& source_to_isocentre_mm,
                                                   const StatedNumber& pixel_mm);

/// The key `deviations` of `map`, if there is one: turn_deg, shift_mm, focal_percent, centre_px and source_mm, together
/// with what is known already. Stating an error twice is a fault.
geometry::CameraDeviations with_deviations(const YamlMap& map, geometry::CameraDeviations known);

using Projection = Eigen::Matrix<double, 3, 4>;

/// A camera whose image is `size_px` large, and whether only the mirrored image has such a camera. Then its camera
/// matrix has a negative first focal length.
struct ProjectionCamera {
  Camera camera;
  bool is_mirrored = false;
};
/// The camera with pixel ~ P (x, 1); any scale, but the third coordinate must be positive in front of the source.
/// Pixels count from the centre of the first one. std::nullopt if P does not project along rays from a source.
std::optional<ProjectionCamera> camera_of_projection(const Projection& pixel_from_world,
                                                     const Eigen::Vector2i& size_px);

/// A source and a flat detector in world coordinates: the centre of the first pixel, and the unit directions in which
/// columns and rows are counted, at right angles to each other.
struct Detector {
  Eigen::Vector3d source_mm, corner_mm, columns, rows;
  Eigen::Vector2d pixel_mm;  ///< width and height of a pixel
};
/// Its projection: the ray from the source through x meets the detector at corner + u columns + v rows. The source must
/// not lie in the detector's plane.
Projection projection_of(const Detector& detector);

/// The sentence part "; looks like cm: give scale: 10" for a length that was read with `scale` and lies outside of
/// `least_mm` to `most_mm`. It names the first of cm, m, inches and micrometres in which the length would lie within;
/// empty if there is none.
std::string likely_unit(double length_mm, double least_mm, double most_mm, double scale);

/// A sentence if no X-ray device has the distance between this camera's source and the world's origin. Empty if the
/// distance is possible, or 0. `scale`: the one with which the camera was read.
std::string doubt_about_distance(const Camera& camera, double scale);

/// A distortion from the keys width_px, height_px, degree, terms_px, lattice, area_px, residual_px and validated_px.
/// All but the lattice are required. Faults are noted in `file`.
std::optional<distortion::Distortion> distortion_from(const YAML::Node& node, YamlFile& file);

/// Reads a distortion file in the format that marrow writes. Throws Error with all faults.
distortion::Distortion read_distortion_file(const std::filesystem::path& path);

/// The file that read_distortion_file() reads back without loss.
std::string distortion_text(const distortion::Distortion& distortion);

}  // namespace marrow::files
