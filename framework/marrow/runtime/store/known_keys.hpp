// SPDX-License-Identifier: Apache-2.0
#pragma once
// Keys of data that were made outside of a run, such as a volume made from a Python array. Large data are hashed once,
// however often they are given to a run.
#include <cstddef>
#include <map>
#include <memory>
#include <mutex>

#include "marrow/base/export.hpp"
#include "marrow/runtime/node/value.hpp"

namespace MARROW_EXPORT_TO_TESTS marrow {

/// Remembers the keys of data as long as these live. Data never change once a value has them. Safe to use from several
/// threads.
class KnownKeys {
 public:
  /// The digest of the content of an item that is here; its type must have a content.
  Digest key_of(const Value& item);

  /// Those of this process.
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
  std::size_t look_again_at_ = 64;  ///< number of entries from which on dead ones are looked for
};

}  // namespace marrow
