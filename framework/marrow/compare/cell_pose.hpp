// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "marrow/base/export.hpp"
#include "marrow/domain/verdict.hpp"

namespace MARROW_EXPORT marrow {
namespace compare {

/// A pose that a cell found.
struct CellPose {
  std::string output;                ///< the pipeline's name of it
  std::string item;                  ///< its place along the axes, as "distal"; empty if the output is no list
  std::string target, source;        ///< the frames between which the matrix leads, as "world" and "ct"
  std::array<double, 12> matrix{};   ///< the first three rows of the 4 x 4 matrix, row by row; translations in mm
  std::optional<Judgement> verdict;  ///< the worst of the verdicts on this item, or on the whole run; nothing without
  std::optional<double> failure_probability;  ///< the largest known one of these
  /// One predicted standard deviation: rotations about [deg] and translations along [mm] three axes. Empty if none was
  /// predicted. Nothing for a direction that the images do not determine.
  std::vector<std::optional<double>> deviations;
  bool has_bone_axes = false;  ///< the axes are the bone's frontal, lateral and long ones; else the model's x, y and z

  bool operator==(const CellPose&) const = default;
};

}  // namespace compare
}  // namespace marrow
