// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "marrow/runtime/plugins/library.hpp"

namespace MARROW_EXPORT marrow {

namespace conformance {
struct Suite;
}

/// All kinds and nodes that can be used. They are known from manifests; a library is loaded when its code is first
/// needed. A constructed catalogue is safe to use from several threads.
class Catalogue {
 public:
  /// Searches the folders in their order. If several libraries offer the same name, the first library counts. A library
  /// is refused if one of its nodes breaks the contract of its kind, even if the kind is declared by another library.
  explicit Catalogue(std::vector<std::filesystem::path> folders = default_folders());
  ~Catalogue();

  /// The folders named in MARROW_PLUGIN_PATH (separated by ':'), then the folder `marrow` next to the framework's
  /// library.
  static std::vector<std::filesystem::path> default_folders();

  const std::vector<std::filesystem::path>& folders() const { return folders_; }
  const std::vector<LibraryInfo>& libraries() const { return libraries_; }
  /// Sorted.
  std::vector<std::string> node_names() const;
  /// nullptr if no library offers it.
  const NodeInfo* find(const std::string& name) const;
  const LibraryInfo* library_of(const std::string& name) const;
  /// The nodes that options of CMake leave out of this build, each with its option. A folder of libraries tells them in
  /// its file not_built.json.
  const std::map<std::string, std::string>& not_built() const { return not_built_; }
  /// What to do where no library offers this node: to build it, or to take the node of its kind that has the name as a
  /// choice of an option. Empty if nothing is known of the name.
  std::string remedy_for(const std::string& missing_node) const;
  /// The same; if it is empty, the nearest of the known names.
  std::string hint_for(const std::string& missing_node, const std::vector<std::string>& known) const;
  /// The kinds that libraries declare, and the kinds of nodes whose kind no library declares. Sorted.
  std::vector<std::string> kind_names() const;
  /// nullptr if no library declares it.
  const KindInfo* find_kind(const std::string& name) const;
  const LibraryInfo* library_of_kind(const std::string& name) const;
  /// The inputs that a pipeline may wire for a node of the kind: those of the kind's contract and those of all its
  /// known nodes.
  std::vector<KindPort> ports_of_kind(const std::string& kind) const;
  const WriterInfo* find_writer(const TypeInfo& type) const;
  /// The types of all values that nodes take or make, by their names.
  std::map<std::string, TypeInfo> types() const;

  /// Loads the node's library. Throws Error if that fails.
  const NodeDefinition& load(const std::string& name) const;
  /// Loads the library that has the kind's suite. Throws Error if that fails.
  const conformance::Suite& load_suite(const std::string& kind) const;
  const WriterDefinition& load_writer(const TypeInfo& type) const;

 private:
  void find_libraries();
  void enter_names();
  void enter_not_built();
  /// Returns whether it refused a library. If so, the names must be entered again.
  bool refuse_broken_contracts();
  const Plugin& load_plugin(std::size_t library) const;

  std::vector<std::filesystem::path> folders_;
  std::vector<LibraryInfo> libraries_;
  struct Entry {
    std::size_t library = 0, index = 0;
  };
  std::map<std::string, Entry> nodes_;
  std::map<std::string, Entry> kinds_;
  std::map<std::string, Entry> suites_;         // of kinds that other libraries declare
  std::map<std::string, KindInfo> with_suite_;  // these kinds, with the checks of their suites
  std::map<std::string, Entry> writers_;
  std::map<std::string, std::string> not_built_;
  mutable std::mutex mutex_;
  mutable std::map<std::size_t, std::unique_ptr<Plugin>> loaded_;
};

/// What breaks the contract of the node's kind, one sentence each. `kind` is null if no library declares the kind: its
/// nodes may then have any ports, but are not given the truth. A kind without outputs leaves the outputs to its nodes.
/// A node may have inputs and outputs that its kind does not have.
std::vector<std::string> contract_faults(const NodeInfo& node, const KindInfo* kind);

/// Types as a text: "view", "list of view over view", "outline_projector or radiograph_projector".
std::string types_text(const std::vector<TypeInfo>& types, const std::string& axis);

}  // namespace marrow
