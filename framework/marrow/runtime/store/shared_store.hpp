// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "marrow/runtime/store/store.hpp"

namespace MARROW_EXPORT marrow {

class SharedClaim;
struct SharedFolderState;
enum class SharedLook;

/// Results in a folder that several hosts and users see (NFS, Lustre, BeeGFS). It supports the store of each host but
/// does not replace it: a fault here is reported once (complaint()), and runs continue without it.
///
/// Each file is written under a temporary name and then renamed. Everything that is read is checked by its hash. So a
/// file counts as absent if another host sees it too early, in part or damaged. Nothing relies on locks, on equal
/// clocks, or on numbers of processes of other hosts. Safe to use from several threads.
class SharedStore {
 public:
  explicit SharedStore(const std::filesystem::path& folder);
  /// The shared store in MARROW_SHARED_CACHE; nullptr if that is not set.
  static std::shared_ptr<SharedStore> of_environment();
  const std::filesystem::path& folder() const { return folder_; }
  /// Why the folder cannot be used, or an empty text. Makes nothing.
  std::string fault() const;
  /// The first fault, or an empty text if there was none. The fault is returned only once.
  std::string complaint();

  /// Copies the result of a key to a file of another store. Returns false if the result is not there, or is not whole.
  /// If it is too large to be copied, or cannot be, `in_place` receives the result; it is read when it is needed.
  bool fetch(const Digest& key, const std::filesystem::path& to, SharedLook look,
             std::optional<StoredResult>& in_place);
  /// Keeps a result if reading it is much quicker than making it again, and if another file may be written
  /// (allow_files()).
  void offer(const Digest& key, const std::vector<Value>& outputs, const Provenance& provenance);
  /// Limits how many results are kept. A comparison allows one for each of its cells; otherwise there is no limit.
  void allow_files(long more);
  /// Whether offer() may keep anything at all.
  bool accepts();

  /// The same for a simulated case, a folder with files. It is one file here. fetch_case() writes to a new folder.
  bool fetch_case(const Digest& key, const std::filesystem::path& folder, SharedLook look);
  void offer_case(const Digest& key, const std::filesystem::path& folder);

  /// The right to make a result, among all hosts. It is empty if others cannot be asked.
  SharedClaim claim(const Digest& key, const std::atomic<bool>* cancelled,
                    const std::function<void(bool waits)>& on_wait = {});

  /// As the functions of Store. collect() is called only when people ask for it.
  std::vector<Store::Entry> entries() const;
  Store::Freed collect(std::uint64_t keep_bytes) const;

 private:
  std::shared_ptr<const SharedFolderState> state();
  void complain(const std::string& fault, bool only_writing);
  template <class Use>
  bool read(const Digest& key, SharedLook look, const Use& use);
  template <class Write>
  void write(const Digest& key, const Write& write);

  std::filesystem::path folder_;
  std::mutex mutex_;
  std::shared_ptr<const SharedFolderState> state_;
  std::string fault_;
  bool has_complained_ = false;
  std::atomic<bool> is_off_{false}, is_read_only_{false};
  std::atomic<bool> is_limited_{false};
  std::atomic<long> files_left_{0};
};

}  // namespace marrow
