// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/plugins/python_file.hpp"
#include "marrow/base/framework_file.hpp"

#include <sys/stat.h>
#include <time.h>

#include <algorithm>
#include <cstdlib>
#include <mutex>
#include <set>

#include "marrow/base/regular_file.hpp"
#include "marrow/runtime/plugins/descriptions.hpp"
#include "marrow/runtime/plugins/linked_libraries.hpp"
#include "marrow/runtime/plugins/manifest.hpp"
#include "marrow/runtime/plugins/python_process.hpp"
#include "marrow/runtime/plugins/searched_folders.hpp"
#include "marrow/runtime/plugins/trust.hpp"
#include "marrow/runtime/process/packed_values.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr std::size_t kMostSource_bytes = 4 << 20;
constexpr int kTries = 5;

LinkedLibrary with_size(const std::string& file) { return {file, fs::file_size(file)}; }

std::vector<SearchedFolder> searched_in(const json& answer) {
  std::vector<SearchedFolder> searched;
  for (const json& one : answer.at("searched"))
    searched.push_back({bytes_of_json(one.at("path")), one.at("names").get<std::vector<std::string>>()});
  return searched;
}

/// Whether a file was changed after the time, or so shortly before it that its time does not tell.
bool is_newer(const std::string& file, const timespec& time) {
  struct stat status {};
  if (stat(file.c_str(), &status) != 0) return true;
  const auto seconds = [](const timespec& t) { return double(t.tv_sec) + 1e-9 * double(t.tv_nsec); };
  return seconds(status.st_ctim) > seconds(time) - 0.02;  // unlike st_mtim, it cannot be set
}

/// What a Python process says about the file. `files` receives what it loaded.
LibraryInfo described_by_process(const fs::path& real, std::vector<std::string>& files) {
  LibraryInfo info;
  const SharedMemory made;
  WorkerSettings settings = python_process(real, made.descriptor());
  settings.quiet = true;
  Worker worker(settings);
  worker.ask({{"do", "describe"}});
  const WorkerEnd end = worker.wait({kDescribeLimit_s, kDescribeLimit_mb}, nullptr, nullptr);
  if (end.died && !end.is_late && worker.at().empty())
    throw Error(
        "cannot be described: " + python_interpreter().string() + " cannot import marrow's package from " +
        python_package_folder().string() +
        "; it must have numpy and be of the version for which the package was built (MARROW_PYTHON names another)");
  if (!end.failed.empty()) {
    info.refused = end.died ? why_not_described(end, "imported") : "cannot be used: " + end.failed;
    return info;
  }
  try {
    for (const json& one : end.answer.at("files")) files.push_back(bytes_of_json(one));
    info = info_of_nodes(end.answer.at("nodes"));
    info.searched = searched_in(end.answer);
  } catch (const std::exception& error) {
    info.refused = std::string("describes itself in a way that cannot be used: ") + error.what();
  }
  return info;
}

/// The name of a file's description in the cache. It does not depend on what the file imports, which is not known yet.
Digest name_in_cache(const fs::path& real) {
  const Digest content = digest_of(RegularFile(real));
  const char* home = std::getenv("HOME");  // it has a folder of modules of the user's own
  return hash_of(std::string("python"), real.string(), content, python_settings(), std::string(home ? home : ""));
}

/// Throws Error if others could change what the file imports, as far as it is known.
void expect_trusted_modules(const LibraryInfo& info) {
  const std::string fault = untrusted_among(paths_of(info.linked), owner_of_interpreter());
  if (!fault.empty()) throw Error(fault);
}

bool is_current(const LibraryInfo& info) try { return digest_of_python(info) == info.digest; } catch (const Error&) {
  return false;
}

struct Incomplete {
  std::mutex mutex;
  std::set<std::pair<fs::path, Digest>> descriptions;
};
Incomplete& incomplete() {
  static Incomplete all;
  return all;
}

}  // namespace

