// SPDX-License-Identifier: Apache-2.0
// Loading plugin libraries, and describing them without trusting them.
#include "marrow/runtime/library.hpp"

#include <dlfcn.h>
#include <elf.h>
#include <fcntl.h>
#include <link.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <set>
#include <sstream>

#include "apart.hpp"
#include "manifest.hpp"
#include "marrow/plugin.hpp"
#include "marrow/runtime/worker.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;
constexpr int kDescribeLimit_s = 20, kDescribeLimit_mb = 4096;

/// A file that is no whole ELF library would make the dynamic loader fail obscurely or crash.
void check_elf(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw Error("cannot be read: " + std::string(std::strerror(errno)));
  Elf64_Ehdr header{};
  stream.read(reinterpret_cast<char*>(&header), sizeof header);
  if (stream.gcount() < std::streamsize(SELFMAG) || std::memcmp(header.e_ident, ELFMAG, SELFMAG) != 0)
    throw Error("is not a shared library (it does not begin with an ELF header)");
  const std::uint64_t size = fs::file_size(file);
  const std::uint64_t expected = header.e_shoff + std::uint64_t(header.e_shentsize) * header.e_shnum;
  if (stream.gcount() < std::streamsize(sizeof header) || size < expected)
    throw Error("is truncated: its ELF header speaks of " + std::to_string(expected) + " bytes, the file has " +
                std::to_string(size) + "; build or copy it again");
}

/// What differs between the plugin's stamp and ours, in words with both values and the cure; empty when they agree.
std::string stamp_mismatch(const AbiStamp& theirs) {
  constexpr AbiStamp ours = abi_stamp();
  const auto differs = [](const std::string& what, const std::string& got, const std::string& expected, const std::string& cure) {
    return "was built with " + what + " " + got + ", this marrow with " + expected + "; " + cure;
  };
  const std::string rebuild = "build both with the same compiler and flags";
  if (std::strncmp(theirs.compiler, ours.compiler, sizeof ours.compiler) != 0)
    return differs("compiler", theirs.compiler, ours.compiler, rebuild);
  if (theirs.eigen_max_align != ours.eigen_max_align)
    return differs("EIGEN_MAX_ALIGN_BYTES", std::to_string(theirs.eigen_max_align), std::to_string(ours.eigen_max_align),
                   "leave out -march=native, -mavx and the like, which change how Eigen aligns memory");
  if (theirs.glibcxx_debug != ours.glibcxx_debug)
    return differs("_GLIBCXX_DEBUG (debug mode)", theirs.glibcxx_debug ? "on" : "off", ours.glibcxx_debug ? "on" : "off",
                   "debug mode changes the layout of every container");
  if (theirs.sanitizers != ours.sanitizers)
    return differs("sanitizers", std::to_string(theirs.sanitizers), std::to_string(ours.sanitizers), rebuild);
  if (theirs.cxx_standard / 100 != ours.cxx_standard / 100)
    return differs("C++ standard", std::to_string(theirs.cxx_standard), std::to_string(ours.cxx_standard), "use -std=c++20");
  if (theirs.cxx11_abi != ours.cxx11_abi)
    return differs("_GLIBCXX_USE_CXX11_ABI", std::to_string(theirs.cxx11_abi), std::to_string(ours.cxx11_abi), rebuild);
  if (theirs.eigen_version != ours.eigen_version || theirs.opencv_version != ours.opencv_version)
    return differs("Eigen and OpenCV", std::to_string(theirs.eigen_version) + " and " + std::to_string(theirs.opencv_version),
                   std::to_string(ours.eigen_version) + " and " + std::to_string(ours.opencv_version), "use the same versions");
  if (std::memcmp(theirs.sizes, ours.sizes, sizeof ours.sizes) != 0)
    return "was built against other headers (a domain type has another size); rebuild it with this marrow's headers";
  return "";
}

const PluginEntry& checked_entry(void* handle) {
  const auto function = reinterpret_cast<const PluginEntry* (*)()>(dlsym(handle, "marrow_plugin_entry"));
  if (!function) throw Error("is no marrow plugin: it has no function marrow_plugin_entry (open it with MARROW_PLUGIN)");
  const PluginEntry* entry = function();
  if (!entry || std::memcmp(entry->magic, "marrow!", 8) != 0) throw Error("is no marrow plugin: its entry has another magic");
  if (entry->api_major != MARROW_API_MAJOR || entry->api_minor > MARROW_API_MINOR)
    throw Error("was built for plugin interface " + std::to_string(entry->api_major) + "." + std::to_string(entry->api_minor) +
                ", this marrow has " MARROW_TEXT(MARROW_API_MAJOR) "." MARROW_TEXT(MARROW_API_MINOR) "; rebuild it with this marrow's headers");
  if (entry->size != sizeof(PluginEntry))
    throw Error("was built against other headers (its entry has " + std::to_string(entry->size) + " bytes, expected " +
                std::to_string(sizeof(PluginEntry)) + "); rebuild it with this marrow's headers");
  const std::string mismatch = stamp_mismatch(entry->stamp);
  if (!mismatch.empty()) throw Error(mismatch);
  return *entry;
}

