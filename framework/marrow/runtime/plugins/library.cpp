// SPDX-License-Identifier: Apache-2.0
// Loads plugin libraries, and describes them without trusting them.
#include "marrow/runtime/plugins/library.hpp"

#include <dlfcn.h>
#include <fcntl.h>
#include <unistd.h>

#include <chrono>
#include <set>
#include <tuple>

#include "marrow/base/framework_file.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/process_state.hpp"
#include "marrow/base/regular_file.hpp"
#include "marrow/runtime/plugins/descriptions.hpp"
#include "marrow/runtime/plugins/linked_libraries.hpp"
#include "marrow/runtime/plugins/manifest.hpp"
#include "marrow/runtime/plugins/python_file.hpp"
#include "marrow/runtime/plugins/trust.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;

/// What differs between the plugin's stamp and ours, in words, with both values and what to do; empty if they agree.
std::string stamp_mismatch(const AbiStamp& theirs) {
  constexpr AbiStamp ours = abi_stamp();
  const auto differs = [](const char* what, const auto& got, const auto& expected, const char* cure) {
    return formatted("was built with {} {}, this marrow with {}; {}", what, got, expected, cure);
  };
  const auto on_or_off = [](int flag) { return flag ? "on" : "off"; };
  const auto versions = [](const AbiStamp& stamp) {
    return formatted("{} and {}", stamp.eigen_version, stamp.opencv_version);
  };
  constexpr const char* kRebuild = "build both with the same compiler and flags";
  if (std::strncmp(theirs.compiler, ours.compiler, sizeof ours.compiler) != 0)
    return differs("compiler", std::string(theirs.compiler), std::string(ours.compiler), kRebuild);
  if (theirs.eigen_max_align != ours.eigen_max_align)
    return differs("EIGEN_MAX_ALIGN_BYTES", theirs.eigen_max_align, ours.eigen_max_align,
                   "leave out -march=native, -mavx and the like, which change how Eigen aligns memory");
  if (theirs.glibcxx_debug != ours.glibcxx_debug)
    return differs("_GLIBCXX_DEBUG (debug mode)", on_or_off(theirs.glibcxx_debug), on_or_off(ours.glibcxx_debug),
                   "debug mode changes the layout of every container");
  if (theirs.sanitizers != ours.sanitizers) return differs("sanitizers", theirs.sanitizers, ours.sanitizers, kRebuild);
  if (theirs.fast_math != ours.fast_math)
    return differs("-ffast-math", on_or_off(theirs.fast_math), on_or_off(ours.fast_math),
                   "leave out -ffast-math and -Ofast: they change the results of other nodes, and NaN is not seen");
  if (theirs.cxx_standard / 100 != ours.cxx_standard / 100)
    return differs("C++ standard", theirs.cxx_standard, ours.cxx_standard, "use -std=c++20");
  if (theirs.cxx11_abi != ours.cxx11_abi)
    return differs("_GLIBCXX_USE_CXX11_ABI", theirs.cxx11_abi, ours.cxx11_abi, kRebuild);
  if (theirs.eigen_version != ours.eigen_version || theirs.opencv_version != ours.opencv_version)
    return differs("Eigen and OpenCV", versions(theirs), versions(ours), "use the same versions");
  if (theirs.headers != ours.headers) return "was built against other headers; rebuild it with this marrow's headers";
  return "";
}

const PluginEntry& checked_entry(void* handle) {
  const auto function = reinterpret_cast<const PluginEntry* (*)()>(dlsym(handle, "marrow_plugin_entry"));
  if (!function)
    throw Error("is not a marrow plugin: it has no function marrow_plugin_entry (open it with MARROW_PLUGIN)");
  const PluginEntry* entry = function();
  if (!entry || std::memcmp(entry->magic, "marrow!", 8) != 0)
    throw Error("is not a marrow plugin: its entry has another magic");
  if (entry->api_major != MARROW_API_MAJOR || entry->api_minor > MARROW_API_MINOR)
    throw Error(
        formatted("was built for plugin interface {}.{}, this marrow has {}.{}; rebuild it with this marrow's headers",
                  entry->api_major, entry->api_minor, MARROW_API_MAJOR, MARROW_API_MINOR));
  if (entry->size != sizeof(PluginEntry))
    throw Error(formatted(
        "was built against other headers (its entry has {} bytes, expected {}); rebuild it with this marrow's headers",
        entry->size, sizeof(PluginEntry)));
  const std::string mismatch = stamp_mismatch(entry->stamp);
  if (!mismatch.empty()) throw Error(mismatch);
  return *entry;
}

/// An exception of a library's initialiser must not pass through the loader. The loader would keep its lock, and the
/// next load would wait for ever. So this function is noexcept: the process ends.
void* load_without_throwing(const char* path, int mode) noexcept {
  // dlopen is declared as a function that does not throw. A compiler that sees this omits the code that ends the
  // process here, so dlopen is called through a volatile pointer.
  void* (*volatile load)(const char*, int) = dlopen;
  return load(path, mode);
}

/// Puts back what the initialisers of the library change. If it was linked with -ffast-math, for example, they make the
/// processor turn tiny numbers into 0.
void* open_library(const fs::path& file, int mode) {
  const UsualArithmetic arithmetic;
  const std::shared_ptr<ProcessState> state = ProcessState::of_runs();
  void* handle = load_without_throwing(fs::absolute(file).c_str(), mode | RTLD_LOCAL);
  state->put_back();
  if (handle) return handle;
  const char* text = dlerror();
  std::string reason = text ? text : "unknown reason";
  if (reason.starts_with(fs::absolute(file).string() + ": ")) reason.erase(0, fs::absolute(file).string().size() + 2);
  throw Error("cannot be loaded: " + reason);
}

