// SPDX-License-Identifier: Apache-2.0
#include "exif.hpp"

#include <cstdint>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/toolbox/files/input_file.hpp"

namespace marrow::files {
namespace {

/// The unsigned number of `width` bytes; 0 beyond the end.
std::uint32_t exif_number(std::string_view bytes, std::size_t at, std::size_t width, bool big_endian) {
  if (at > bytes.size() || width > bytes.size() - at) return 0;
  return std::uint32_t(number_in_bytes(bytes.substr(at, width), big_endian));
}

/// The Exif orientation (1 to 8) from the first directory of Exif data; 1 (not turned) if there is none.
std::uint32_t orientation_of(std::string_view exif) {
  const bool big_endian = exif.substr(0, 2) == "MM";
  if (!big_endian && exif.substr(0, 2) != "II") return 1;
  const std::size_t directory = exif_number(exif, 4, 4, big_endian),
                    entries = exif_number(exif, directory, 2, big_endian);
  for (std::size_t i = 0; i < entries && directory + 14 + 12 * i <= exif.size(); ++i) {
    const std::size_t entry = directory + 2 + 12 * i;
    if (exif_number(exif, entry, 2, big_endian) != 274) continue;
    const bool is_long = exif_number(exif, entry + 2, 2, big_endian) == 4;
    return exif_number(exif, entry + 8, is_long ? 4 : 2, big_endian);
  }
  return 1;
}

}  // namespace

void check_not_turned(const std::string& what, std::string_view exif) {
  if (const auto orientation = orientation_of(exif); orientation >= 2 && orientation <= 8)
    throw Error(
        formatted("{}: is to be shown turned or mirrored (Exif Orientation {}), but its pixels are not; save it "
                  "turned, without Orientation",
                  what, orientation));
}

}  // namespace marrow::files
