// SPDX-License-Identifier: Apache-2.0
#include <png.h>
#include <webp/encode.h>

#include <cstring>
#include <vector>

#include "marrow/domain/base64.hpp"
#include "marrow/domain/error.hpp"
#include "report/report.hpp"

namespace marrow::cli {

std::string picture_url(const std::filesystem::path& png_file, int size_px) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  if (!png_image_begin_read_from_file(&image, png_file.c_str())) throw Error(png_file.string() + ": " + image.message);
  image.format = PNG_FORMAT_RGB;
  std::vector<std::uint8_t> pixels(PNG_IMAGE_SIZE(image));
  if (!png_image_finish_read(&image, nullptr, pixels.data(), 0, nullptr)) throw Error(png_file.string() + ": " + image.message);

  WebPConfig config;
  WebPPicture picture;
  WebPConfigInit(&config);
  WebPPictureInit(&picture);
  config.quality = 85;
  config.method = 2;  // thin lines stay sharp enough, and it is four times faster than the default
  picture.width = int(image.width);
  picture.height = int(image.height);
  WebPMemoryWriter writer;
  WebPMemoryWriterInit(&writer);
  picture.writer = WebPMemoryWrite;
  picture.custom_ptr = &writer;
  const double scale = double(size_px) / std::max(picture.width, picture.height);
  bool good = WebPPictureImportRGB(&picture, pixels.data(), 3 * picture.width);
  if (good && scale < 1) good = WebPPictureRescale(&picture, std::max(1, int(scale * picture.width)), std::max(1, int(scale * picture.height)));
  good = good && WebPEncode(&config, &picture);
  std::string url;
  if (good) url = "data:image/webp;base64," + base64({reinterpret_cast<const char*>(writer.mem), writer.size});
  WebPPictureFree(&picture);
  WebPMemoryWriterClear(&writer);
  if (!good) throw Error(png_file.string() + ": cannot be encoded as WebP");
  return url;
}

}  // namespace marrow::cli
