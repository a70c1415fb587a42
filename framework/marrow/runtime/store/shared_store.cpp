// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/store/shared_store.hpp"

#include "marrow/runtime/store/shared_folder.hpp"

#include <cstdlib>
#include <new>

#include "marrow/base/file_names.hpp"
#include "marrow/runtime/store/store_collect.hpp"
#include "marrow/runtime/store/store_entry.hpp"
#include "marrow/runtime/store/store_folder.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;

// A result is shared if it took at least a second, and ten times as long as reading it at 100 MB/s.
constexpr double kShortest_s = 1, kShortest_s_per_MB = 0.1;
constexpr double kShareOfLocal = 0.1;  // a larger part of the local store's size is not copied there for one result

double megabytes(std::uint64_t bytes) { return double(bytes) / 1e6; }

std::uint64_t most_copied() {
  return std::uint64_t(kShareOfLocal * double(bytes_of_gigabytes(given_gigabytes()).value_or(0)));
}

// A simulated case is a folder with files. It is one entry of the store: its leaves are the files, by their names.

/// A name that leads to a file below the folder, and to nothing else.
bool is_inside(const fs::path& name) {
  return !name.empty() && name.is_relative() && name.has_filename() &&
         std::none_of(name.begin(), name.end(), [](const fs::path& part) { return part == ".." || part == "."; });
}

/// Throws Error if a file of the folder cannot be read or changes meanwhile.
void pack_case(Archive& out, const Digest& key, const fs::path& folder) {
  std::vector<fs::path> names;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file() && !entry.is_symlink()) names.push_back(entry.path().lexically_relative(folder));
  std::sort(names.begin(), names.end());
  EntryDescription description;
  description.key = key;
  description.provenance.node = "simulated case";
  for (const fs::path& name : names) {
    const StoreFile file(folder / name);
    Hasher hasher;
    if (!file.is_open() || !copy_bytes(file, 0, file.size(), hasher))
      throw Error("cannot read " + (folder / name).string());
    Leaf leaf{name.string(), 0, 0, true, hasher.digest(), description.payload, file.size(), "", {}};
    description.payload += leaf.size;
    description.leaves.push_back(std::move(leaf));
  }
  write_description(out, description);
  for (const Leaf& leaf : description.leaves) {
    const StoreFile file(folder / leaf.type);
    if (file.size() != leaf.size || !copy_bytes(file, 0, leaf.size, out))
      throw Error((folder / leaf.type).string() + " changed while it was read");
  }
}

/// Writes the files into a new folder. Returns false, or throws Error, if the entry is not the whole case of that key,
/// or if the files cannot be written; the folder is then gone or incomplete.
bool unpack_case(const StoreFile& file, const Digest& key, const fs::path& folder) {
  std::error_code error;
  fs::remove_all(folder, error);  // of an earlier try
  const ReadEntry entry = read_entry(file, key);
  for (const Leaf& leaf : entry.description.leaves) {
    if (!is_inside(leaf.type) || !leaf.present || !is_within(leaf, entry)) return false;
    const std::string fault = write_whole(folder / leaf.type, [&](Archive& out) {
      if (!copy_leaf(file, entry, leaf, out)) throw Error("it is not whole");
    });
    if (!fault.empty()) return false;
  }
  return !entry.description.leaves.empty();
}

}  // namespace

SharedStore::SharedStore(const fs::path& folder) : folder_(plain_path(fs::absolute(folder))) {}

std::shared_ptr<SharedStore> SharedStore::of_environment() {
  const char* folder = std::getenv("MARROW_SHARED_CACHE");
  return folder && *folder ? std::make_shared<SharedStore>(folder) : nullptr;
}

std::string SharedStore::fault() const { return examine_shared(folder_).fault; }

/// The folder's state, looked at once. Nothing if it cannot be used.
std::shared_ptr<const SharedFolderState> SharedStore::state() {
  if (is_off_) return nullptr;
  {
    const std::scoped_lock lock(mutex_);
    if (!state_) state_ = std::make_shared<const SharedFolderState>(make_shared(folder_));
    if (state_->is_store && !state_->may_write) is_read_only_ = true;
    if (state_->is_store) return state_;
  }
  complain(state_->fault, false);
  return nullptr;
}

