// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the simulated bodies are made of.
#include <array>
#include <string>
#include <string_view>
#include <vector>

namespace marrow::phantom {

/// The energies at which attenuation is given: 40, 50, 60, 70 keV.
using Spectrum = std::array<double, 4>;

/// Linear attenuation of tissue per mm (ICRP 110 materials of the MC-GPU tables).
constexpr Spectrum kBonePerMm{0.1235, 0.07937, 0.05934, 0.04871};
constexpr Spectrum kMarrowPerMm{0.02649, 0.02277, 0.02082, 0.01959};
constexpr Spectrum kMusclePerMm{0.02840, 0.02390, 0.02161, 0.02020};
constexpr Spectrum kFatPerMm{0.02299, 0.02032, 0.01886, 0.01789};

struct Material {
  std::string_view name;
  Spectrum per_mm;
  double hu;  ///< in a CT; metal is far beyond the largest value of a scanner and is cut to it
  bool is_metal = false;
};

/// The largest value of a CT of 12 bits.
constexpr double kLargestHu = 3071;

const std::vector<Material>& materials();
/// Throws Error if there is no material of this name.
const Material& material(const std::string& name);

}  // namespace marrow::phantom
