// SPDX-License-Identifier: Apache-2.0
#include "keys.hpp"

#include <algorithm>
#include <filesystem>

#include "mapping.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;

/// Hashes the content of a file, or of every file below a folder with its relative name.
void add_path(Hasher& hasher, const std::string& text) {
  const fs::path path(text);
  std::error_code error;
  if (text.empty() || !fs::exists(path, error)) {
    hasher.add(std::string("absent"));  // the node itself says so
    return;
  }
  std::vector<fs::path> files;
  if (fs::is_directory(path, error)) {
    for (fs::recursive_directory_iterator at(path, error), end; !error && at != end; at.increment(error))
      if (at->is_regular_file()) files.push_back(at->path());
    std::sort(files.begin(), files.end());
  } else {
    files.push_back(path);
  }
  for (const fs::path& file : files) {
    hasher.add(fs::relative(file, path, error).generic_string());
    hasher.add(fs::is_regular_file(file) ? file_digest(file) : Digest{});
  }
}

}  // namespace

Digest recipe_of(const PipelineNode& node, const std::vector<Value>& inputs) {
  Hasher hasher;
  hasher.add(node.info.name);
  for (std::size_t i = 0; i < node.options.size(); ++i) {
    const OptionInfo& info = node.info.options[i];
    hasher.add(info.name);
    if (info.type == OptionType::path) {
      add_path(hasher, std::get<std::string>(node.options[i]));
    } else if (info.type == OptionType::paths) {
      for (const std::string& path : std::get<std::vector<std::string>>(node.options[i])) add_path(hasher, path);
    } else {
      std::visit([&](const auto& value) { hasher.add(value); }, node.options[i]);
    }
  }
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    hasher.add(node.info.inputs[i].name);
    hasher.add(key_of(inputs[i]));
  }
  return hasher.digest();
}

Digest result_key(const Digest& recipe, const Digest& build_id, bool random, std::uint64_t seed) {
  Hasher hasher;
  hasher.add(recipe);
  hasher.add(build_id);
  if (random) hasher.add(seed);
  return hasher.digest();
}

std::uint64_t seed_of(const Digest& recipe, std::uint64_t run_seed) {
  Hasher hasher;
  hasher.add(recipe);
  hasher.add(run_seed);
  return hasher.digest().low;
}

}  // namespace marrow
