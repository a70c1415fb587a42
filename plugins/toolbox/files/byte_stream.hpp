// SPDX-License-Identifier: Apache-2.0
#pragma once
// Streams of samples from a file, plain or decompressed on the way. So no more memory is needed than for the samples
// that the header claims.
#include <memory>

#include "marrow/toolbox/files/input_file.hpp"

namespace marrow::files {

class ByteStream {
 public:
  virtual ~ByteStream() = default;
  /// Copies the next `count` bytes, or fewer at the end. Returns how many. Throws Error if the stream is damaged.
  virtual std::size_t take(void* to, std::size_t count) = 0;
  /// Number of bytes after the end of a compressed stream. Valid only after all of the stream was taken.
  virtual std::uint64_t bytes_behind() const { return 0; }
};

/// The bytes of a file between two offsets. The file must outlive the stream.
std::unique_ptr<ByteStream> plain_bytes(const InputFile& file, std::uint64_t begin, std::uint64_t end);
/// The decompressed bytes of a zlib or gzip stream between two offsets. Reading to the end verifies the checksum.
std::unique_ptr<ByteStream> unpacked_bytes(const InputFile& file, std::uint64_t begin, std::uint64_t end);
/// The same of a Deflate stream without a header or checksum.
std::unique_ptr<ByteStream> bare_unpacked_bytes(const InputFile& file, std::uint64_t begin, std::uint64_t end);
/// The decompressed bytes of a gzip file, or the bytes of any other file.
std::unique_ptr<ByteStream> bytes_of_gzip_or_plain(const InputFile& file);

/// Takes `count` bytes. Throws Error if there are fewer.
void take_all(ByteStream& stream, const InputFile& file, void* to, std::size_t count);
/// Throws Error if bytes are left: a header that claims too little is as wrong as one that claims too much.
void expect_end(ByteStream& stream, const InputFile& file);

}  // namespace marrow::files
