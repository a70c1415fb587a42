// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the fuzz targets share. A target is one LLVMFuzzerTestOneInput(): libFuzzer calls it, or the small driver of the
// ordinary tests. Whatever the bytes, only marrow::Error may come out of a reader: any other exception, a crash, a
// leak, more than 256 MB or more than 2 s is a finding.
#include <cstdint>
#include <filesystem>
#include <string_view>

#include "marrow/base/error.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace marrow::fuzz {

/// A folder of this process in memory, because the readers take paths. It is removed when the process ends, or by a
/// later process.
const std::filesystem::path& folder();

/// Writes a file into the folder, replaces an older one, and returns its path.
std::filesystem::path put(const std::string& name, std::string_view bytes);

/// Ends the process as a finding.
[[noreturn]] void finding(const std::string& what);

/// The bytes of one input. If a target reads several formats, the first byte chooses one, so that an input is one file.
struct Input {
  std::string_view rest;

  Input(const std::uint8_t* data, std::size_t size) : rest(reinterpret_cast<const char*>(data), size) {}
  /// Takes the first byte and returns one of the letters: the byte itself if it is one of them, otherwise the one that
  /// its value selects.
  char choice(std::string_view letters);
  /// The text before the first zero byte; the rest begins behind it.
  std::string_view text();
};

template <class Call>
void expect_value_or_error(Call call) {
  try {
    call();
  } catch (const Error&) {
  }
}

}  // namespace marrow::fuzz
