// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "marrow/runtime/pipeline.hpp"

namespace marrow {

/// A file below a path, with its name from there; ".": the path itself.
struct NamedFile {
  std::filesystem::path file;
  std::string name;
  bool is_there = true;  ///< false for a link that leads nowhere
};

/// All regular files that a path names: itself, or all below it, sorted. Empty where there is nothing. A node may open
/// these and no other, since they are what its key counts. Throws Error for what would be missed: a folder that cannot
/// be read, and links inside a folder that lead out of it or to another folder.
std::vector<NamedFile> files_named_by(const std::filesystem::path& path);

/// The texts of one of a node's options; none where it is not of type path.
std::vector<std::string> paths_of(const PipelineNode& node, std::size_t option);
/// The texts of a node's options of type path that name something.
std::vector<std::string> paths_of(const PipelineNode& node);

}  // namespace marrow
