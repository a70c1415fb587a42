// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <vector>

#include "marrow/runtime/pipeline.hpp"
#include "marrow/runtime/store.hpp"

namespace marrow {

/// What a path named when it was hashed.
struct PathContent {
  bool is_there = false;
  Digest digest;  ///< of its name and content, or of all files below it with their names
  std::map<std::filesystem::path, Digest> files;  ///< the content of each, by its real path
};
using Contents = std::map<std::string, PathContent>;  ///< by the path as an option has it

/// Files are read once in a process, and again when they may have changed. Throws Error where a file cannot be read,
/// and as files_named_by() does.
PathContent content_of(const std::string& path);

/// The recipe of one call of a node: its name, all of its options (a path by the names and content of
/// all that it names) and the keys of its inputs. Without the build id, so that a rebuilt plugin draws the same random
/// numbers. `contents` is given what its paths named; also of those before one that throws Error.
Digest recipe_of(const PipelineNode& node, const std::vector<Value>& inputs, Contents* contents = nullptr);

/// The key of its result: the recipe, the build id, the machine (machine_digest()) and, where the node is random, the
/// run's seed.
Digest result_key(const Digest& recipe, const Digest& build_id, bool random, std::uint64_t seed);

/// The digest of content_of().
Digest path_digest(const std::filesystem::path& path);

/// Of the sizes and times of all files that the node's options name: another one where any was written to in the
/// meantime, even if it holds the same again. Throws Error as files_named_by() does.
Digest states_of_files(const PipelineNode& node);

/// Brings what programs wrote through memory to the files that the node's options name: from then on, each first write
/// through memory gives them another state too. Not where files lie in memory alone (tmpfs). Throws Error as
/// files_named_by() does.
void write_back_files(const PipelineNode& node);

/// The key of a function that a call returns.
Digest function_key(const Digest& result, std::size_t output);

/// An option's value in words; of a path, with the hash of all that it names: from `contents`, or as it is now.
std::string text_of(const OptionValue& value, OptionType type, const Contents& contents = {});

/// What makes two results differ: "option 'high' is 80, was 75; input 'field' changed". Empty where nothing does.
std::string difference(const Provenance& before, const Provenance& now);

/// A warning that was kept with a result, with the paths that the node has now: the same content may lie elsewhere by
/// now.
std::string warning_now(std::string warning, const PipelineNode& node, const Provenance& kept);

/// The seed that a call draws from.
std::uint64_t seed_of(const Digest& recipe, std::uint64_t run_seed);

}  // namespace marrow
