// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "marrow/runtime/hash.hpp"
#include "marrow/runtime/kind.hpp"
#include "marrow/runtime/node.hpp"

namespace marrow {

class Plugin;

/// A library that a plugin links, as found when it was described.
struct LinkedLibrary {
  std::string path;
  std::uint64_t size = 0;
};

/// What is known of a plugin library without loading it: the content of its manifest, or why it is refused.
struct LibraryInfo {
  std::filesystem::path file;
  std::string refused;  ///< one sentence; empty for a good library
  std::string note;     ///< a stale or edited manifest that was put right
  Digest digest;        ///< of the file
  Digest build_id;      ///< of its own code, the framework's and the versions of the libraries that it links
  std::vector<LinkedLibrary> linked;
  std::vector<KindInfo> kinds;
  std::vector<NodeInfo> nodes;
  std::vector<WriterInfo> writers;
};

/// Loads a plugin library into this process and registers its kinds and nodes. It is never unloaded. Throws Error with
/// one sentence, also when the library is not the described one: each kind, node and writer that it registers, and each
/// library that it links, must be as described, so that nothing is called with the options of another.
std::unique_ptr<Plugin> load_library(const LibraryInfo& described);

/// Describes a library by loading it in a child process with a time limit, so that one that crashes or hangs does no
/// harm. One that others than the user, root and the owner of marrow could have put there is refused without being
/// loaded, unless MARROW_TRUST_ALL_PLUGINS is 1.
LibraryInfo describe_library(const std::filesystem::path& file);

/// The description of a library: from the manifest beside it when that is whole, trusted and belongs to this very file,
/// else from the user's cache of descriptions, else by describe_library(). `framework` is the digest of the framework's
/// own library. Throws Error, which begins with a verb, for what is no file or not trusted.
LibraryInfo library_info(const std::filesystem::path& file, const Digest& framework);

/// Writes the manifest beside a library. Throws Error when the library is refused or the file cannot be written.
void write_manifest(const LibraryInfo& info);

/// The shared library that this function lies in.
std::filesystem::path framework_file();
/// Of the content of a regular file. Throws Error for anything else, and when the file changes while it is read.
Digest file_digest(const std::filesystem::path& file);

}  // namespace marrow
