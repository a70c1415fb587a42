// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/store/store_collect.hpp"

#include <chrono>
#include <cstdlib>

#include "marrow/base/temporary_folder.hpp"
#include "marrow/base/text_file.hpp"
#include "marrow/runtime/store/shared_folder.hpp"
#include "marrow/runtime/store/store_entry.hpp"
#include "marrow/runtime/store/store_folder.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;
using Kind = StoreItem::Kind;
using FileClock = fs::file_time_type::clock;

constexpr auto kDay = std::chrono::hours(24);
constexpr auto kMinute = std::chrono::minutes(1);

std::uint64_t bytes_of(const fs::path& path) {
  std::error_code error;
  if (!fs::is_directory(path, error)) {
    const std::uintmax_t size = fs::file_size(path, error);
    return error ? 0 : size;
  }
  std::uint64_t sum = 0;
  for (fs::recursive_directory_iterator at(path, error), end; !error && at != end; at.increment(error)) {
    std::error_code gone;
    const bool is_file = fs::is_regular_file(at->symlink_status(gone));
    const std::uintmax_t size = is_file ? at->file_size(gone) : 0;
    if (!gone) sum += size;
  }
  return sum;
}

/// Returns false, with the reason in `error`, if a part of the item could not be removed. A simulated case is renamed
/// first, so that no process takes half of it for the whole. A case that is in use stays.
bool remove_item(const StoreItem& item, std::error_code& error) {
  error.clear();
  fs::path path = item.path;
  if (item.kind == Kind::simulated_case) {
    path = temporary_beside(item.path);
    rename_unused(item.path, path, error);
  }
  if (!error) fs::remove_all(path, error);
  return !error;
}

/// Brings a store back to its size. Each item is looked at once, and so is each folder that holds items.
class Collection {
 public:
  Collection(const fs::path& folder, const std::optional<timespec>& now, const std::atomic<bool>* cancelled)
      : folder_(folder), now_(now), cancelled_(cancelled) {}

  Store::Freed reduce_to(std::uint64_t keep_bytes) {
    for (StoreItem& item : items_of_store(folder_, freed_.fault)) {
      if (is_stopped()) return freed_;
      take(std::move(item));
    }
    std::sort(kept_.begin(), kept_.end(), [](const Kept& a, const Kept& b) { return a.used < b.used; });
    const std::optional<fs::file_time_type> oldest_kept = remove_oldest(keep_bytes);
    if (oldest_kept) remove_remembered(*oldest_kept - kDay);
    return freed_;
  }

 private:
  struct Kept {
    StoreItem item;
    std::uint64_t bytes = 0;
    fs::file_time_type used;
  };

  bool is_stopped() const { return cancelled_ && cancelled_->load(); }

  /// Whether something is mounted on the folder that holds the item, on the item, or below it. Mounted files belong to
  /// somebody else.
  bool is_mounted(const StoreItem& item) {
    const fs::path parent = item.path.parent_path();
    const auto [known, is_new] = is_mounted_folder_.try_emplace(parent, false);
    if (is_new) known->second = parent != folder_ && is_mount(parent);
    return known->second || mount_at_or_below(item.path);
  }

  bool remove(const StoreItem& item) {
    if (remove_item(item, error_)) return true;
    const bool is_fault =
        error_ != std::errc::no_such_file_or_directory && error_ != std::errc::device_or_resource_busy;
    if (is_fault && freed_.fault.empty())
      freed_.fault = "cannot remove " + item.path.string() + ": " + error_.message();
    return false;
  }

  /// Removes what killed processes left behind, and notes everything else.
  void take(StoreItem item) {
    if (is_mounted(item)) {
      freed_.fault = item.path.string() + " is left, because something is mounted there; unmount that first";
      return;
    }
    if (item.kind == Kind::claim) item.writer = owner_of_claim(item.path);
    if (item.kind == Kind::temporary || item.kind == Kind::claim) {
      if (is_abandoned(item, now_))
        remove(item);
      else if (!now_ && freed_.fault.empty())
        freed_.fault = item.path.string() + " is left, because its age is unknown: no file can be written beside it";
      return;
    }
    if (item.kind == Kind::remembered) {
      remembered_.push_back(std::move(item));
      return;
    }
    error_.clear();
    Kept kept{item, bytes_of(item.path), fs::last_write_time(item.path, error_)};
    if (error_) return;  // another process has just removed it
    total_bytes_ += kept.bytes;
    kept_.push_back(std::move(kept));
  }

