// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <map>
#include <string>

#include "marrow/compare/cell.hpp"

namespace marrow::cli {

/// Each process of a comparison reads for itself what it needs: where that changes meanwhile, not all go by the same.
class Unchanged {
 public:
  /// Reads the files that say what is run.
  explicit Unchanged(const compare::Experiment& experiment);
  /// Throws Error, which names what changed.
  void check(const compare::Dependencies& dependencies) const;

 private:
  const compare::Experiment& experiment_;
  std::map<std::filesystem::path, std::string> texts_;
};

}  // namespace marrow::cli
