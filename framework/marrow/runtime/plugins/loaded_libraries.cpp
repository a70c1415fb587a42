// SPDX-License-Identifier: Apache-2.0
// What the dynamic loader knows about the libraries of this process.
#include <dlfcn.h>
#include <link.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <set>
#include <sstream>

#include "marrow/base/framework_file.hpp"
#include "marrow/runtime/plugins/linked_libraries.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;

/// What a loaded library says about itself to the loader.
struct DynamicEntries {
  std::string own_name, run_path;
  bool is_inherited = false;  ///< the older kind of run path, which is also searched for what needed libraries need
  std::vector<std::string> needed;
};

DynamicEntries entries_of(const link_map* library) {
  DynamicEntries entries;
  const char* texts = nullptr;
  for (const ElfW(Dyn)* d = library->l_ld; d && d->d_tag != DT_NULL; ++d)
    if (d->d_tag == DT_STRTAB) texts = reinterpret_cast<const char*>(d->d_un.d_ptr);
  // The kernel's own library has an offset from its beginning there, not an address.
  if (!texts || reinterpret_cast<std::uintptr_t>(texts) < library->l_addr) return entries;
  for (const ElfW(Dyn)* d = library->l_ld; d->d_tag != DT_NULL; ++d) {
    const char* text = texts + d->d_un.d_val;
    if (d->d_tag == DT_SONAME) entries.own_name = text;
    if (d->d_tag == DT_NEEDED) entries.needed.push_back(text);
    if (d->d_tag == DT_RUNPATH) entries.run_path = text, entries.is_inherited = false;
    if (d->d_tag == DT_RPATH && entries.run_path.empty()) entries.run_path = text, entries.is_inherited = true;
  }
  return entries;
}

/// All libraries that are loaded now.
class LoadedLibraries {
 public:
  /// `any`: one of them.
  explicit LoadedLibraries(const link_map* any) {
    while (any->l_prev) any = any->l_prev;
    for (const link_map* library = any; library; library = library->l_next) {
      if (!library->l_name || !*library->l_name) continue;  // the program itself
      order_.push_back(library);
      for (const std::string& name :
           {std::filesystem::path(library->l_name).filename().string(), entries_of(library).own_name})
        if (!name.empty()) by_name_.try_emplace(name, library);
    }
  }
  const std::vector<const link_map*>& in_order() const { return order_; }  ///< of loading
  /// The library that is needed under this name; null if none is loaded.
  const link_map* find(const std::string& name) const {
    const auto found = by_name_.find(name);
    return found == by_name_.end() ? nullptr : found->second;
  }

 private:
  std::vector<const link_map*> order_;
  std::map<std::string, const link_map*> by_name_;
};

std::set<const link_map*> needed_by(const link_map* library, const LoadedLibraries& loaded) {
  std::set<const link_map*> needed;
  for (const std::string& name : entries_of(library).needed)
    if (const link_map* found = loaded.find(name)) needed.insert(found);
  return needed;
}

/// Adds all libraries that a library needs, directly or indirectly. Does not go into libraries that are in `known`
/// already.
void add_all(const link_map* library, const LoadedLibraries& loaded, std::set<const link_map*>& known) {
  for (const link_map* one : needed_by(library, loaded))
    if (known.insert(one).second) add_all(one, loaded, known);
}

std::vector<LinkedLibrary> files_of_loaded(const std::set<const link_map*>& wanted, const LoadedLibraries& loaded) {
  std::vector<LinkedLibrary> files;
  for (const link_map* library : loaded.in_order()) {
    std::error_code error;
    const fs::path real = wanted.contains(library) ? fs::canonical(library->l_name, error) : fs::path();
    if (!real.empty() && !error) files.push_back({real.string(), fs::file_size(real)});
  }
  return files;
}

const link_map* map_of_framework() {
  Dl_info info{};
  link_map* map = nullptr;
  dladdr1(reinterpret_cast<const void*>(&framework_file), &info, reinterpret_cast<void**>(&map), RTLD_DL_LINKMAP);
  return map;
}

/// Parts of a folder that the loader searches before the folder itself, if the processor is of this kind.
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

const std::vector<LinkedLibrary>& framework_libraries() {
  static const std::vector<LinkedLibrary> libraries = [] {
    const link_map* framework = map_of_framework();
    if (!framework) return std::vector<LinkedLibrary>();
    const LoadedLibraries loaded(framework);
    std::set<const link_map*> needed;
    add_all(framework, loaded, needed);
    return files_of_loaded(needed, loaded);
  }();
  return libraries;
}

std::vector<LinkedLibrary> linked_libraries(void* handle) {
  link_map* self = nullptr;
  if (dlinfo(handle, RTLD_DI_LINKMAP, &self) != 0) return {};
  const LoadedLibraries loaded(self);
  const link_map* framework = map_of_framework();
  std::set<const link_map*> all, of_framework, wanted = needed_by(self, loaded);
  if (framework) all.insert(framework), of_framework.insert(framework), add_all(framework, loaded, of_framework);
  add_all(self, loaded, all);
  for (const link_map* library : all)
    if (!of_framework.contains(library)) wanted.insert(library);
  wanted.erase(framework);
  wanted.erase(self);
  return files_of_loaded(wanted, loaded);
}

std::vector<SearchedFolder> run_path_folders(void* handle) {
  link_map* self = nullptr;
  if (dlinfo(handle, RTLD_DI_LINKMAP, &self) != 0) return {};
  return RunPaths(self).folders;
}

}  // namespace marrow
