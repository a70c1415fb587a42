// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstring>
#include <string_view>

namespace marrow::files {

/// Unpacks PackBits data until there are `bytes` bytes or no data are left. Returns the number of bytes. Returns 0 if
/// there are more than `bytes`, if a run is cut off, or if more than one byte of filling follows.
inline std::size_t unpack_packbits(std::string_view packed, std::byte* to, std::size_t bytes) {
  std::size_t done = 0, at = 0;
  while (done < bytes && at < packed.size()) {
    const int byte = static_cast<unsigned char>(packed[at++]), control = byte < 128 ? byte : byte - 256;
    if (control == -128) continue;
    const std::size_t count = std::size_t(control < 0 ? 1 - control : 1 + control), stored = control < 0 ? 1 : count;
    if (count > bytes - done || stored > packed.size() - at) return 0;
    control < 0 ? std::memset(to + done, packed[at], count) : std::memcpy(to + done, packed.data() + at, count);
    done += count;
    at += stored;
  }
  return packed.size() - at > 1 ? 0 : done;
}

}  // namespace marrow::files
