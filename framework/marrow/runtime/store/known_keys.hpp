// SPDX-License-Identifier: Apache-2.0
#pragma once
// Keys of data that were made outside of a run, such as a volume made from a Python array. Large data are hashed only
// once, even if several runs use them.
#include <cstddef>
#include <map>
#include <memory>
#include <mutex>

#include "marrow/base/export.hpp"
#include "marrow/runtime/node/value.hpp"

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
