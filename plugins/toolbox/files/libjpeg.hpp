// SPDX-License-Identifier: Apache-2.0
#pragma once
// libjpeg's errors. Its warnings, for example about data that end too early, are treated as errors.
#include <csetjmp>
#include <cstddef>
#include <cstdio>
// jpeglib.h needs stdio.h before it.
#include <jpeglib.h>

namespace marrow::files {

struct JpegFailure {
  jpeg_error_mgr manager;
  std::jmp_buf back;  ///< errors jump here; no object with a destructor may live between setjmp and such a jump
  char text[JMSG_LENGTH_MAX];
};

inline void on_jpeg_error(j_common_ptr state) {
  JpegFailure& failure = *reinterpret_cast<JpegFailure*>(state->err);
  state->err->format_message(state, failure.text);
  std::longjmp(failure.back, 1);
}

inline void on_jpeg_message(j_common_ptr state, int level) {
  if (level < 0) on_jpeg_error(state);
}

/// A decompressor, which is freed at the end.
struct JpegReader {
  JpegReader() {
    state.err = jpeg_std_error(&failure.manager);
    failure.manager.error_exit = on_jpeg_error;
    failure.manager.emit_message = on_jpeg_message;
    jpeg_create_decompress(&state);
  }
  ~JpegReader() { jpeg_destroy_decompress(&state); }
  jpeg_decompress_struct state{};
  JpegFailure failure{};
};

/// Decompresses all rows after the header. Jumps back on an error.
inline void read_jpeg_rows(jpeg_decompress_struct& state, std::byte* to, std::size_t row_bytes) {
  jpeg_start_decompress(&state);
  while (state.output_scanline < state.output_height) {
    JSAMPROW row = reinterpret_cast<JSAMPROW>(to) + state.output_scanline * row_bytes;
    jpeg_read_scanlines(&state, &row, 1);
  }
  jpeg_finish_decompress(&state);
}

}  // namespace marrow::files
