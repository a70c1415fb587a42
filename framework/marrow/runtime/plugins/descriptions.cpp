// SPDX-License-Identifier: Apache-2.0
// Descriptions of libraries that are not loaded: the manifests next to them, and a cache of descriptions in the user's
// own folder.
#include "marrow/runtime/plugins/descriptions.hpp"
#include "marrow/base/framework_file.hpp"

#include <sys/stat.h>

#include <unistd.h>
#include <cerrno>
#include <csignal>

#include "marrow/base/json_text.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/regular_file.hpp"
#include "marrow/base/text_file.hpp"
#include "marrow/runtime/plugins/library_index.hpp"
#include "marrow/runtime/plugins/linked_libraries.hpp"
#include "marrow/runtime/plugins/manifest.hpp"
#include "marrow/runtime/plugins/python_file.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;

/// The file of a description in the cache. Its name depends on the framework too, because a newer framework may accept
/// what an older one refused.
std::string file_in_cache(const Digest& name, const Digest& framework) {
  return hash_of(name, framework, search_digest()).hex() + ".json";
}

/// The name of a library's description in the cache. The same library in another folder may link other libraries: those
/// beside it.
Digest name_in_cache(const fs::path& real, const Digest& content) { return hash_of(real.string(), content); }

/// Why a description does not fit this library and the linked libraries that exist now; empty if it fits.
std::string stale(const LibraryInfo& info, const Digest& digest) {
  if (info.digest != digest) return "it belongs to another build of the library";
  for (const LinkedLibrary& library : info.linked) {
    struct stat status {};
    if (stat(library.path.c_str(), &status) != 0 || !S_ISREG(status.st_mode) ||
        std::uint64_t(status.st_size) != library.size)
      return fs::path(library.path).filename().string() + " has changed";
  }
  return "";
}

/// The text of a manifest. Throws Error, with a text that begins with "it".
std::string manifest_text_of(const fs::path& file) try {
  return read_text(RegularFile(trusted_path(file)), kMostManifest_bytes);
} catch (const Error& error) {
  throw Error(std::string("it ") + error.what());
}

/// The description of a library from the manifest next to it. If the manifest cannot be used, returns nothing, and
/// `note` says why.
std::optional<LibraryInfo> from_manifest(const fs::path& library, const Digest& digest, std::string& note) {
  const fs::path manifest = manifest_beside(library);
  std::error_code error;
  if (!fs::exists(fs::symlink_status(manifest, error))) return std::nullopt;
  try {
    LibraryInfo info = manifest_from_text(manifest_text_of(manifest));
    if (!info.refused.empty()) throw Error("it is of a library that was refused");
    std::string reason = stale(info, digest);
    for (const LinkedLibrary& linked : info.linked)
      if (reason.empty() && !found_before(linked).empty()) reason = "LD_LIBRARY_PATH leads to " + found_before(linked);
    if (reason.empty()) return info;
    note = "its manifest is stale (" + reason + "), so it was described again";
  } catch (const Error& fault) {
    note = std::string("its manifest is not used (") + fault.what() + "), so it was described again";
  }
  return std::nullopt;
}

/// The description of a library from the cache, or else a new one, which is kept there.
LibraryInfo kept_or_new(const fs::path& file, const fs::path& real, const Digest& digest, const Digest& framework) {
  const Digest name = name_in_cache(real, digest);
  if (std::optional<LibraryInfo> kept = kept_description(name, framework); kept && stale(*kept, digest).empty())
    return std::move(*kept);
  LibraryInfo info = describe_library(file);
  if (info.refused.empty() && info.digest != digest) throw Error("was changed while it was described; start again");
  if (info.digest == digest) keep_description(info, name, framework);
  return info;
}

/// Whether marrow wrote the file. It may be stale or of another version.
bool is_manifest(const fs::path& file) {
  try {
    return parse_json(read_text_file(file, kMostManifest_bytes), file.string()).contains("marrow_manifest");
  } catch (const Error&) {
    return false;
  }
}

/// Whether a folder belongs to the user alone. A folder that an older version made readable for all is made private.
bool is_own(const fs::path& folder) {
  struct stat status {};
  if (stat(folder.c_str(), &status) != 0 || !S_ISDIR(status.st_mode) || status.st_uid != geteuid()) return false;
  if ((status.st_mode & 077) && chmod(folder.c_str(), 0700) != 0) return false;
  return changeable_by_others(folder).empty();
}

/// Makes the folder for the user alone. Nobody else may be able to change the folders above it.
bool make_own(const fs::path& folder) {
  std::error_code error;
  if (fs::exists(folder, error)) return is_own(folder);
  const fs::path parent = folder.parent_path();
  if (!fs::exists(parent, error) && !make_own(parent)) return false;
  if (!changeable_by_others(parent).empty()) return false;
  return (mkdir(folder.c_str(), 0700) == 0 || errno == EEXIST) && is_own(folder);
}

