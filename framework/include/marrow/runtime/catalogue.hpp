// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "marrow/runtime/library.hpp"

namespace marrow {

struct KindDefinition;

/// All kinds and nodes that can be used, known from manifests; a library is loaded when a node of it is first called.
/// Safe to use from several threads once made.
class Catalogue {
 public:
  /// Looks into the folders in their order; the first library that offers a name has it. A library with a node that
  /// breaks the contract of its kind is refused, whichever library brings the kind.
  explicit Catalogue(std::vector<std::filesystem::path> folders = default_folders());
  ~Catalogue();

  /// The folders named in MARROW_PLUGIN_PATH (separated by ':'), then `marrow` beside the framework's library.
  static std::vector<std::filesystem::path> default_folders();

  const std::vector<std::filesystem::path>& folders() const { return folders_; }
  const std::vector<LibraryInfo>& libraries() const { return libraries_; }
  /// Sorted.
  std::vector<std::string> node_names() const;
  /// nullptr when no library offers it.
  const NodeInfo* find(const std::string& name) const;
  const LibraryInfo* library_of(const std::string& name) const;
  /// Sorted: the kinds that libraries bring, and those of nodes whose kind no library brings.
  std::vector<std::string> kind_names() const;
  /// nullptr when no library brings it.
  const KindInfo* find_kind(const std::string& name) const;
  const LibraryInfo* library_of_kind(const std::string& name) const;
  /// Inputs that any node of the kind may be given: the kind's contract and what its known nodes take.
  std::vector<KindPort> ports_of_kind(const std::string& kind) const;
  const WriterInfo* find_writer(const TypeInfo& type) const;

  /// Loads the node's library. Throws Error when that fails.
  const NodeDefinition& load(const std::string& name) const;
  /// Loads the library that brings the kind. Throws Error when that fails.
  const KindDefinition& load_kind(const std::string& name) const;
  const WriterDefinition& load_writer(const TypeInfo& type) const;

 private:
  void find_libraries();
  void enter_names();
  /// Whether there were any; the names must then be entered again.
  bool refuse_broken_contracts();
  const Plugin& load_plugin(std::size_t library) const;

  std::vector<std::filesystem::path> folders_;
  std::vector<LibraryInfo> libraries_;
  struct Entry {
    std::size_t library = 0, index = 0;
  };
  std::map<std::string, Entry> nodes_;
  std::map<std::string, Entry> kinds_;
  std::map<std::string, Entry> writers_;
  mutable std::mutex mutex_;
  mutable std::map<std::size_t, std::unique_ptr<Plugin>> loaded_;
};

}  // namespace marrow
