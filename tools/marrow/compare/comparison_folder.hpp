// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>

#include "marrow/base/descriptor.hpp"
#include "marrow/compare/experiment.hpp"

namespace marrow::cli {

/// Whether it is the folder of a comparison.
bool is_comparison(const std::filesystem::path& folder);

/// The folder of a comparison, new or to be continued. A file in it, the marker, says that the folder belongs to marrow
/// and to which experiment: its name and its file. An experiment whose file was moved keeps its folder. Nothing is
/// written into a folder with other content. Locks on the marker keep other processes out. They end with the process,
/// even if it crashes.
class ComparisonFolder {
 public:
  enum class Use { alone, with_others };  ///< with_others: together with processes that run single cells
  /// Throws Error if the folder cannot be written, belongs to something else, or is in use.
  ComparisonFolder(const std::filesystem::path& folder, const compare::Experiment& experiment, Use use);

  /// Throws Error if another process runs this cell.
  void take_cell(const std::string& id);

 private:
  void open_marker();
  void check_marker(const compare::Experiment& experiment);
  std::string read_marker() const;
  void write_marker(const std::string& text);
  bool lock(long byte, short type, bool wait);

  std::filesystem::path folder_;
  Descriptor marker_;
};

}  // namespace marrow::cli