/// Empty if there is no such folder that belongs to the user alone. `make`: makes it.
fs::path own_cache_folder(bool make) {
  const fs::path cache = user_cache_folder();
  if (cache.empty()) return {};
  const fs::path folder = cache / "marrow" / "libraries";
  return (make ? make_own(folder) : is_own(folder)) ? folder : fs::path();
}

}  // namespace

fs::path manifest_beside(const fs::path& library) { return fs::path(library).replace_extension(".json"); }

std::optional<LibraryInfo> kept_description(const Digest& name, const Digest& framework) try {
  const std::optional<std::string> text = own_cached_text(file_in_cache(name, framework), kMostManifest_bytes);
  return text ? std::optional(manifest_from_text(*text)) : std::nullopt;
} catch (const Error&) {  // the library is described again, and that description is kept instead
  return std::nullopt;
}

void keep_description(const LibraryInfo& info, const Digest& name, const Digest& framework) {
  // The reason may be outside of the library, such as another library that it needs, and may be gone next time.
  if (info.refused.starts_with("cannot be")) return;
  keep_in_own_cache(file_in_cache(name, framework), manifest_text(info));
}

LibraryInfo library_info(const fs::path& file, const Digest& framework) {
  if (is_python_plugin(file)) return python_file_info(file, framework);
  const fs::path real = trusted_path(file);
  const Digest digest = digest_of(RegularFile(real));
  std::string note;
  std::optional<LibraryInfo> known = from_manifest(file, digest, note);
  LibraryInfo info = known ? std::move(*known) : kept_or_new(file, real, digest, framework);
  if (const std::string fault = untrusted_among(paths_of(info.linked)); !fault.empty()) throw Error(fault);
  info.file = file;
  info.note = note;
  Hasher build_id;
  build_id.add(digest);
  build_id.add(framework);
  for (const Digest& identity : framework_identities()) build_id.add(identity);
  for (const LinkedLibrary& library : std::as_const(info.linked)) build_id.add(identity_of(library));
  info.build_id = build_id.digest();
  return info;
}

void forget_description(const LibraryInfo& library) {
  std::error_code error;
  const Digest name = name_in_cache(fs::weakly_canonical(library.file, error), library.digest);
  forget_in_own_cache(file_in_cache(name, file_digest(framework_file())));
  LibraryIndex::forget(library.file.parent_path());
}

std::string why_not_described(const WorkerEnd& end, const std::string& used) {
  if (end.is_late) return formatted("did not say what it holds within {} s of being {}", kDescribeLimit_s, used);
  if (end.is_out_of_memory) return formatted("takes more than {} MB of memory to be {}", kDescribeLimit_mb, used);
  if (end.signal == SIGKILL) return "cannot be described: " + killed_from_outside("the process that " + used + " it");
  if (end.signal) return formatted("crashed while being {} ({})", used, strsignal(end.signal));
  if (end.died) return "ended the process that " + used + " it";
  return "cannot be described: " + end.failed;
}

std::string cure_of_description(const fs::path& library) {
  std::error_code error;
  const fs::path manifest = manifest_beside(library);
  if (!fs::exists(fs::symlink_status(manifest, error))) return "start again: it is then described again";
  return "run 'marrow describe " + library.string() + " --write', or remove " + manifest.string();
}

void write_manifest(const LibraryInfo& info) {
  const fs::path manifest = manifest_beside(info.file);
  if (info.file.extension() != ".so")
    throw Error("a manifest is written only beside a library whose name ends in .so, got " + info.file.string() +
                "; rename it");
  std::error_code error;
  if (fs::exists(fs::symlink_status(manifest, error)) && !is_manifest(manifest))
    throw Error(manifest.string() + " exists and is not a manifest that marrow wrote; move it away, or rename " +
                info.file.string());
  write_text_file(manifest, manifest_text(info), Kinds::files, 0644);
}

std::optional<std::string> own_cached_text(const std::string& name, std::size_t most_bytes) try {
  const fs::path folder = own_cache_folder(false);
  if (folder.empty()) return std::nullopt;
  const RegularFile file(folder / name);
  if (file.status().st_uid != geteuid()) return std::nullopt;
  return read_text(file, most_bytes);
} catch (const Error&) {
  return std::nullopt;
}

void keep_in_own_cache(const std::string& name, const std::string& text) try {
  if (const fs::path folder = own_cache_folder(true); !folder.empty())
    write_text_file(folder / name, text, Kinds::files, 0600);
} catch (const Error&) {
}

void forget_in_own_cache(const std::string& name) {
  std::error_code error;
  if (const fs::path folder = own_cache_folder(false); !folder.empty()) fs::remove(folder / name, error);
}

}  // namespace marrow
