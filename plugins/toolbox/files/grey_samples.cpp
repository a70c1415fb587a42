// SPDX-License-Identifier: Apache-2.0
// Images that are stored in colours but are grey, as screens and frame grabbers save X-ray images.
#include <cstring>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "samples.hpp"

namespace marrow::files {
namespace {

/// Where a pixel is, for a message.
std::string place_of_pixel(const Samples& samples, std::size_t pixel) {
  const std::size_t width = std::size_t(samples.size[0]), height = std::size_t(samples.size[1]);
  return formatted("the pixel at column {} of row {}", pixel % width + 1, pixel / width % height + 1);
}

/// Keeps the first of several equal samples of each pixel. An opacity (the last of 2 or 4) must be full.
template <class T>
void keep_grey(const std::string& what, Samples& samples, T opaque) {
  const std::size_t each = std::size_t(samples.components), colours = each < 3 ? 1 : 3;
  for (std::size_t pixel = 0; pixel < samples.count(); ++pixel) {
    T values[4];
    std::memcpy(values, samples.bytes.data() + pixel * each * sizeof(T), each * sizeof(T));
    for (std::size_t k = 1; k < colours; ++k)
      if (values[k] != values[0])
        throw Error(formatted(
            "{}: has colours: {} has red {}, green {}, blue {}; an X-ray image is grey: save it as grey levels", what,
            place_of_pixel(samples, pixel), values[0], values[1], values[2]));
    if (each > colours && values[colours] != opaque)
      throw Error(
          formatted("{}: is transparent in places: {} has the opacity {}, expected {}; save it without transparency "
                    "(an alpha channel)",
                    what, place_of_pixel(samples, pixel), values[colours], opaque));
    std::memcpy(samples.bytes.data() + pixel * sizeof(T), values, sizeof(T));
  }
}

}  // namespace

void make_grey(const std::string& what, Samples& samples) {
  if (samples.components == 1) return;
  const bool is_read = samples.type == Samples::Type::u8 || samples.type == Samples::Type::u16;
  if (samples.bytes.empty() || samples.components > 4 || !is_read)
    throw Error(
        formatted("{}: has {} channels; an X-ray image has one: save it as grey levels", what, samples.components));
  samples.type == Samples::Type::u8 ? keep_grey<std::uint8_t>(what, samples, 255)
                                    : keep_grey<std::uint16_t>(what, samples, 65535);
  samples.bytes.resize(samples.count() * bytes_each(samples.type));
  samples.components = 1;
}

}  // namespace marrow::files