void SharedStore::complain(const std::string& fault, bool only_writing) {
  const std::scoped_lock lock(mutex_);
  (only_writing ? is_read_only_ : is_off_) = true;
  const char* what_follows =
      only_writing ? "; nothing more is written to the shared store" : "; the shared store is not used";
  if (fault_.empty()) fault_ = fault + what_follows;
}

std::string SharedStore::complaint() {
  const std::scoped_lock lock(mutex_);
  return fault_.empty() || std::exchange(has_complained_, true) ? "" : fault_;
}

template <class Use>
bool SharedStore::read(const Digest& key, SharedLook look, const Use& use) {
  if (!state()) return false;
  std::string fault;
  const bool is_found = read_shared(
      entry_file(folder_, key), look,
      [&](const StoreFile& file) {
        try {
          return use(file);
        } catch (const Error&) {  // damaged, or not yet whole as this host sees it
          return false;
        }
      },
      fault);
  if (!fault.empty()) complain(fault, false);
  return is_found;
}

bool SharedStore::fetch(const Digest& key, const fs::path& to, SharedLook look, std::optional<StoredResult>& in_place) {
  return read(key, look, [&](const StoreFile& file) {
    ReadEntry entry = read_entry(file, key);
    file.mark_as_used_today();
    bool is_whole = true;
    const bool is_copied = file.size() <= most_copied() && write_whole(to, [&](Archive& out) {
                                                             is_whole = copy_entry(file, entry, out);
                                                             if (!is_whole) throw Error("it is not whole");
                                                           }).empty();
    if (!is_copied && is_whole) {
      in_place = StoredResult{{}, outputs_of(entry, entry_file(folder_, key))};
      in_place->provenance = std::move(entry.description.provenance);
    }
    return is_whole;
  });
}

bool SharedStore::accepts() { return state() && !is_read_only_ && (!is_limited_ || files_left_ > 0); }

void SharedStore::allow_files(long more) {
  files_left_ += more;
  is_limited_ = true;
}

template <class Write>
void SharedStore::write(const Digest& key, const Write& write) {
  const auto state = this->state();
  if (!state || is_read_only_) return;
  try {
    constexpr int kMostTries = 3;  // a handle of the folder may have become stale
    std::string fault = "not tried";
    for (int tries = 0; !fault.empty() && tries < kMostTries; ++tries)
      fault = write_whole(entry_file(folder_, key), write, false, state->permissions);
    if (!fault.empty()) complain(fault, true);
  } catch (const std::bad_alloc&) {  // it is kept in the local store, or the run says what it lacks
  }
}

void SharedStore::offer(const Digest& key, const std::vector<Value>& outputs, const Provenance& provenance) {
  if (provenance.seconds < kShortest_s || !accepts()) return;
  EntryDescription description;
  try {
    description = describe_entry(key, outputs, provenance);
  } catch (const std::exception&) {  // it cannot be kept in any store
    return;
  }
  if (provenance.seconds < kShortest_s_per_MB * megabytes(description.payload)) return;
  if (is_limited_ && files_left_-- <= 0) {
    ++files_left_;
    return;
  }
  write(key, [&](Archive& out) { write_entry(out, description, outputs); });
}

bool SharedStore::fetch_case(const Digest& key, const fs::path& folder, SharedLook look) {
  return read(key, look, [&](const StoreFile& file) {
    file.mark_as_used_today();
    return unpack_case(file, key, folder);
  });
}

void SharedStore::offer_case(const Digest& key, const fs::path& folder) {
  write(key, [&](Archive& out) { pack_case(out, key, folder); });
}

SharedClaim SharedStore::claim(const Digest& key, const std::atomic<bool>* cancelled,
                               const std::function<void(bool)>& on_wait) {
  const auto state = this->state();
  if (!state || is_read_only_) return {};
  std::string fault;
  SharedClaim claim = claim_file(folder_ / "claims" / key.hex(), state->permissions, cancelled, on_wait, fault);
  if (!fault.empty()) complain(fault, true);
  return claim;
}

std::vector<Store::Entry> SharedStore::entries() const {
  return examine_shared(folder_).is_store ? entries_in(folder_) : std::vector<Store::Entry>();
}

Store::Freed SharedStore::collect(std::uint64_t keep_bytes) const {
  const SharedFolderState state = examine_shared(folder_);
  if (state.is_store) return collect_in(folder_, keep_bytes, time_in(folder_, state.permissions));
  Store::Freed freed;
  freed.fault = state.fault;
  return freed;
}

}  // namespace marrow
