// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>

#include "marrow/compare/experiment.hpp"

namespace marrow::cli {

/// The folder that a comparison is kept in, new or to be continued. A file in it, the marker, says that it is marrow's
/// and of which experiment: nothing is written into a folder that holds anything else. Locks on the marker, which end
/// with the process however that ends, keep others out.
class ComparisonFolder {
 public:
  enum class Use { alone, with_others };  ///< others that run single cells
  /// Throws Error for a folder that cannot be written to, is not this experiment's, or is in use.
  ComparisonFolder(const std::filesystem::path& folder, const compare::Experiment& experiment, Use use);
  ~ComparisonFolder();
  ComparisonFolder(const ComparisonFolder&) = delete;
  ComparisonFolder& operator=(const ComparisonFolder&) = delete;

  /// Throws Error when another process is at the cell.
  void take_cell(const std::string& id);

 private:
  void open_marker();
  void check_marker(const std::string& name);
  bool lock(long byte, short type, bool wait);

  std::filesystem::path folder_;
  int marker_ = -1;
};

}  // namespace marrow::cli
