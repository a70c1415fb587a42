// SPDX-License-Identifier: Apache-2.0
#pragma once
// Values in memory that two processes share: the packed data of one after the other, then their description, then where it is.
#include <functional>
#include <string>
#include <vector>

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

/// Writes values into an open file, one list after the other. Throws Error for functions, and where the file cannot take them.
void write_values(int descriptor, const std::vector<Value>& values);

/// How many bytes the file holds.
std::uint64_t bytes_in(int descriptor);

/// Knows how data of a type are unpacked; nullptr for a type that is not known.
using ContentOf = std::function<const Content*(const TypeInfo&)>;

/// Reads values back. Nobody may write to the file any more. Throws Error for bytes that write_values() did not write.
std::vector<Value> read_values(int descriptor, const ContentOf& content_of);

/// The content of marrow's own types; nullptr for others.
const Content* content_of_own(const TypeInfo& type);

}  // namespace marrow
