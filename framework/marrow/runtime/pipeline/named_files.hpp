// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "marrow/base/strict_yaml.hpp"
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

/// Digest of the content of a file, or of all files below a folder and their relative names. By it, what a run wrote is
/// recognised even in a folder that was moved. Throws Error if something cannot be read.
Digest content_of(const std::filesystem::path& path);

/// The file that the last file of a chain extends. `name`: the value of its key `extends`; a relative path starts at
/// the folder of that file. If there is no such file, if it is in the chain already, or if the chain is too long,
/// reports a fault and returns nothing.
std::optional<std::filesystem::path> extended_file(StrictYaml& yaml, const YAML::Node& name,
                                                   const std::vector<std::filesystem::path>& chain);

/// The hint for a YAML file that is not there: the nearest name of a YAML file in its folder, or nothing.
std::string nearest_file(const std::filesystem::path& missing);

}  // namespace marrow
