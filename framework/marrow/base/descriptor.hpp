// SPDX-License-Identifier: Apache-2.0
#pragma once
// The one owner of an open file, and the loops that read and write whole pieces of it.
#include <cstdint>
#include <string_view>
#include <utility>

#include "marrow/base/export.hpp"

namespace MARROW_EXPORT marrow {

/// Owns an open file and closes it at the end. Converts to its number, which is negative if no file is open.
class Descriptor {
 public:
  Descriptor() = default;
  explicit Descriptor(int number) : number_(number) {}
  Descriptor(Descriptor&& other) noexcept : number_(other.release()) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  ~Descriptor();

  operator int() const { return number_; }
  bool is_open() const { return number_ >= 0; }
  /// Returns false, with errno, if what was written is lost: some file systems report only now that there is no space.
  bool close();
  /// Gives the number away: whoever takes it closes it.
  int release() { return std::exchange(number_, -1); }

 private:
  int number_ = -1;
};

struct Pipe {
  Descriptor read_end, write_end;  ///< both closed, with errno, if no more files can be opened
};
Pipe open_pipe();

/// Writes all bytes, in several parts if necessary. Returns false, with errno, if that fails.
bool write_all(int descriptor, std::string_view bytes);

/// Reads from an offset, in several parts if necessary. Returns how many bytes were read: fewer than wanted only at the
/// end of the file; -1, with errno, if it cannot be read.
std::int64_t read_at(int descriptor, void* to, std::size_t wanted, std::uint64_t offset);

}  // namespace marrow
