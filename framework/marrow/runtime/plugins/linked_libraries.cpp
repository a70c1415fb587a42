// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/plugins/linked_libraries.hpp"

#include <dlfcn.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <mutex>
#include <set>
#include <sstream>

#include "marrow/base/error.hpp"
#include "marrow/base/file_state.hpp"
#include "marrow/base/framework_file.hpp"
#include "marrow/base/regular_file.hpp"
#include "marrow/runtime/plugins/build_note.hpp"
#include "marrow/runtime/plugins/loaded_libraries.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;

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

Digest identity_of_package(const std::string& path, const FileState& state) try {
  Hasher hasher;
  const std::string note = build_note(RegularFile(path));
  hasher.add(note);
  hasher.add(std::int64_t(state.size));
  if (note.empty()) hasher.add(std::int64_t(state.written.tv_sec)), hasher.add(std::int64_t(state.written.tv_nsec));
  return hasher.digest();
} catch (const Error& error) {
  throw Error(path + " " + error.what());
}

std::string variable(const char* name) {
  const char* text = std::getenv(name);
  return text ? text : "";
}

std::string without_version(const std::string& name) { return name.substr(0, name.find(".so") + 3); }

std::vector<fs::path> folders_of(const std::string& search_path) {
  std::vector<fs::path> folders;
  std::istringstream stream(search_path);
  for (std::string folder; std::getline(stream, folder, ':');) folders.emplace_back(folder.empty() ? "." : folder);
  return folders;
}

std::vector<fs::path> libraries_in(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error))
    if (at->path().filename().string().find(".so") != std::string::npos) files.push_back(at->path());
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace

std::vector<fs::path> paths_of(const std::vector<LinkedLibrary>& libraries) {
  std::vector<fs::path> paths;
  for (const LinkedLibrary& library : libraries) paths.emplace_back(library.path);
  return paths;
}

bool is_of_the_system(const std::string& file) {
  return (file.starts_with("/usr/") && !file.starts_with("/usr/local/")) || file.starts_with("/lib");
}

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

Digest identity_of(const LinkedLibrary& library) {
  const std::optional<FileState> state = state_of(library.path);
  if (!state) throw Error(library.path + " cannot be read: " + std::strerror(errno));
  struct Known {
    FileState state;
    Digest identity;
  };
  static std::mutex mutex;
  static std::map<std::string, Known> known;
  const std::scoped_lock lock(mutex);
  const auto found = known.find(library.path);
  if (found != known.end() && found->second.state == *state) return found->second.identity;
  const Digest identity =
      is_of_the_system(library.path) ? identity_of_package(library.path, *state) : file_digest(library.path);
  known[library.path] = {*state, identity};
  return identity;
}

const std::vector<Digest>& framework_identities() {
  static const std::vector<Digest> identities = [] {
    std::vector<Digest> found;
    for (const LinkedLibrary& library : framework_libraries()) found.push_back(identity_of(library));
    return found;
  }();
  return identities;
}

std::string found_before(const LinkedLibrary& library) {
  struct Found {
    std::string search_path;
    std::multimap<std::string, fs::path> files;
  };
  static std::mutex mutex;
  static Found found;
  const std::string search_path = variable("LD_LIBRARY_PATH");
  const std::scoped_lock lock(mutex);
  if (found.search_path != search_path) {
    found = {search_path, {}};
    for (const fs::path& folder : folders_of(search_path))
      for (const fs::path& file : libraries_in(folder)) found.files.emplace(without_version(file.filename()), file);
  }
  const auto [begin, end] = found.files.equal_range(without_version(fs::path(library.path).filename()));
  for (auto at = begin; at != end; ++at) {
    std::error_code error;
    if (fs::canonical(at->second, error) != library.path && !error) return at->second.string();
  }
  return "";
}

Digest search_digest() {
  Hasher hasher;
  for (const char* name : {"LD_LIBRARY_PATH", "LD_PRELOAD"}) hasher.add(variable(name));
  for (const fs::path& folder : folders_of(variable("LD_LIBRARY_PATH")))
    for (const fs::path& file : libraries_in(folder)) hasher.add(file.string());
  return hasher.digest();
}

}  // namespace marrow
