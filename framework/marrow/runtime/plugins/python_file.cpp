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
#include "marrow/runtime/plugins/trust.hpp"
#include "marrow/runtime/process/packed_values.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr std::size_t kMostSource_bytes = 4 << 20;
constexpr int kTries = 5;

LinkedLibrary with_size(const std::string& file) { return {file, fs::file_size(file)}; }

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

void add_to_description(const LibraryInfo& described, const json& answer, std::set<std::string>& more_loaded) {
  const std::size_t before = more_loaded.size();
  for (const json& one : answer.at("files")) more_loaded.insert(bytes_of_json(one));
  for (const LinkedLibrary& one : described.linked) more_loaded.erase(one.path);
  if (more_loaded.size() == before) return;
  {
    const std::scoped_lock lock(incomplete().mutex);
    incomplete().descriptions.emplace(described.file, described.digest);
  }
  LibraryInfo more = described;
  for (const std::string& file : more_loaded) more.linked.push_back(with_size(file));
  more.digest = digest_of_python(more);
  keep_description(more, name_in_cache(trusted_path(described.file)), file_digest(framework_file()));
}

bool is_fully_described(const LibraryInfo& described) {
  const std::scoped_lock lock(incomplete().mutex);
  return !incomplete().descriptions.contains({described.file, described.digest});
}

}  // namespace marrow
