// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/plugins/linked_libraries.hpp"

#include <algorithm>
#include <cstring>
#include <map>
#include <mutex>
#include <sstream>

#include "marrow/base/elf_file.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/file_state.hpp"
#include "marrow/base/regular_file.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;

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
