// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/run/files_read.hpp"

#include "marrow/base/error.hpp"
#include "marrow/runtime/pipeline/named_files.hpp"

namespace marrow {

namespace fs = std::filesystem;

void FilesRead::note(const Contents& contents) {
  const std::scoped_lock lock(mutex_);
  for (const auto& [path, content] : contents) {
    std::error_code error;
    const fs::path real = fs::weakly_canonical(fs::absolute(path, error), error);
    for (const auto& [file, digest] : content.files) note(file, digest, path);
    // A file may have been added to a folder, or removed from it.
    if (!content.is_there)
      note(real, Digest{}, path);
    else if (fs::is_directory(real, error))
      note(real, content.digest, path);
    contents_.try_emplace(path, content);
  }
}

Contents FilesRead::of(const PipelineNode& node) const {
  const std::scoped_lock lock(mutex_);
  Contents result;
  for (const std::string& path : paths_of(node))
    if (const auto found = contents_.find(path); found != contents_.end()) result.insert(*found);
  return result;
}

void FilesRead::note(const fs::path& real, const Digest& content, const std::string& said) {
  const auto [known, is_new] = known_.try_emplace(real, content);
  if (is_new || known->second == content) return;
  throw Error(said +
              " was changed while the run went on: another node read something else there; run it again when nothing "
              "writes to it");
}

std::map<std::string, Digest> contents_of_options(const PipelineNode& node, const Contents& contents) {
  std::map<std::string, Digest> result;
  for (std::size_t i = 0; i < node.options.size(); ++i) {
    std::vector<std::string> paths = paths_of(node, i);
    std::erase(paths, "");
    if (paths.empty()) continue;
    Hasher hasher;
    bool all_there = true;
    for (const std::string& path : paths) {
      const auto found = contents.find(path);
      all_there = all_there && found != contents.end() && found->second.is_there;
      if (all_there) hasher.add(found->second.digest);
    }
    result[node.info.options[i].name] = all_there ? hasher.digest() : Digest{};
  }
  return result;
}

}  // namespace marrow
