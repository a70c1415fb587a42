// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "marrow/base/export.hpp"
#include "marrow/runtime/pipeline/pipeline.hpp"

namespace MARROW_EXPORT marrow {

/// A file below a path, with its name relative to the path. The name "." means the path itself.
struct NamedFile {
  std::filesystem::path file;
  std::string name;
  bool is_there = true;  ///< false if it is a link to nothing, or not a regular file
};

/// All regular files that a path names, sorted: the path itself, or all files below it. Empty if there is nothing. A
/// node may open only these files, because only they count in its key. Throws Error if a folder cannot be read, and for
/// links inside a folder that lead out of it or to another folder, because files would be missed.
std::vector<NamedFile> files_named_by(const std::filesystem::path& path);

/// The paths that one of a node's options names; none if it is not of type path.
std::vector<std::string> paths_of(const PipelineNode& node, std::size_t option);
/// The paths that all options of a node name, without empty ones.
std::vector<std::string> paths_of(const PipelineNode& node);

}  // namespace marrow
