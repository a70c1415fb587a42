// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <map>
#include <string>

#include "marrow/compare/cell.hpp"

namespace marrow::cli {

/// Checks that nothing changed while a comparison ran. Each process of a comparison reads the files itself. If a file
/// changes meanwhile, not all processes use the same content.
class Unchanged {
 public:
  enum class Cases { all, held_out };
  /// Reads the files that define the comparison. If the experiment tunes options, it may have all of its cases, or only
  /// those that are held out.
  explicit Unchanged(const compare::Experiment& experiment, Cases cases = Cases::held_out);
  /// Throws Error if something changed, and names it.
  void check(const compare::Dependencies& dependencies) const;

 private:
  const compare::Experiment& experiment_;
  Cases cases_;
  std::map<std::filesystem::path, std::string> texts_;
};

}  // namespace marrow::cli
