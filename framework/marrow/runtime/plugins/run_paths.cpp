// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/plugins/run_paths.hpp"
#include "marrow/base/framework_file.hpp"

#include <dlfcn.h>

#include <algorithm>
#include <set>
#include <sstream>

#include "marrow/runtime/plugins/linked_libraries.hpp"
#include "marrow/runtime/plugins/loaded_libraries.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;

/// Folders in which the loader looks before a folder itself, where the processor is of this kind.
constexpr const char* kVariants[] = {"glibc-hwcaps/x86-64-v4", "glibc-hwcaps/x86-64-v3", "glibc-hwcaps/x86-64-v2", ""};

/// The folders of a run path. $ORIGIN is the folder of the library.
std::vector<std::string> folders_of_run_path(const std::string& run_path, const fs::path& library) {
  std::vector<std::string> folders;
  std::istringstream stream(run_path);
  for (std::string folder; std::getline(stream, folder, ':');) {
    for (const std::string name : {"${ORIGIN}", "$ORIGIN"})
      for (std::size_t at; (at = folder.find(name)) != std::string::npos;)
        folder.replace(at, name.size(), library.parent_path().string());
    if (folder.empty() || folder[0] != '/') continue;  // where a relative one leads depends on the working folder
    for (const char* variant : kVariants) folders.push_back((fs::path(folder) / variant).lexically_normal().string());
  }
  return folders;
}

class RunPaths {
 public:
  explicit RunPaths(const link_map* library) : loaded_(library) {
    for (const LinkedLibrary& one : framework_libraries()) known_before_.insert(one.path);
    known_before_.insert(framework_file().string());
    add(library, {});
  }
  std::vector<SearchedFolder> folders;

 private:
  void add(const link_map* library, std::vector<std::string> inherited) {
    if (!visited_.insert(library).second) return;
    const DynamicEntries entries = entries_of(library);
    const std::vector<std::string> own = folders_of_run_path(entries.run_path, library->l_name);
    if (entries.is_inherited) inherited.insert(inherited.begin(), own.begin(), own.end());
    for (const std::string& name : entries.needed) {
      const link_map* found = loaded_.find(name);
      if (!found) continue;
      std::error_code error;
      const fs::path file = fs::canonical(found->l_name, error);
      if (error || known_before_.contains(file.string())) continue;
      note(name, file, entries.run_path.empty() || entries.is_inherited ? inherited : own);
      add(found, inherited);
    }
  }
  void note(const std::string& name, const fs::path& file, const std::vector<std::string>& searched) {
    for (const std::string& path : searched) {
      std::error_code error;
      if (fs::canonical(fs::path(path) / name, error) == file && !error) return;
      auto folder = std::find_if(folders.begin(), folders.end(), [&](const auto& one) { return one.path == path; });
      if (folder == folders.end()) folder = folders.insert(folders.end(), SearchedFolder{path, {}});
      if (std::find(folder->names.begin(), folder->names.end(), name) == folder->names.end())
        folder->names.push_back(name);
    }
  }

  const LoadedLibraries loaded_;
  std::set<std::string> known_before_;
  std::set<const link_map*> visited_;
};

}  // namespace

std::vector<SearchedFolder> run_path_folders(void* handle) {
  link_map* self = nullptr;
  if (dlinfo(handle, RTLD_DI_LINKMAP, &self) != 0) return {};
  return RunPaths(self).folders;
}

}  // namespace marrow