void* open_library(const fs::path& file, int mode) {
  void* handle = dlopen(fs::absolute(file).c_str(), mode | RTLD_LOCAL);
  if (handle) return handle;
  const char* text = dlerror();
  std::string reason = text ? text : "unknown reason";
  if (reason.starts_with(fs::absolute(file).string() + ": ")) reason.erase(0, fs::absolute(file).string().size() + 2);
  throw Error("cannot be loaded: " + reason);
}

/// The libraries that a loaded library links directly, with the files they were found in.
std::vector<LinkedLibrary> linked_libraries(void* handle) {
  std::vector<LinkedLibrary> result;
  link_map* self = nullptr;
  if (dlinfo(handle, RTLD_DI_LINKMAP, &self) != 0) return result;
  const char* names = nullptr;
  for (const ElfW(Dyn)* d = self->l_ld; d->d_tag != DT_NULL; ++d)
    if (d->d_tag == DT_STRTAB) names = reinterpret_cast<const char*>(d->d_un.d_ptr);
  std::set<std::string> needed;
  for (const ElfW(Dyn)* d = self->l_ld; d->d_tag != DT_NULL; ++d)
    if (d->d_tag == DT_NEEDED) needed.insert(names + d->d_un.d_val);
  const link_map* first = self;
  while (first->l_prev) first = first->l_prev;
  for (const link_map* l = first; l; l = l->l_next) {
    const fs::path path(l->l_name);
    if (!needed.count(path.filename().string()) || path.filename().string().starts_with("libmarrow")) continue;
    std::error_code error;
    const fs::path real = fs::canonical(path, error);
    if (!error) result.push_back({real.string(), fs::file_size(real)});
  }
  return result;
}

void run_registration(Plugin& plugin, const PluginEntry& entry) {
  entry.register_nodes(plugin);
  std::string faults;
  for (const NodeDefinition& node : plugin.nodes)
    for (const std::string& fault : node.faults) faults += (faults.empty() ? "" : "; ") + node.info.name + ": " + fault;
  if (!faults.empty()) throw Error("declares its nodes wrongly: " + faults);
}

/// Runs in a worker: what the library holds, or a refusal.
LibraryInfo describe_here(const fs::path& file) {
  LibraryInfo info;
  try {
    void* handle = nullptr;
    try {
      handle = open_library(file, RTLD_NOW);
    } catch (const Error&) {
      // With lazy binding a library whose symbols do not fit can still say with what it was built, which is the better reason.
      checked_entry(open_library(file, RTLD_LAZY));
      throw;
    }
    const PluginEntry& entry = checked_entry(handle);
    info.linked = linked_libraries(handle);
    Plugin plugin;
    run_registration(plugin, entry);
    for (const NodeDefinition& node : plugin.nodes) info.nodes.push_back(node.info);
    for (const WriterDefinition& writer : plugin.writers) info.writers.push_back(writer.info);
  } catch (const std::exception& error) {
    info = LibraryInfo{};
    info.refused = error.what();
  }
  return info;
}

fs::path cache_folder() {
  if (const char* cache = std::getenv("XDG_CACHE_HOME")) return fs::path(cache) / "marrow" / "libraries";
  if (const char* home = std::getenv("HOME")) return fs::path(home) / ".cache" / "marrow" / "libraries";
  return {};
}

std::string read_text(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

void write_text(const fs::path& file, const std::string& text) {
  const fs::path temporary = file.string() + "." + std::to_string(getpid()) + ".tmp";
  std::ofstream stream(temporary, std::ios::binary);
  stream << text;
  stream.close();
  std::error_code error;
  if (stream) fs::rename(temporary, file, error);
  if (!stream || error) {
    fs::remove(temporary, error);
    throw Error("cannot write " + file.string());
  }
}

/// That the manifest belongs to this very file and to the libraries that are here now; else why not.
std::string stale(const LibraryInfo& info, const Digest& digest) {
  if (info.digest != digest) return "it belongs to another build of the library";
  for (const LinkedLibrary& library : info.linked) {
    std::error_code error;
    if (fs::file_size(library.path, error) != library.size || error) return fs::path(library.path).filename().string() + " has changed";
  }
  return "";
}

}  // namespace

