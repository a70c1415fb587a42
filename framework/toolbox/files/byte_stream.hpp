// SPDX-License-Identifier: Apache-2.0
#pragma once
// Samples one after the other, out of a file as they are or unpacked on the way, so that no more memory is taken than
// they are claimed to need.
#include <memory>

#include "marrow/toolbox/files/input_file.hpp"

namespace marrow::files {

class ByteStream {
 public:
  virtual ~ByteStream() = default;
  /// The next bytes: `count` of them, or fewer at the end. Throws Error where the stream is damaged.
  virtual std::size_t take(void* to, std::size_t count) = 0;
  /// Bytes that lie behind the end of a packed stream; only after all of it was taken.
  virtual std::uint64_t bytes_behind() const { return 0; }
};

/// The bytes of a file between two places.
std::unique_ptr<ByteStream> plain_bytes(const InputFile& file, std::uint64_t begin, std::uint64_t end);
/// The bytes that a zlib or gzip stream between two places unpacks to. Its checksum is verified by reading to its end.
std::unique_ptr<ByteStream> unpacked_bytes(const InputFile& file, std::uint64_t begin, std::uint64_t end);
/// Of a gzip file what it unpacks to, of any other the bytes as they are.
std::unique_ptr<ByteStream> bytes_of_gzip_or_plain(const InputFile& file);

/// Throws Error unless exactly `count` bytes come next.
void take_all(ByteStream& stream, const InputFile& file, void* to, std::size_t count);
/// Throws Error where bytes are left: a header that claims too little is as wrong as one that claims too much.
void expect_end(ByteStream& stream, const InputFile& file);

}  // namespace marrow::files
