// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <mutex>

#include "keys.hpp"

namespace marrow {

/// What the nodes of a run found in the files that they read. All of them must find the same: a file that is edited
/// between two nodes would give results that mix both contents. Safe to use from several threads.
class FilesRead {
 public:
  /// Throws Error where something else was found before.
  void note(const Contents& contents);
  /// What was found in those paths of the node that were noted.
  Contents of(const PipelineNode& node) const;

 private:
  void note(const std::filesystem::path& real, const Digest& content, const std::string& said);

  mutable std::mutex mutex_;
  std::map<std::filesystem::path, Digest> known_;
  Contents contents_;
};

/// By option of type path that names something: its content; zero where any of its paths is not among `contents` or not
/// there.
std::map<std::string, Digest> contents_of_options(const PipelineNode& node, const Contents& contents);

}  // namespace marrow
