// SPDX-License-Identifier: Apache-2.0
#pragma once
// How exactly a camera is known, as a camera file or a case says it.
#include <optional>
#include <string>

#include "marrow/toolbox/files/strict_yaml.hpp"
#include "marrow/toolbox/geometry/camera_deviations.hpp"

namespace marrow::files {

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

}  // namespace marrow::files
