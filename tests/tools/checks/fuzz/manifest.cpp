// SPDX-License-Identifier: Apache-2.0
// Manifests: as they are, and with the right checksum, without which nothing else of them is read.
#include "marrow/runtime/plugins/manifest.hpp"

#include "target.hpp"

namespace {

using namespace marrow;

/// nlohmann's writer is recursive.
bool is_deep(std::string_view text) {
  int depth = 0, deepest = 0;
  for (const char c : text) {
    depth += c == '[' || c == '{' ? 1 : c == ']' || c == '}' ? -1 : 0;
    deepest = std::max(deepest, depth);
  }
  return deepest > 500;
}

std::string sealed(std::string_view text) {
  if (is_deep(text)) return std::string(text);
  nlohmann::json j = nlohmann::json::parse(text, nullptr, false);
  if (!j.is_object()) return std::string(text);
  j.erase("checksum");
  try {
    return with_checksum(j);
  } catch (const nlohmann::json::exception&) {  // not UTF-8
    return std::string(text);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Input input(data, size);
  const bool mended = input.choice("cr") == 'c';
  const std::string text = mended ? sealed(input.rest) : std::string(input.rest);
  fuzz::expect_value_or_error([&] {
    const LibraryInfo info = manifest_from_text(text);
    const std::string again = manifest_text(info);
    if (manifest_text(manifest_from_text(again)) != again)
      fuzz::finding("a manifest is read as another one than was written:\n" + again);
  });
  return 0;
}
