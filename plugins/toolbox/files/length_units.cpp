// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/files/length_units.hpp"

#include "marrow/base/number_text.hpp"

namespace marrow::files {

std::string likely_unit(double length_mm, double least_mm, double most_mm, double scale) {
  static constexpr struct {
    const char* name;
    double mm;
  } kUnits[] = {{"cm", 10}, {"m", 1000}, {"inches", 25.4}, {"micrometres", 0.001}};
  for (const auto& unit : kUnits)
    if (length_mm * unit.mm >= least_mm && length_mm * unit.mm <= most_mm)
      return formatted("; looks like {}: give scale: {:.6g}", unit.name, scale * unit.mm);
  return {};
}

std::string doubt_about_distance(const Camera& camera, double scale) {
  constexpr double kNearest_mm = 200, kFarthest_mm = 5000, kItself_mm = 1e-6;
  const double distance_mm = source_position_mm(camera).norm();
  if (distance_mm < kItself_mm || (distance_mm >= kNearest_mm && distance_mm <= kFarthest_mm)) return {};
  return formatted("the X-ray source is {:.4g} mm from the world's origin, where devices have 200 to 5000",
                   distance_mm) +
         likely_unit(distance_mm, kNearest_mm, kFarthest_mm, scale);
}

}  // namespace marrow::files
