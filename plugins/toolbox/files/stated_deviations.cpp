// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/files/stated_deviations.hpp"

#include <cmath>
#include <utility>

#include "marrow/base/number_text.hpp"

namespace marrow::files {
namespace {

/// A number within limits, which the fault names.
std::optional<double> number_within(const YamlMap& map, const std::string& key, double least, double most,
                                    const std::string& named) {
  const auto value = map.number(key);
  if (!value || (*value >= least && *value <= most)) return value;
  map.fault(key, named + ": expected " + number(least) + " to " + number(most) + ", got " + number(*value));
  return std::nullopt;
}

}  // namespace

std::optional<StatedNumber> stated_number_within(const YamlMap& map, const std::string& key, double least,
                                                 double most) {
  if (!map.node(key).IsDefined() || !map.node(key).IsMap()) {
    const auto value = number_within(map, key, least, most, key);
    if (!value) return std::nullopt;
    return StatedNumber{*value, std::nullopt};
  }
  const YamlMap both(map.file(), map.node(key), key, {"value", "deviation"});
  const auto value = number_within(both, "value", least, most, key + ": value"),
             deviation = number_within(both, "deviation", 0, most, key + ": deviation");
  if (!value || !deviation) return std::nullopt;
  return StatedNumber{*value, *deviation};
}

geometry::CameraDeviations deviations_by_distances(const StatedNumber& source_to_detector_mm,
                                                   const StatedNumber& source_to_isocentre_mm,
                                                   const StatedNumber& pixel_mm) {
  geometry::CameraDeviations stated;
  if (source_to_detector_mm.deviation || pixel_mm.deviation)
    stated.focal_percent = 100 * std::hypot(source_to_detector_mm.deviation.value_or(0) / source_to_detector_mm.value,
                                            pixel_mm.deviation.value_or(0) / pixel_mm.value);
  stated.source_mm = source_to_isocentre_mm.deviation;
  return stated;
}

geometry::CameraDeviations with_deviations(const YamlMap& map, geometry::CameraDeviations known) {
  if (!map.has("deviations")) return known;
  const YamlMap stated(map.file(), map.node("deviations"), "deviations",
                       {"turn_deg", "shift_mm", "focal_percent", "centre_px", "source_mm"});
  const auto take = [&](const std::string& key, double most, std::optional<double>& deviation) {
    if (!stated.has(key)) return;
    if (deviation)
      return stated.fault(key, key + ": the deviations of the distances already give it; keep one of the two");
    deviation = number_within(stated, key, 0, most, key);
  };
  take("turn_deg", 45, known.turn_deg);
  take("shift_mm", 1000, known.shift_mm);
  take("focal_percent", 50, known.focal_percent);
  take("centre_px", 10000, known.centre_px);
  take("source_mm", 1000, known.source_mm);
  return known;
}

}  // namespace marrow::files
