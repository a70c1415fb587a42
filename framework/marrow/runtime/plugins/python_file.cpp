// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/plugins/python_file.hpp"
#include "marrow/base/framework_file.hpp"

#include <sys/stat.h>
#include <time.h>

#include <fcntl.h>
#include <unistd.h>
#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <sstream>

#include "marrow/base/regular_file.hpp"
#include "marrow/runtime/plugins/descriptions.hpp"
#include "marrow/runtime/plugins/library.hpp"
#include "marrow/runtime/plugins/linked_libraries.hpp"
#include "marrow/runtime/plugins/manifest.hpp"
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

/// The variables of each process, besides the search path. "PYTHONSAFEPATH" keeps the working folder out of it.
constexpr const char* kVariables[] = {
    "PYTHONHASHSEED=0",       "PYTHONSAFEPATH=1",  "PYTHONDONTWRITEBYTECODE=1", "OMP_NUM_THREADS=1",
    "OPENBLAS_NUM_THREADS=1", "MKL_NUM_THREADS=1", "OPENCV_FOR_THREADS_NUM=1",  "MARROW_WITHOUT_PYTHON_NODES=1"};

/// Whether python_process() itself sets the variable of NAME=VALUE.
bool is_set_here(const std::string& text) {
  const std::string name = text.substr(0, text.find('=') + 1);
  return name == "PYTHONPATH=" || std::any_of(std::begin(kVariables), std::end(kVariables),
                                              [&](const char* one) { return std::string_view(one).starts_with(name); });
}

/// The folder of marrow's package, then PYTHONPATH. Relative folders are those of the working folder.
std::string search_path() {
  std::string path = python_package_folder().string();
  const char* given = std::getenv("PYTHONPATH");
  if (!given || !*given) return path;
  std::istringstream folders(std::string(given) + ":");
  for (std::string folder; std::getline(folders, folder, ':');) {
    std::error_code error;
    const fs::path full = fs::absolute(folder.empty() ? "." : folder, error);
    path += ":" + (error ? folder : full.lexically_normal().string());
  }
  return path;
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

namespace fs = std::filesystem;

fs::path python_interpreter() {
  const char* given = std::getenv("MARROW_PYTHON");
  const fs::path interpreter = given && *given ? given : "/usr/bin/python3";
  if (!interpreter.is_absolute())
    throw Error("cannot be described: MARROW_PYTHON is '" + interpreter.string() +
                "', expected the full path of an interpreter");
  if (access(interpreter.c_str(), X_OK) != 0)
    throw Error("cannot be described: there is no Python interpreter " + interpreter.string() +
                "; install python3, or name another one in MARROW_PYTHON");
  return interpreter;
}

fs::path python_package_folder() {
  const fs::path library = framework_file();
  for (fs::path above = library.parent_path(); above != above.root_path(); above = above.parent_path())
    for (const char* place : {"python", "python3/dist-packages"})
      if (fs::exists(above / place / "marrow" / "plugin.py")) return above / place;
  throw Error("cannot be described: marrow's Python package is not there; install python3-marrow");
}

std::vector<std::string> python_settings() {
  std::error_code error;
  std::vector<std::string> settings{python_interpreter().string(), fs::canonical(python_interpreter(), error).string(),
                                    "PYTHONPATH=" + search_path()};
  for (char** one = environ; one && *one; ++one)
    if (const std::string text = *one; text.starts_with("PYTHON") && !is_set_here(text)) settings.push_back(text);
  std::sort(settings.begin() + 2, settings.end());
  return settings;
}

uid_t owner_of_interpreter() {
  struct stat status {};
  return stat(python_interpreter().c_str(), &status) == 0 ? status.st_uid : 0;
}

WorkerSettings python_process(const fs::path& file, int made, int replies) {
  // Python runs a sitecustomize.py in these folders before anything can be checked.
  std::vector<fs::path> folders;
  std::istringstream path(search_path());
  for (std::string folder; std::getline(path, folder, ':');) folders.emplace_back(folder);
  if (const std::string fault = untrusted_among(folders, owner_of_interpreter()); !fault.empty()) throw Error(fault);
  std::vector<int> shared{made};
  if (replies >= 0) shared.push_back(replies);
  std::vector<std::string> command{"/usr/bin/env", "PYTHONPATH=" + search_path()};
  command.insert(command.end(), std::begin(kVariables), std::end(kVariables));
  command.push_back(python_interpreter().string());
  command.push_back((python_package_folder() / "marrow" / "node_process.py").string());
  command.push_back(file.string());
  return {command, shared};
}

ReplyPipe::ReplyPipe() : pipe_(open_pipe()) {
  if (!pipe_.read_end.is_open()) throw Error(std::string("cannot start a process: ") + std::strerror(errno));
}

void ReplyPipe::send(const nlohmann::json& reply) { write_all(pipe_.write_end, reply.dump() + "\n"); }

}  // namespace marrow
