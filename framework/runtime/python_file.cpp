// SPDX-License-Identifier: Apache-2.0
#include "python_file.hpp"

#include <sys/stat.h>
#include <time.h>

#include <cstdlib>
#include <cstring>
#include <mutex>
#include <set>

#include "descriptions.hpp"
#include "linked_libraries.hpp"
#include "manifest.hpp"
#include "packed_values.hpp"
#include "python_process.hpp"
#include "regular_file.hpp"
#include "trust.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr std::size_t kMostSource_bytes = 4 << 20;
constexpr int kPythonDescribeLimit_s = 20, kPythonDescribeLimit_mb = 4096;
constexpr int kTries = 5;

std::vector<LinkedLibrary> with_sizes(const std::vector<std::string>& files) {
  std::vector<LinkedLibrary> linked;
  for (const std::string& file : files) linked.push_back({file, fs::file_size(file)});
  return linked;
}

/// Whether a file was changed after the time, or so shortly before it that its time does not tell.
bool is_newer(const std::string& file, const timespec& time) {
  struct stat status {};
  if (stat(file.c_str(), &status) != 0) return true;
  const auto seconds = [](const timespec& t) { return double(t.tv_sec) + 1e-9 * double(t.tv_nsec); };
  return seconds(status.st_ctim) > seconds(time) - 0.02;  // unlike st_mtim, it cannot be set
}

std::string why_refused(const WorkerEnd& end) {
  if (end.is_late)
    return "did not say what it holds within " + std::to_string(kPythonDescribeLimit_s) + " s of being imported";
  if (end.is_out_of_memory)
    return "takes more than " + std::to_string(kPythonDescribeLimit_mb) + " MB of memory to be imported";
  if (end.signal) return std::string("crashed while it was imported (") + strsignal(end.signal) + ")";
  if (end.died) return "ended the process that imported it";
  return "cannot be used: " + end.failed;
}

/// What a Python process says about the file. `files` receives what it loaded.
LibraryInfo described_by_process(const fs::path& real, std::vector<std::string>& files) {
  LibraryInfo info;
  const SharedMemory made;
  WorkerSettings settings = python_process(real, made.descriptor());
  settings.quiet = true;
  Worker worker(settings);
  worker.ask({{"do", "describe"}});
  const WorkerEnd end = worker.wait({kPythonDescribeLimit_s, kPythonDescribeLimit_mb}, nullptr, nullptr);
  if (end.died && !end.is_late && worker.at().empty())
    throw Error(
        "cannot be described: " + python_interpreter().string() + " cannot import marrow's package from " +
        python_package_folder().string() +
        "; it must have numpy and be of the version for which the package was built (MARROW_PYTHON names another)");
  if (!end.failed.empty()) {
    info.refused = why_refused(end);
    return info;
  }
  try {
    files = end.answer.at("files").get<std::vector<std::string>>();
    info = info_of_nodes(end.answer.at("nodes"));
  } catch (const std::exception& error) {
    info.refused = std::string("describes itself in a way that cannot be used: ") + error.what();
  }
  return info;
}

/// The name of a file's description in the cache. It does not depend on what the file imports, which is not known yet.
Digest name_in_cache(const fs::path& real) {
  Hasher name;
  name.add(std::string("python"));
  name.add(real.string());
  name.add(digest_of(RegularFile(real)));
  name.add(python_interpreter().string());
  name.add(python_package_folder().string());
  const char* path = std::getenv("PYTHONPATH");
  name.add(std::string(path ? path : ""));
  return name.digest();
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
  digest.add(python_interpreter().string());  // a virtual environment has the same program under another name
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
    info.linked = with_sizes(files);
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
  }
  Hasher build_id;
  build_id.add(info.digest);
  build_id.add(framework);
  for (const Digest& identity : framework_identities()) build_id.add(identity);
  info.build_id = build_id.digest();
  return info;
}

void add_to_description(const LibraryInfo& described, const std::vector<std::string>& files) {
  {
    const std::scoped_lock lock(incomplete().mutex);
    incomplete().descriptions.emplace(described.file, described.digest);
  }
  LibraryInfo more = described;
  for (const LinkedLibrary& one : with_sizes(files)) more.linked.push_back(one);
  more.digest = digest_of_python(more);
  keep_description(more, name_in_cache(trusted_path(described.file)), file_digest(framework_file()));
}

bool is_fully_described(const LibraryInfo& described) {
  const std::scoped_lock lock(incomplete().mutex);
  return !incomplete().descriptions.contains({described.file, described.digest});
}

}  // namespace marrow
