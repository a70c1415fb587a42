// SPDX-License-Identifier: Apache-2.0
#include "patient_orientation.hpp"

namespace marrow::files {
namespace {

/// The direction in patient coordinates for letters such as "L" or "LA". Each letter has half the weight of the one
/// before.
std::optional<Eigen::Vector3d> direction_of(const std::string& letters) {
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();
  double weight = 1;
  for (const char letter : letters) {
    const std::string known = "LRPAHF";
    const std::size_t at = known.find(letter);
    if (at == std::string::npos) return std::nullopt;
    direction[Eigen::Index(at / 2)] += at % 2 == 0 ? weight : -weight;
    weight *= 0.5;
  }
  if (direction.isZero()) return std::nullopt;
  return direction.normalized();
}

}  // namespace

std::optional<PatientOrientation> patient_orientation(const DicomHeader& header) {
  const auto text = header.text(kPatientOrientation);
  if (!text) return std::nullopt;
  const std::size_t between = text->find('\\');
  if (between == std::string::npos) return std::nullopt;
  const auto right = direction_of(text->substr(0, between)), down = direction_of(text->substr(between + 1));
  if (!right || !down) return std::nullopt;
  return PatientOrientation{*text, *right, *down};
}

}  // namespace marrow::files
