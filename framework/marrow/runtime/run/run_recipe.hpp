// SPDX-License-Identifier: Apache-2.0
#pragma once
// The recipe of a run: a pipeline file that makes the run again. Pictures and pages carry it.
#include <cstdint>
#include <string>

#include "marrow/base/export.hpp"
#include "marrow/runtime/run/executor.hpp"

namespace MARROW_EXPORT marrow {

/// The keyword of the text in a PNG file that holds a recipe.
inline constexpr const char* kRecipeKeyword = "marrow recipe";

struct RunRecipe {
  std::string version;  ///< of marrow
  std::uint64_t seed = 1;
  FileLimits file_limits;
  std::string pipeline;  ///< resolved_yaml()

  /// The pipeline as a file that `marrow run` takes. Comments above it say the version, and what `marrow run` must be
  /// given besides the file: "--seed 3", and limits for reading files if there were some. It holds no times, no host,
  /// and not the way in which values were given, so a run of this file has the same recipe. What lies in the user's
  /// home folder is written as $env:HOME/..., so the text does not name the user.
  std::string text() const;
};

/// The recipe of a run by this version of marrow.
RunRecipe recipe_of_run(const Pipeline& pipeline, const RunSettings& settings);

}  // namespace marrow
