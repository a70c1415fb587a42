// SPDX-License-Identifier: Apache-2.0
#include "files.hpp"

#include <fstream>

#include "marrow/base/error.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/runtime/pipeline/named_files.hpp"
#include "marrow/runtime/plugins/catalogue.hpp"

namespace fs = std::filesystem;

namespace marrow::cli {
namespace {

void add(const fs::path& file, FileStates& states) {
  std::error_code gone;
  const fs::file_time_type written = fs::last_write_time(file, gone);
  if (gone) return;
  const std::uintmax_t size = fs::file_size(file, gone);
  if (!gone) states[file] = {written, size};
}

void add_below(const fs::path& folder, FileStates& states) {
  std::error_code gone;
  for (fs::recursive_directory_iterator entry(folder, fs::directory_options::skip_permission_denied, gone), end;
       !gone && entry != end; entry.increment(gone))
    if (entry->is_regular_file(gone)) add(entry->path(), states);
}

void add_files(const Pipeline& pipeline, std::vector<fs::path>& files) {
  files.insert(files.end(), pipeline.files.begin(), pipeline.files.end());
  for (const PipelineNode& node : pipeline.nodes) {
    for (const std::string& path : paths_of(node)) files.push_back(path);
    if (node.repetition) add_files(node.repetition->alone, files);
  }
}

bool holds_sources(const fs::path& folder) {
  const std::string name = folder.filename().string();
  return !name.starts_with(".") && name != "runs" && name != "__pycache__" && !fs::exists(folder / "CMakeCache.txt");
}

}  // namespace

WatchedFiles files_of(const PipelineRequest& request) {
  const Catalogue catalogue;
  WatchedFiles files{{request.file}, catalogue.folders()};
  files.paths.insert(files.paths.end(), request.settings.begin(), request.settings.end());
  Diagnostics diagnostics;
  add_files(read_pipeline(request.file, arguments_of(request), catalogue, diagnostics, false), files.paths);
  return files;
}

FileStates states_of(const WatchedFiles& files) {
  FileStates states;
  std::error_code gone;
  for (const fs::path& path : files.paths)
    if (fs::is_directory(path, gone))
      add_below(path, states);
    else
      add(path, states);
  for (const fs::path& folder : files.plugin_folders)
    for (fs::directory_iterator entry(folder, gone), end; !gone && entry != end; entry.increment(gone))
      if (entry->path().extension() == ".so" || entry->path().extension() == ".py") add(entry->path(), states);
  return states;
}

WatchedBuild watched_build(const fs::path& folder) {
  std::ifstream cache(folder / "CMakeCache.txt");
  const std::string key = "CMAKE_HOME_DIRECTORY:INTERNAL=";
  for (std::string line; std::getline(cache, line);)
    if (line.starts_with(key)) return {fs::absolute(folder), line.substr(key.size())};
  throw Error("--build " + printable(folder.string()) +
              ": it is no build folder of CMake, as it has no CMakeCache.txt; make it by: cmake -S SOURCES -B " +
              printable(folder.string()));
}

FileStates states_of_sources(const WatchedBuild& build) {
  FileStates states;
  std::error_code gone;
  for (fs::recursive_directory_iterator entry(build.sources, fs::directory_options::skip_permission_denied, gone), end;
       !gone && entry != end; entry.increment(gone)) {
    if (entry->is_directory(gone) && !holds_sources(entry->path())) entry.disable_recursion_pending();
    if (entry->is_regular_file(gone)) add(entry->path(), states);
  }
  return states;
}

}  // namespace marrow::cli
