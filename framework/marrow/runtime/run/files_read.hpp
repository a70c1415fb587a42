// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <mutex>

#include "marrow/runtime/run/keys.hpp"

namespace marrow {

/// The contents that the nodes of a run found in their files. All nodes must find the same content: if a file is edited
/// between two nodes, the results would mix both contents. Safe to use from several threads.
class FilesRead {
 public:
  /// Adds contents. Throws Error if another content was found before.
  void note(const Contents& contents);
  /// The noted contents of the node's paths.
  Contents of(const PipelineNode& node) const;

 private:
  void note(const std::filesystem::path& real, const Digest& content, const std::string& said);

  mutable std::mutex mutex_;
  std::map<std::filesystem::path, Digest> known_;
  Contents contents_;
};

/// The content of each option of type path that names something. It is zero if any of the option's paths is missing on
/// disk or in `contents`.
std::map<std::string, Digest> contents_of_options(const PipelineNode& node, const Contents& contents);

}  // namespace marrow
