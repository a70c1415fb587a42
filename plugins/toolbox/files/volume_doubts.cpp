// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/files/volume_doubts.hpp"

#include <algorithm>
#include <vector>

namespace marrow::files {
namespace {

constexpr float kLeastOfBone = 1200;  ///< in HU + 1024, for the brightest voxel

/// How many of the values lie in a range.
double share(const std::vector<float>& values, float least, float most) {
  const auto count = std::count_if(values.begin(), values.end(), [&](float v) { return v >= least && v <= most; });
  return values.empty() ? 0 : double(count) / double(values.size());
}

bool seems_to_have_offset(const Volume& volume) {
  std::vector<float> above;
  float highest = 0;
  for (const float value : volume.values) {
    if (value < 0) return false;
    if (value > 0) above.push_back(value);
    highest = std::max(highest, value);
  }
  if (highest < kLeastOfBone) return false;
  const double tissue = share(above, 850, 1250);
  const bool is_bone_alone = share(above, 0, 500) < 0.02;
  const bool is_patient = tissue > 0.2 && share(above, 300, 800) < 0.25 * tissue;
  return is_bone_alone || is_patient;
}

}  // namespace

void warn_of_offset(const Volume& volume, const std::filesystem::path& path, double value_offset_hu,
                    const Context& context) {
  if (value_offset_hu != 0 || !seems_to_have_offset(volume)) return;
  context.warn(path.string() +
               ": the CT seems to hold HU + 1024, not Hounsfield units: no value is below 0, and soft tissue and bone "
               "lie about 1024 too high. If so, give value_offset_hu: -1024 (-1000 if 1000 was added); without it, "
               "thresholds and simulated X-ray images are wrong");
}

}  // namespace marrow::files
