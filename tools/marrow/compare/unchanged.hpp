// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <map>
#include <string>

#include "marrow/compare/cell.hpp"

namespace marrow::cli {

/// Checks that nothing changed while a comparison ran. Each process of a comparison reads the files for itself. If a
/// file changes meanwhile, the processes do not all use the same content.
class Unchanged {
 public:
  /// Reads the files that define the comparison.
  explicit Unchanged(const compare::Experiment& experiment);
  /// Throws Error if something changed, and names it.
  void check(const compare::Dependencies& dependencies) const;

 private:
  const compare::Experiment& experiment_;
  std::map<std::filesystem::path, std::string> texts_;
};

}  // namespace marrow::cli
