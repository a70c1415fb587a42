// SPDX-License-Identifier: Apache-2.0
// What the dynamic loader knows about the libraries of this process.
#include <dlfcn.h>
#include <link.h>

#include <fcntl.h>
#include <spawn.h>
#include <sys/auxv.h>
#include <sys/wait.h>
#include <unistd.h>
#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <map>
#include <mutex>
#include <set>
#include <sstream>
#include <string>

#include "marrow/base/descriptor.hpp"
#include "marrow/base/framework_file.hpp"
#include "marrow/base/regular_file.hpp"
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

/// The program that loads libraries; it is a part of each process.
std::string loader_of_system() {
  Dl_info info{};
  const auto begin = reinterpret_cast<const void*>(getauxval(AT_BASE));
  return begin && dladdr(begin, &info) && info.dli_fname ? info.dli_fname : "";
}

/// What a program prints; empty if it cannot be started.
std::string output_of(const std::vector<std::string>& command) {
  Pipe pipe = open_pipe();
  if (!pipe.read_end.is_open()) return "";
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, pipe.write_end, STDOUT_FILENO);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  std::vector<char*> arguments;
  for (const std::string& text : command) arguments.push_back(const_cast<char*>(text.c_str()));
  arguments.push_back(nullptr);
  pid_t process = -1;
  const int fault = posix_spawn(&process, arguments[0], &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  pipe.write_end.close();
  std::string output;
  std::array<char, 4096> buffer;
  for (ssize_t count = 0;
       !fault && (count = read(pipe.read_end, buffer.data(), buffer.size())) != 0 && (count > 0 || errno == EINTR);)
    if (count > 0) output.append(buffer.data(), std::size_t(count));
  while (!fault && waitpid(process, nullptr, 0) < 0 && errno == EINTR) continue;
  return output;
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

std::vector<fs::path> libraries_to_load(const fs::path& library) {
  std::vector<fs::path> found;
  const std::string loader = loader_of_system();
  if (loader.empty()) return found;
  std::istringstream lines(output_of({loader, "--list", fs::absolute(library).string()}));
  for (std::string line; std::getline(lines, line);) {  // "\tNAME => PATH (0xADDRESS)", or only "\tPATH (0xADDRESS)"
    const std::size_t arrow = line.find(" => "), begin = arrow == std::string::npos ? 1 : arrow + 4,
                      end = line.rfind(" (0x");
    if (end != std::string::npos && begin < end && line[begin] == '/') found.push_back(line.substr(begin, end - begin));
  }
  return found;
}

std::vector<fs::path> paths_of(const std::vector<LinkedLibrary>& libraries) {
  std::vector<fs::path> paths;
  for (const LinkedLibrary& library : libraries) paths.emplace_back(library.path);
  return paths;
}

bool is_of_the_system(const std::string& file) {
  return (file.starts_with("/usr/") && !file.starts_with("/usr/local/")) || file.starts_with("/lib");
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
