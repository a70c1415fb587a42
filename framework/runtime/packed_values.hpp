// SPDX-License-Identifier: Apache-2.0
#pragma once
// Values handed from one process to another: the packed data of one after the other, then their description, then where
// it is. Small pieces lie in memory that both share. Large ones are copied once, from one process's memory into the
// other's.
#include <sys/types.h>

#include <functional>
#include <string>
#include <vector>

#include "marrow/domain/error.hpp"
#include "marrow/runtime/value.hpp"

namespace marrow {

/// Memory without a name, as an open file. Throws Error.
class SharedMemory {
 public:
  SharedMemory();
  ~SharedMemory();
  SharedMemory(const SharedMemory&) = delete;
  SharedMemory& operator=(const SharedMemory&) = delete;
  int descriptor() const { return descriptor_; }

 private:
  int descriptor_;
};

/// Writes values into an open file. Large pieces stay where they are when `in_place`: only their addresses are written,
/// and the values must stay until they were read. Throws Error for functions, and where the file cannot take them.
void write_values(int descriptor, const std::vector<Value>& values, bool in_place);

/// How many bytes the file holds.
std::uint64_t bytes_in(int descriptor);

/// Knows how data of a type are unpacked; nullptr for a type that is not known.
using ContentOf = std::function<const Content*(const TypeInfo&)>;

/// Thrown where the memory of the other process cannot be read: the system does not allow it, or it is gone.
class NoAccess : public Error {
 public:
  using Error::Error;
};

/// Reads values back; pieces that stayed in place are read from the memory of `process`. Throws Error for bytes that
/// write_values() did not write, whatever they are.
std::vector<Value> read_values(int descriptor, pid_t process, const ContentOf& content_of);

/// The content of marrow's own types; nullptr for others.
const Content* content_of_own(const TypeInfo& type);

}  // namespace marrow
