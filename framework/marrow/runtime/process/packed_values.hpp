// SPDX-License-Identifier: Apache-2.0
#pragma once
// Hands values from one process to another. A file has the packed data of the values one after the other, then their
// description, then the place of the description. Small pieces are in memory that both processes share. Large pieces
// are copied once, from the memory of one process to that of the other.
#include <sys/types.h>

#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "marrow/base/descriptor.hpp"
#include "marrow/runtime/node/value.hpp"

namespace MARROW_EXPORT marrow {

/// Memory without a name, as an open file. Throws Error if it cannot be made.
class SharedMemory {
 public:
  SharedMemory();
  int descriptor() const { return descriptor_; }
  /// From now on nobody can write to it, not even a process that opens it through /proc. Throws Error if the system
  /// does not allow this.
  void seal() const;

 private:
  Descriptor descriptor_;
};

/// Writes values to an open file. With `in_place`, large pieces stay where they are and only their addresses are
/// written; the values must then stay until they are read. Throws Error for functions, and if the file cannot be
/// written.
void write_values(int descriptor, const std::vector<Value>& values, bool in_place);

/// How many bytes the file holds.
std::uint64_t bytes_in(int descriptor);

/// Returns the Content that unpacks data of a type; nullptr for a type that is not known.
using ContentOf = std::function<const Content*(const TypeInfo&)>;

/// Thrown if the memory of the other process cannot be read: the system does not allow it, or the process is gone.
class NoAccess : public Error {
 public:
  using Error::Error;
};

/// Reads values back. Pieces that stayed in place are read from the memory of `process`. Throws Error for any bytes
/// that write_values() did not write, and NoAccess if that memory cannot be read.
std::vector<Value> read_values(int descriptor, pid_t process, const ContentOf& content_of);

/// The Content of marrow's own types; nullptr for other types.
const Content* content_of_own(const TypeInfo& type);

// Inputs of Python nodes in memory that all of their processes map. Each value is packed only once, even if several
// processes use it.

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
