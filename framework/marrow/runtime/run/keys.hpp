// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "marrow/runtime/pipeline/pipeline.hpp"
#include "marrow/runtime/store/store.hpp"

namespace MARROW_EXPORT marrow {

/// What a path named when it was hashed.
struct PathContent {
  bool is_there = false;
  Digest digest;  ///< digest of its name and content, or of all files below it with their names
  std::map<std::filesystem::path, Digest> files;  ///< the content of each, by its real path
};
using Contents = std::map<std::string, PathContent>;  ///< by the path as an option has it

/// The content that a path names. A file is read once per process, and again if it may have changed. Throws Error if a
/// file cannot be read, and as files_named_by() does.
PathContent content_of(const std::string& path);

/// The recipe of one call of a node: its name, all of its options and the keys of its inputs. A path counts by the
/// names and contents of everything that it names, and the option version_command by what that command prints, too. The
/// build id is not included, so that a rebuilt plugin draws the
/// same random numbers. `contents` receives what the node's paths named, also if a later path throws Error.
Digest recipe_of(const PipelineNode& node, const std::vector<Value>& inputs, Contents* contents = nullptr);

/// The key of the call's result. It is made from the recipe, the build id, the machine (machine_digest()) and, if the
/// node is random, the run's seed.
Digest result_key(const Digest& recipe, const Digest& build_id, bool random, std::uint64_t seed);

/// The digest of content_of().
Digest path_digest(const std::filesystem::path& path);

/// Digest of the sizes and times of all files that the node's options name. It changes if any file is written to, even
/// if the file has the same content again. Throws Error as files_named_by() does.
Digest states_of_files(const PipelineNode& node);

/// Flushes what programs wrote through memory maps to the files that the node's options name. After that, the first
/// write through a memory map changes the state of the file too. This has no effect for files that are in memory only
/// (tmpfs). Throws Error as files_named_by() does.
void write_back_files(const PipelineNode& node);

/// The key of a function that a call returns.
Digest function_key(const Digest& result, std::size_t output);

/// The value of an option as a text. A path also has the hash of everything that it names, taken from `contents` or, if
/// that does not have it, from the disk.
std::string text_of(const OptionValue& value, OptionType type, const Contents& contents = {});

/// What two results were made from differently, one text for each.
std::vector<std::string> differences(const Provenance& before, const Provenance& now);

/// Why two results differ: "option 'high' is 80, was 75; input 'field' changed". Empty if there is no difference.
std::string difference(const Provenance& before, const Provenance& now);

/// A warning that was kept with a result. Its paths are replaced by those that the node has now, because the same
/// content may be at another place by now.
std::string warning_now(std::string warning, const PipelineNode& node, const Provenance& kept);

/// The seed of a call's random numbers.
std::uint64_t seed_of(const Digest& recipe, std::uint64_t run_seed);

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

/// Whether the option is a command that asks a program for its version: a list of texts with the name version_command.
/// What the command prints counts in the keys of the node's results.
bool asks_for_version(const OptionInfo& option);

/// What the command prints, without blanks at its end. It runs once in this process, and again if the file of the
/// program changes. Empty if the command is empty. Throws Error if it fails or prints nothing.
MARROW_EXPORT_TO_TESTS std::string version_printed(const std::vector<std::string>& command);

/// What the node's program says about its version; empty if it has none, or if the program does not answer.
std::string version_of_program(const PipelineNode& node);

}  // namespace marrow