void run_registration(Plugin& plugin, const PluginEntry& entry) {
  entry.register_nodes(plugin);
  std::string faults;
  const auto add = [&](const std::string& name, const std::vector<std::string>& of_one) {
    for (const std::string& fault : of_one) faults += (faults.empty() ? "" : "; ") + name + ": " + fault;
  };
  for (const KindDefinition& kind : plugin.kinds) add("kind " + kind.info.name, kind.faults);
  for (const NodeDefinition& node : plugin.nodes) add(node.info.name, node.faults);
  if (!faults.empty()) throw Error("declares its nodes wrongly: " + faults);
}

void add_registered(const Plugin& plugin, LibraryInfo& info) {
  for (const KindDefinition& kind : plugin.kinds) info.kinds.push_back(kind.info);
  for (const NodeDefinition& node : plugin.nodes) info.nodes.push_back(node.info);
  for (const WriterDefinition& writer : plugin.writers) info.writers.push_back(writer.info);
}

/// Throws Error if others could change what a library links. To be called before any of that runs.
void expect_trusted(const std::vector<fs::path>& linked) {
  if (const std::string fault = untrusted_among(linked); !fault.empty()) throw Error(fault);
}

/// Runs in a worker. Returns what the library holds, or a refusal.
LibraryInfo describe_here(const fs::path& file) {
  LibraryInfo info;
  try {
    expect_trusted(libraries_to_load(file));
    void* handle = nullptr;
    try {
      handle = open_library(file, RTLD_NOW);
    } catch (const Error&) {
      // With lazy binding, a library whose symbols do not fit can still say what it was built with. That is the better
      // reason.
      checked_entry(open_library(file, RTLD_LAZY));
      throw;
    }
    const PluginEntry& entry = checked_entry(handle);
    info.linked = linked_libraries(handle);
    Plugin plugin;
    run_registration(plugin, entry);
    add_registered(plugin, info);
  } catch (const std::exception& error) {
    info = LibraryInfo{};
    info.refused = error.what();
  }
  return info;
}

/// Loads a library in a worker and describes it. The description may be a refusal. Throws Error if no worker can be
/// started.
LibraryInfo describe_apart(const fs::path& file) {
  Worker worker({{worker_program().string()}});
  worker.ask({{"do", "describe"}, {"library", json_of_bytes(file.string())}});
  const WorkerEnd end = worker.wait({kDescribeLimit_s, kDescribeLimit_mb}, nullptr, nullptr);
  LibraryInfo info;
  try {
    if (end.failed.empty()) return library_from_json(end.answer);
    info.refused = why_not_described(end, "loaded");
  } catch (const Error& error) {
    info.refused = std::string("describes itself in a way that cannot be used: ") + error.what();
  }
  return info;
}

/// What a loaded library registers, and the libraries that it links.
LibraryInfo registered(const Plugin& plugin, void* handle) {
  LibraryInfo info;
  add_registered(plugin, info);
  info.linked = linked_libraries(handle);
  return info;
}

/// Libraries by name, size and identity.
using Versions = std::set<std::tuple<std::string, std::uint64_t, Digest>>;

Versions versions_of(const std::vector<LinkedLibrary>& libraries) {
  Versions result;
  for (const LinkedLibrary& library : libraries)
    result.insert({fs::path(library.path).filename().string(), library.size, identity_of(library)});
  return result;
}

/// Throws Error if a library does not register what its description says. Options were checked and keys were made from
/// the description, so nothing of such a library may be called.
void expect_described(const LibraryInfo& described, const LibraryInfo& registered) {
  std::string found = difference(described, registered);
  const Versions before = versions_of(described.linked), now = versions_of(registered.linked);
  for (const auto& library : now)
    if (const auto& [name, size, content] = library; found.empty() && !before.count(library))
      found = formatted("it loads another {} ({} bytes)", name, size);
  for (const auto& library : before)
    if (const auto& [name, size, content] = library; found.empty() && !now.count(library))
      found = formatted("it does not load {} of {} bytes", name, size);
  if (found.empty()) return;
  forget_description(described);
  throw Error("is not what its description says: " + found + "; " + cure_of_description(described.file));
}

}  // namespace

std::unique_ptr<Plugin> load_library(const LibraryInfo& described) {
  const fs::path& file = described.file;
  try {
    if (is_python_plugin(file)) return load_python_file(described);
    const fs::path real = trusted_path(file);
    check_elf(RegularFile(real));
    expect_trusted(paths_of(described.linked));
    void* handle = open_library(real, RTLD_NOW);
    auto plugin = std::make_unique<Plugin>();
    run_registration(*plugin, checked_entry(handle));
    if (digest_of(RegularFile(real)) != described.digest)
      throw Error("was changed since this program began; start it again");
    expect_described(described, registered(*plugin, handle));
    return plugin;
  } catch (const Error& error) {
    throw Error(file.string() + " " + error.what());
  }
}

nlohmann::json answer_describe(const nlohmann::json& request, WorkerReports&) {
  return library_json(describe_here(bytes_of_json(request.at("library"))));
}

LibraryInfo describe_library(const fs::path& file) {
  LibraryInfo info;
  Digest digest;
  try {
    if (is_python_plugin(file)) return describe_python_file(file);
    const fs::path real = trusted_path(file);
    const RegularFile library(real);
    check_elf(library);
    const Digest before = digest_of(library);
    info = describe_apart(real);
    if (digest_of(RegularFile(real)) != before) throw Error("cannot be described: it was changed meanwhile; try again");
    digest = before;
  } catch (const Error& error) {
    info = LibraryInfo{};
    info.refused = error.what();
  }
  info.file = file;
  info.digest = digest;
  return info;
}

}  // namespace marrow
