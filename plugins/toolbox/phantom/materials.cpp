// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/phantom/materials.hpp"

#include "marrow/base/error.hpp"

namespace marrow::phantom {
namespace {

Spectrum mixed(double first_share, const Spectrum& first, const Spectrum& second) {
  Spectrum result;
  for (std::size_t e = 0; e < result.size(); ++e) result[e] = first_share * first[e] + (1 - first_share) * second[e];
  return result;
}

}  // namespace

const std::vector<Material>& materials() {
  // Metals, plastic and carbon: mass attenuation coefficients at 40, 50, 60 and 80 keV (Hubbell and Seltzer, NIST IR
  // 5632), at 70 keV along a power law between 60 and 80 keV, times the density.
  static const std::vector<Material> all{
      {"fat", kFatPerMm, -100},
      {"muscle", kMusclePerMm, 50},
      {"blood", mixed(0.02, kBonePerMm, kMusclePerMm), 60},
      {"cortical bone", kBonePerMm, 1450},
      {"cancellous bone", mixed(0.22, kBonePerMm, kMarrowPerMm), 0.22 * 1450 - 0.78 * 20},
      {"calcified wall", mixed(0.5, kBonePerMm, kMusclePerMm), 750},
      {"titanium", {0.9985, 0.5471, 0.3455, 0.2456}, kLargestHu, true},  // 4.51 g/cm3
      {"steel", {2.867, 1.547, 0.952, 0.652}, kLargestHu, true},         // as iron, 7.9 g/cm3
      {"copper", {4.356, 2.341, 1.427, 0.962}, kLargestHu, true},        // 8.96 g/cm3
      {"plastic", {0.02797, 0.02468, 0.02290, 0.02177}, 120},            // acrylic, 1.19 g/cm3
      {"carbon", {0.03322, 0.02994, 0.02805, 0.02680}, 400},             // laminate of carbon fibre, 1.6 g/cm3
  };
  return all;
}

const Material& material(const std::string& name) {
  for (const Material& one : materials())
    if (one.name == name) return one;
  std::string known;
  for (const Material& one : materials()) known += (known.empty() ? "" : ", ") + std::string(one.name);
  throw Error("there is no material '" + name + "'; there are: " + known);
}

}  // namespace marrow::phantom