fs::path framework_file() {
  Dl_info info{};
  dladdr(reinterpret_cast<const void*>(&framework_file), &info);
  return fs::canonical(info.dli_fname);
}

Digest file_digest(const fs::path& file) {
  const int descriptor = open(file.c_str(), O_RDONLY | O_CLOEXEC);
  struct stat status{};
  if (descriptor < 0 || fstat(descriptor, &status) != 0) {
    if (descriptor >= 0) close(descriptor);
    throw Error("cannot read " + file.string() + ": " + std::strerror(errno));
  }
  Hasher hasher;
  if (status.st_size > 0) {
    void* data = mmap(nullptr, std::size_t(status.st_size), PROT_READ, MAP_PRIVATE, descriptor, 0);
    if (data != MAP_FAILED) {
      hasher.bytes(data, std::size_t(status.st_size));
      munmap(data, std::size_t(status.st_size));
    }
  }
  close(descriptor);
  return hasher.digest();
}

std::unique_ptr<Plugin> load_library(const fs::path& file) {
  try {
    check_elf(file);
    void* handle = open_library(file, RTLD_NOW);
    auto plugin = std::make_unique<Plugin>();
    run_registration(*plugin, checked_entry(handle));
    return plugin;
  } catch (const Error& error) {
    throw Error(file.string() + " " + error.what());
  }
}

nlohmann::json answer_describe(const nlohmann::json& request, WorkerReports&) {
  return manifest_text(describe_here(bytes_of_json(request.at("library"))));
}

LibraryInfo describe_library(const fs::path& file) {
  LibraryInfo info;
  const auto refuse = [&](const std::string& reason) {
    info = LibraryInfo{};
    info.refused = reason;
  };
  try {
    check_elf(file);
    Worker worker({{worker_program().string()}});
    worker.ask({{"do", "describe"}, {"library", json_of_bytes(file.string())}});
    const WorkerEnd end = worker.wait({kDescribeLimit_s, kDescribeLimit_mb}, nullptr, nullptr);
    if (end.signal) refuse(std::string("crashed while being loaded (") + strsignal(end.signal) + ")");
    else if (!end.failed.empty() && end.is_late) refuse("did not say what it holds within " + std::to_string(kDescribeLimit_s) + " s of being loaded");
    else if (end.died) refuse("ended the process that loaded it");
    else if (!end.failed.empty()) refuse("cannot be described: " + end.failed);
    else info = manifest_from_text(end.answer.get<std::string>());
  } catch (const std::exception& error) {
    refuse(error.what());
  }
  info.file = file;
  info.digest = file_digest(file);
  return info;
}

LibraryInfo library_info(const fs::path& file, const Digest& framework) {
  const Digest digest = file_digest(file);
  const fs::path beside = fs::path(file).replace_extension(".json");
  // A verdict depends on the framework too: what an older one refused, a newer one may accept.
  Hasher cached_name;
  cached_name.add(digest);
  cached_name.add(framework);
  const fs::path folder = cache_folder();
  const fs::path cached = folder / (cached_name.digest().hex() + ".json");
  std::string note;
  LibraryInfo info;
  bool known = false;
  for (const fs::path& manifest : {beside, cached}) {
    if (known || !fs::exists(manifest)) continue;
    try {
      info = manifest_from_text(read_text(manifest));
      const std::string reason = stale(info, digest);
      known = reason.empty();
      if (!known && manifest == beside) note = "its manifest is stale (" + reason + "), so it was described anew";
    } catch (const Error& error) {
      if (manifest == beside) note = std::string("its manifest is not used (") + error.what() + "), so it was described anew";
    }
  }
  if (!known) {
    info = describe_library(file);
    std::error_code error;
    fs::create_directories(folder, error);
    try {
      if (!folder.empty()) write_text(cached, manifest_text(info));
    } catch (const Error&) {
      // Only a cache: without it the library is described again next time.
    }
  }
  info.file = file;
  info.note = note;
  Hasher build_id;
  build_id.add(digest);
  build_id.add(framework);
  for (const LinkedLibrary& library : info.linked) {
    build_id.add(fs::path(library.path).filename().string());
    build_id.add(library.size);
  }
  info.build_id = build_id.digest();
  return info;
}

void write_manifest(const LibraryInfo& info) {
  write_text(fs::path(info.file).replace_extension(".json"), manifest_text(info));
}

}  // namespace marrow
