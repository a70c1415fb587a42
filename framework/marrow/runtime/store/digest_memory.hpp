// SPDX-License-Identifier: Apache-2.0
#pragma once
// Digests that are not computed again: the store of a host keeps those of large files, so that a whole CT is not read
// by every process. A process keeps the keys of data that were made outside of a run, such as a volume made from a
// Python array, because several runs may use them.
#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>

#include "marrow/base/regular_file.hpp"
#include "marrow/runtime/node/value.hpp"

namespace MARROW_EXPORT marrow {

/// From now on, this process finds digests of large files in the store of this folder, and keeps them there.
void keep_digests_in(const std::filesystem::path& store);

/// The digest of a large file in this state, which must be settled (is_settled()). If it is not kept, calls make(),
/// while other processes of this host wait for it. It is kept if the file still has the state afterwards. Small files
/// are not kept. A damaged record counts as absent.
Digest digest_in_state(const std::filesystem::path& file, const FileState& state, const std::function<Digest()>& make);

}  // namespace marrow

namespace MARROW_EXPORT_TO_TESTS marrow {

/// Remembers the keys of data for as long as the data exist. Data never change once a value holds them. Safe to use
/// from several threads.
class KnownKeys {
 public:
  /// The digest of an item's content. The item must have its data, and its type a content.
  Digest key_of(const Value& item);

  /// The keys of this process.
  static KnownKeys& all();

 private:
  struct Entry {
    std::weak_ptr<const void> data;  ///< a later object may lie at the same address
    std::string type;
    Digest key;
  };
  void forget_dead();

  std::mutex mutex_;
  std::map<const void*, Entry> entries_;
  std::size_t look_again_at_ = 64;  ///< with this many entries, expired ones are removed
};

}  // namespace marrow
