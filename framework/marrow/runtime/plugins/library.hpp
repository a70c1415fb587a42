// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "marrow/runtime/node/node.hpp"

namespace MARROW_EXPORT marrow {

class Plugin;

/// A library that a plugin links, as it was when the plugin was described.
struct LinkedLibrary {
  std::string path;
  std::uint64_t size = 0;
  using fields = Fields<&LinkedLibrary::path, &LinkedLibrary::size>;
};

/// What is known about a plugin library without loading it: the content of its manifest, or why it is refused.
struct LibraryInfo {
  std::filesystem::path file;
  std::string refused;  ///< one sentence; empty for a good library
  std::string note;     ///< says that a stale or edited manifest was not used
  Digest digest;        ///< digest of the file
  Digest build_id;  ///< digest of its own file, the framework's, and the builds of the libraries that these two link
  std::vector<LinkedLibrary> linked;
  std::vector<KindInfo> kinds;
  std::vector<NodeInfo> nodes;
  std::vector<WriterInfo> writers;
  using fields = Fields<&LibraryInfo::file, &LibraryInfo::refused, &LibraryInfo::note, &LibraryInfo::digest,
                        &LibraryInfo::build_id, &LibraryInfo::linked, &LibraryInfo::kinds, &LibraryInfo::nodes,
                        &LibraryInfo::writers>;
};

/// Loads a plugin library into this process and registers its kinds and nodes. It is never unloaded. Throws Error with
/// one sentence if it cannot be loaded or is not as `described`: each kind, node and writer that it registers, and each
/// library that it links, must match. Otherwise a node could be called with the options of another version.
std::unique_ptr<Plugin> load_library(const LibraryInfo& described);

/// Describes a library by loading it in a child process with limits of time and memory, so that a library that crashes
/// or hangs does no harm. A library is refused without being loaded if somebody other than the user, root and the owner
/// of marrow could have put it there, unless MARROW_TRUST_ALL_PLUGINS is 1.
LibraryInfo describe_library(const std::filesystem::path& file);

/// The description of a library. It comes from the manifest next to the library, if that is whole, trusted and belongs
/// to this very file; else from the user's cache of descriptions; else from describe_library(). `framework` is the
/// digest of the framework's own library. Throws Error, with a text that begins with a verb, if the file is not a
/// regular file or is not trusted.
LibraryInfo library_info(const std::filesystem::path& file, const Digest& framework);

/// Writes the manifest next to a library. Throws Error if the library's name does not end in .so, if another file than
/// a manifest has the manifest's name, or if the manifest cannot be written.
void write_manifest(const LibraryInfo& info);

}  // namespace marrow
