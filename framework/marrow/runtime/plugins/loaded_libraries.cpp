// SPDX-License-Identifier: Apache-2.0
// What the dynamic loader knows about the libraries of this process.
#include <dlfcn.h>
#include <link.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <set>

#include "marrow/base/framework_file.hpp"
#include "marrow/runtime/plugins/linked_libraries.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;

/// What a loaded library says about itself to the loader.
struct DynamicEntries {
  std::string own_name;
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

}  // namespace marrow
