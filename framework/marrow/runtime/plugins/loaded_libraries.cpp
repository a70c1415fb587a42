// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/plugins/loaded_libraries.hpp"

#include <cstdint>
#include <filesystem>

namespace marrow {

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

LoadedLibraries::LoadedLibraries(const link_map* any) {
  while (any->l_prev) any = any->l_prev;
  for (const link_map* library = any; library; library = library->l_next) {
    if (!library->l_name || !*library->l_name) continue;  // the program itself
    order_.push_back(library);
    for (const std::string& name :
         {std::filesystem::path(library->l_name).filename().string(), entries_of(library).own_name})
      if (!name.empty()) by_name_.try_emplace(name, library);
  }
}

const link_map* LoadedLibraries::find(const std::string& name) const {
  const auto found = by_name_.find(name);
  return found == by_name_.end() ? nullptr : found->second;
}

}  // namespace marrow
