// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "marrow/base/export.hpp"
#include "marrow/runtime/pipeline/pipeline.hpp"

namespace MARROW_EXPORT marrow {

/// A file that a path names. `name` is relative to the path; "." means the path itself.
struct NamedFile {
  std::filesystem::path file;
  std::string name;
  bool is_there = true;  ///< false if it is a link to nothing, or not a regular file
};

/// All files that a path names, sorted by name: the path itself, or all files below it. Empty if the path does not
/// exist. A node may open only these files, because only they count in its key. Throws Error if a folder cannot be
/// read, and for links inside a folder that lead out of it or to a folder, because files would be missed.
std::vector<NamedFile> files_named_by(const std::filesystem::path& path);

/// The paths in one option of a node; none if the option is not of type path or paths.
std::vector<std::string> paths_of(const PipelineNode& node, std::size_t option);
/// The paths in all options of a node, without empty paths.
std::vector<std::string> paths_of(const PipelineNode& node);

}  // namespace marrow
