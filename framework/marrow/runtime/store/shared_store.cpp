// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/store/shared_store.hpp"

#include "marrow/runtime/store/shared_claim.hpp"
#include "marrow/runtime/store/shared_folder.hpp"

#include <cerrno>
#include <cstdlib>
#include <new>

#include "marrow/base/plain_path.hpp"
#include "marrow/runtime/store/shared_case.hpp"
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
  const char* text = std::getenv("MARROW_CACHE_GB");
  const auto limit = bytes_of_gigabytes(text && *text ? text : "20");
  return std::uint64_t(kShareOfLocal * double(limit.value_or(0)));
}

}  // namespace

SharedStore::SharedStore(const fs::path& folder) : folder_(plain_path(fs::absolute(folder))) {}

std::shared_ptr<SharedStore> SharedStore::of_environment() {
  const char* folder = std::getenv("MARROW_SHARED_CACHE");
  return folder && *folder ? std::make_shared<SharedStore>(folder) : nullptr;
}

fs::path SharedStore::file_of(const Digest& key) const {
  const std::string name = key.hex();
  return folder_ / name.substr(0, 2) / name;
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
  if (fault_.empty())
    fault_ =
        fault + (only_writing ? "; nothing more is written to the shared store" : "; the shared store is not used");
}

std::string SharedStore::complaint() {
  const std::scoped_lock lock(mutex_);
  return fault_.empty() || std::exchange(has_complained_, true) ? "" : fault_;
}

bool SharedStore::fetch(const Digest& key, const fs::path& to, SharedLook look, std::optional<StoredResult>& in_place) {
  if (!state()) return false;
  const fs::path path = file_of(key);
  std::string fault;
  const bool is_found = read_shared(
      path, look,
      [&](const StoreFile& file) {
        try {
          ReadEntry entry = read_entry(file, key);
          file.mark_as_used_today();
          bool is_whole = true;
          const bool is_copied = file.size() <= most_copied() && write_whole(to, [&](Archive& out) {
                                                                   is_whole = copy_entry(file, entry, out);
                                                                   if (!is_whole) throw Error("it is not whole");
                                                                 }).empty();
          if (!is_copied && is_whole) {
            in_place = StoredResult{{}, outputs_of(entry, path)};
            in_place->provenance = std::move(entry.description.provenance);
          }
          return is_whole;
        } catch (const Error&) {  // damaged, or not yet whole as this host sees it
          return false;
        }
      },
      fault);
  if (!fault.empty()) complain(fault, false);
  return is_found;
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
      fault = write_whole(file_of(key), write, false, state->permissions);
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
  if (!state()) return false;
  std::string fault;
  const bool is_found = read_shared(
      file_of(key), look,
      [&](const StoreFile& file) {
        file.mark_as_used_today();
        return unpack_case(file, key, folder);
      },
      fault);
  if (!fault.empty()) complain(fault, false);
  return is_found;
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
