// SPDX-License-Identifier: Apache-2.0
#pragma once
// Inputs of Python nodes in memory that all of their processes map. Each value is packed only once, even if several
// processes use it.
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <vector>

#include "marrow/base/export.hpp"
#include "marrow/runtime/process/packed_values.hpp"

namespace MARROW_EXPORT_TO_TESTS marrow {

/// The packed data of one value. The samples of a volume or signed field are at the beginning, where any process can
/// use them in place. The packed value follows, without them.
struct SharedInput {
  SharedMemory memory;
  std::uint64_t number = 0;         ///< no other value of this process ever has it
  std::uint64_t samples_bytes = 0;  ///< 0 for other types
  std::uint64_t bytes = 0;
};

/// Keeps the packed data while the values live, up to a limit of memory. Safe to use from several threads.
class SharedInputs {
 public:
  explicit SharedInputs(std::uint64_t most_bytes) : most_bytes_(most_bytes) {}
  /// The packed data of one item. Throws Error if there is no memory to share.
  std::shared_ptr<const SharedInput> share(const Value& item);
  /// The numbers of all that is kept. A process may unmap everything else.
  std::vector<std::uint64_t> numbers() const;

  /// The inputs of this process.
  static SharedInputs& all();

 private:
  struct Entry {
    std::weak_ptr<const void> data;
    const void* address = nullptr;  ///< with the type, it identifies the value while its data live
    std::string type;
    std::shared_ptr<const SharedInput> packed;
  };
  void forget_dead();
  void forget_oldest();

  std::uint64_t most_bytes_;
  mutable std::mutex mutex_;
  std::list<Entry> entries_;  ///< the most recently used comes first
  std::uint64_t last_number_ = 0;
};

}  // namespace marrow