bool is_python_plugin(const fs::path& file) {
  if (file.extension() != ".py" || std::getenv("MARROW_WITHOUT_PYTHON_NODES")) return false;
  try {
    const std::string text = read_text(RegularFile(file), kMostSource_bytes);
    for (const char* decorator : {"@marrow.node", "@marrow.cost", "@marrow.optimizer", "@marrow.projector"})
      if (text.find(decorator) != std::string::npos) return true;
  } catch (const Error&) {  // it cannot be read
  }
  return false;
}

Digest digest_of_python(const LibraryInfo& described) {
  Hasher digest;
  digest.add(digest_of(RegularFile(trusted_path(described.file))));
  digest.add(python_settings());
  for (const LinkedLibrary& one : described.linked) {
    digest.add(one.path);
    digest.add(identity_of(one));
  }
  add_state_of(described.searched, digest);
  return digest.digest();
}

LibraryInfo describe_python_file(const fs::path& file) {
  const fs::path real = trusted_path(file);
  for (int i = 0; i < kTries; ++i) {
    timespec start{};
    clock_gettime(CLOCK_REALTIME, &start);
    std::vector<std::string> files;
    LibraryInfo info = described_by_process(real, files);
    info.file = file;
    files.insert(files.begin(), fs::canonical(python_interpreter()).string());
    bool changed = is_newer(real, start);
    for (const std::string& one : files) changed = changed || is_newer(one, start);
    if (changed && i + 1 < kTries) continue;
    if (changed) throw Error("cannot be described: it or a module that it imports was changed meanwhile; try again");
    for (const std::string& one : files) info.linked.push_back(with_size(one));
    expect_trusted_modules(info);
    info.digest = digest_of_python(info);
    return info;
  }
  return {};
}

LibraryInfo python_file_info(const fs::path& file, const Digest& framework) {
  const Digest name = name_in_cache(trusted_path(file));
  LibraryInfo info;
  if (std::optional<LibraryInfo> kept = kept_description(name, framework)) {
    info = std::move(*kept);
    info.file = file;
  }
  if (info.file.empty() || !is_current(info)) {
    info = describe_python_file(file);
    keep_description(info, name, framework);
  } else {
    expect_trusted_modules(info);
  }
  Hasher build_id;
  build_id.add(info.digest);
  build_id.add(framework);
  for (const Digest& identity : framework_identities()) build_id.add(identity);
  info.build_id = build_id.digest();
  return info;
}

bool LoadedByPython::add_new(const json& answer, const LibraryInfo& described) {
  std::set<std::string> known = files;
  for (const LinkedLibrary& one : described.linked) known.insert(one.path);
  std::map<std::string, std::set<std::string>> known_names = searched;
  for (const SearchedFolder& one : described.searched) known_names[one.path].insert(one.names.begin(), one.names.end());
  bool is_new = false;
  for (const json& one : answer.at("files"))
    if (const std::string file = bytes_of_json(one); !known.contains(file))
      is_new = files.insert(file).second || is_new;
  for (const SearchedFolder& one : searched_in(answer))
    for (const std::string& name : one.names)
      if (!known_names[one.path].contains(name)) is_new = searched[one.path].insert(name).second || is_new;
  return is_new;
}

void add_to_description(const LibraryInfo& described, const LoadedByPython& more_loaded) {
  {
    const std::scoped_lock lock(incomplete().mutex);
    incomplete().descriptions.emplace(described.file, described.digest);
  }
  LibraryInfo more = described;
  for (const std::string& file : more_loaded.files) more.linked.push_back(with_size(file));
  for (const auto& [path, names] : more_loaded.searched) {
    auto folder = std::find_if(more.searched.begin(), more.searched.end(),
                               [&path = path](const auto& one) { return one.path == path; });
    if (folder == more.searched.end()) folder = more.searched.insert(more.searched.end(), SearchedFolder{path, {}});
    folder->names.insert(folder->names.end(), names.begin(), names.end());
  }
  more.digest = digest_of_python(more);
  keep_description(more, name_in_cache(trusted_path(described.file)), file_digest(framework_file()));
}

bool is_fully_described(const LibraryInfo& described) {
  const std::scoped_lock lock(incomplete().mutex);
  return !incomplete().descriptions.contains({described.file, described.digest});
}

}  // namespace marrow
