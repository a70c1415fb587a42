// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/plugins/library_index.hpp"

#include <unistd.h>

#include <cstdlib>
#include <ctime>

#include "marrow/base/framework_file.hpp"
#include "marrow/base/regular_file.hpp"
#include "marrow/runtime/plugins/descriptions.hpp"
#include "marrow/runtime/plugins/library_fields.hpp"
#include "marrow/runtime/plugins/linked_libraries.hpp"
#include "marrow/runtime/plugins/python_file.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;
constexpr std::size_t kMostIndex_bytes = 256 << 20;
constexpr std::int64_t kResolution_s = 2;  // of the times of a file system, at most

Digest digest_of_state(const std::optional<FileState>& state) {
  if (!state) return {};
  Hasher hasher;
  state->add_to(hasher);
  return hasher.digest();
}

/// Whether a later change of the file will show, and none was made since `begun_s`.
bool can_be_watched(const fs::path& file, const FileState& state, std::int64_t begun_s) {
  return is_settled(file, state) && state.changed.tv_sec < begun_s - kResolution_s;
}

/// The files of the framework and of what it links. Another build of it may describe libraries in another way.
std::vector<std::string> files_of_framework() {
  std::vector<std::string> files{framework_file().string()};
  for (const LinkedLibrary& library : framework_libraries()) files.push_back(library.path);
  return files;
}

/// What all descriptions depend on: marrow itself, the user, and the environment of the loader.
Digest surroundings() {
  static const Digest framework = [] {
    Hasher hasher;
    for (const std::string& file : files_of_framework()) hasher.add(file), hasher.add(digest_of_state(state_of(file)));
    return hasher.digest();
  }();
  return hash_of(framework, search_digest(), std::uint64_t(geteuid()), all_are_trusted());
}

std::string name_of_index(const fs::path& folder) {
  const fs::path without_slash = fs::absolute(folder / "library").parent_path();
  return hash_of(without_slash.string(), framework_file().string()).hex() + ".index";
}

struct Sealed {
  Digest checksum, surroundings;  // the checksum is of all that follows it
  using fields = Fields<&Sealed::checksum, &Sealed::surroundings>;
};

}  // namespace

LibraryIndex::LibraryIndex(const fs::path& folder) : name_(name_of_index(folder)), begun_s_(std::time(nullptr)) {
  const std::optional<std::string> text = own_cached_text(name_, kMostIndex_bytes);
  if (!text || text->size() < 2 * sizeof(Digest)) return;
  try {
    Unpacker unpacker(*text);
    const Sealed sealed = unpacker.get<Sealed>();
    if (sealed.checksum != hash_of_bytes(text->data() + sizeof(Digest), text->size() - sizeof(Digest)) ||
        sealed.surroundings != surroundings())
      return;
    unpacker.read(libraries_);
  } catch (const Error&) {
    libraries_.clear();
  }
}

Digest LibraryIndex::state_of_file(const std::string& path) {
  const auto [known, is_new] = states_.try_emplace(path);
  if (is_new) known->second = digest_of_state(state_of(path));
  return known->second;
}

bool LibraryIndex::is_current(const IndexedLibrary& library) {
  for (const IndexedFile& file : library.files)
    if (state_of_file(file.path) != file.state) return false;
  for (const std::string& folder : library.folders) {
    const auto [known, is_new] = is_trusted_.try_emplace(folder);
    if (is_new) known->second = is_still_trusted({{folder}, {}});
    if (!known->second) return false;
  }
  if (!is_still_trusted({{}, {library.groups.begin(), library.groups.end()}})) return false;
  return !std::getenv("LD_LIBRARY_PATH") ||
         std::all_of(library.info.linked.begin(), library.info.linked.end(),
                     [](const LinkedLibrary& linked) { return found_before(linked).empty(); });
}

std::optional<LibraryInfo> LibraryIndex::find(const fs::path& library) {
  const auto found = libraries_.find(library.string());
  if (found == libraries_.end()) return std::nullopt;
  if (is_current(found->second)) return std::move(found->second.info);
  libraries_.erase(found);
  return std::nullopt;
}

std::optional<IndexedLibrary> LibraryIndex::indexed(const LibraryInfo& info) const {
  if (!info.refused.empty() || is_python_plugin(info.file)) return std::nullopt;
  const fs::path manifest = manifest_beside(info.file);
  std::vector<fs::path> files = paths_of(info.linked), optional{manifest};
  TrustedFiles trusted;
  for (const fs::path& file : files)
    if (!is_of_the_system(file.string()) && !trusted.add(file)) return std::nullopt;
  if (!trusted.add(info.file) || (fs::exists(manifest) && !trusted.add(manifest))) return std::nullopt;
  IndexedLibrary library{
      info, {}, {trusted.folders.begin(), trusted.folders.end()}, {trusted.groups.begin(), trusted.groups.end()}};
  files.push_back(info.file);
  for (const auto* list : {&files, &optional})
    for (const fs::path& file : *list) {
      const std::optional<FileState> state = state_of(file);
      if (state ? !can_be_watched(file, *state, begun_s_) : list == &files) return std::nullopt;
      library.files.push_back({file.string(), digest_of_state(state)});
    }
  return library;
}

void LibraryIndex::keep(std::span<const LibraryInfo> all) {
  std::map<std::string, IndexedLibrary> kept;
  for (const LibraryInfo& info : all)
    if (!libraries_.contains(info.file.string()))
      if (std::optional<IndexedLibrary> library = indexed(info)) kept.emplace(info.file.string(), std::move(*library));
  if (kept.empty()) return;
  for (const std::string& file : files_of_framework()) {
    const std::optional<FileState> state = state_of(file);
    if (!state || !can_be_watched(file, *state, begun_s_)) return;
  }
  for (const LibraryInfo& info : all)
    if (const auto known = libraries_.find(info.file.string()); known != libraries_.end()) {
      known->second.info = info;
      kept.insert(*known);
    }
  Packer content;
  content.add(surroundings());
  content.add(kept);
  Packer checksum;
  checksum.add(hash_of_bytes(content.packed.data(), content.packed.size()));
  keep_in_own_cache(name_, checksum.packed + content.packed);
}

void LibraryIndex::forget(const fs::path& folder) { forget_in_own_cache(name_of_index(folder)); }

}  // namespace marrow