  /// Removes entries and cases until the rest is small enough. Returns when the oldest of the rest was last used; the
  /// latest possible time if nothing is to be kept; nothing if the time is unknown.
  std::optional<fs::file_time_type> remove_oldest(std::uint64_t keep_bytes) {
    for (const Kept& one : kept_) {
      if (is_stopped()) return std::nullopt;
      if (total_bytes_ <= keep_bytes) return keep_bytes == 0 ? fs::file_time_type::max() : one.used;
      const bool is_removed = remove(one.item);
      if (is_removed || error_ == std::errc::no_such_file_or_directory) total_bytes_ -= one.bytes;
      if (!is_removed) continue;
      freed_.bytes += one.bytes;
      ++freed_.entries;
    }
    return keep_bytes == 0 ? std::optional(fs::file_time_type::max()) : std::nullopt;
  }

  /// Removes old records of what nodes last made. A record is written when a call begins, and the call may take long.
  /// So the result of a record is certainly gone only if the record is much older than all results that are kept.
  void remove_remembered(fs::file_time_type oldest) {
    std::error_code error;
    for (const StoreItem& item : remembered_) {
      if (is_stopped()) return;
      if (fs::last_write_time(item.path, error) < oldest && !error) remove_item(item, error);
    }
  }

  const fs::path& folder_;
  const std::optional<timespec>& now_;
  const std::atomic<bool>* cancelled_;
  std::map<fs::path, bool> is_mounted_folder_;
  std::vector<Kept> kept_;
  std::vector<StoreItem> remembered_;
  std::uint64_t total_bytes_ = 0;
  std::error_code error_;  ///< of the last item
  Store::Freed freed_;
};

}  // namespace

std::string given_gigabytes() {
  const char* text = std::getenv("MARROW_CACHE_GB");
  return text && *text ? text : "20";
}

std::vector<Store::Entry> entries_in(const fs::path& folder) {
  std::vector<Store::Entry> entries;
  std::string fault;
  for (const StoreItem& item : items_of_store(folder, fault)) {
    if (item.kind != Kind::entry) continue;
    const StoreFile file(item.path);
    if (!file.is_open()) continue;
    Store::Entry entry{item.key, file.size(), {}, {}, {}};
    std::error_code ignored;
    entry.used = fs::last_write_time(item.path, ignored);
    try {
      ReadEntry read = read_entry(file, item.key);
      entry.provenance = std::move(read.description.provenance);
      for (const Leaf& leaf : read.description.leaves)
        if (leaf.present) entry.outputs.push_back(leaf.key);
    } catch (const Error&) {  // listed nevertheless, so that it can be collected
    }
    entries.push_back(std::move(entry));
  }
  if (!fault.empty()) throw Error(fault);
  std::sort(entries.begin(), entries.end(),
            [](const Store::Entry& a, const Store::Entry& b) { return a.used < b.used; });
  return entries;
}

Store::Freed collect_in(const fs::path& folder, std::uint64_t keep_bytes, const std::optional<timespec>& now,
                        const std::atomic<bool>* cancelled) {
  return Collection(folder, now, cancelled).reduce_to(keep_bytes);
}

std::vector<Store::Entry> Store::entries() const { return is_there() ? entries_in(folder_) : std::vector<Entry>(); }

Store::Freed Store::collect(std::uint64_t keep_bytes) const {
  const FolderState state = examine_store(folder_);
  if (state.is_store) return collect_in(folder_, keep_bytes, time_in(folder_));
  Freed freed;
  freed.fault = state.fault;
  return freed;
}

std::string Store::tidy(const std::atomic<bool>* cancelled) const {
  const auto limit = bytes_of_gigabytes(given_gigabytes());
  if (!limit)
    return "MARROW_CACHE_GB is '" + given_gigabytes() +
           "', but must be a number of gigabytes from 0 to 1000000; nothing is removed";
  if (!is_there()) return "";
  const fs::path mark = folder_ / "tidied";
  std::error_code error;
  const auto age = FileClock::now() - fs::last_write_time(mark, error);
  if (!error && age >= FileClock::duration::zero() && age < kMinute) return "";  // a mark from the future says nothing
  constexpr std::string_view kText = "when the store was last brought back to its size\n";
  write_whole(mark, [&](Archive& out) { out.bytes(kText.data(), kText.size()); });
  return collect_in(folder_, *limit, time_in(folder_), cancelled).fault;
}

}  // namespace marrow
