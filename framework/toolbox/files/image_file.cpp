// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstring>

#include "dicom_pixels.hpp"
#include "header_lines.hpp"
#include "marrow/domain/error.hpp"
#include "marrow/toolbox/files/sequence_files.hpp"
#include "marrow/toolbox/files/volume_file.hpp"
#include "marrow/toolbox/files/xray_header.hpp"
#include "samples.hpp"

namespace marrow::files {
namespace {

namespace fs = std::filesystem;

void check_one_channel(int channels, const fs::path& path) {
  if (channels != 1)
    throw Error(path.string() + ": has " + std::to_string(channels) +
                " channels; an X-ray image has one: save it as grey levels");
}

void check_frame(int frame, long long frames, const fs::path& path, const std::string& several) {
  if (frames != 1 && frame == 0) throw Error(path.string() + ": has " + std::to_string(frames) + several);
  if (frame > frames)
    throw Error(path.string() + ": has " + std::to_string(frames) + " frames; there is no frame " +
                std::to_string(frame));
}

void check_finite(const Image& image, const fs::path& path) {
  if (image.pixels.type() != CV_32F) return;
  for (const float value : cv::Mat_<float>(image.pixels))
    if (!std::isfinite(value)) throw Error(path.string() + ": has pixels that are not finite numbers");
}

/// One page or frame of samples (from 1) as an image.
Image image_of(const Samples& samples, int frame, const fs::path& path) {
  const int type = samples.type == Samples::Type::u8    ? CV_8U
                   : samples.type == Samples::Type::u16 ? CV_16U
                   : samples.type == Samples::Type::f32 ? CV_32F
                                                        : -1;
  if (type < 0) throw Error(path.string() + ": expected 8 or 16 bit grey levels without sign, or float");
  const std::size_t page_bytes = std::size_t(samples.size[0]) * std::size_t(samples.size[1]) * bytes_each(samples.type);
  if (samples.slope != 1 || samples.intercept != 0) {
    const std::vector<float> values = to_float(samples);
    const std::size_t page_pixels = values.size() / std::size_t(samples.size[2]);
    Image image{cv::Mat(samples.size[1], samples.size[0], CV_32F)};
    std::copy_n(values.begin() + std::ptrdiff_t(std::size_t(frame - 1) * page_pixels), page_pixels,
                image.pixels.ptr<float>());
    return image;
  }
  Image image{cv::Mat(samples.size[1], samples.size[0], type)};
  std::memcpy(image.pixels.data, samples.bytes.data() + std::size_t(frame - 1) * page_bytes, page_bytes);
  check_finite(image, path);
  return image;
}

Image read_dicom_image(const fs::path& path, int frame) {
  const DicomPixels pixels = read_dicom_pixels(path, std::max(1, frame));
  check_frame(frame, pixels.frames, path, " frames; name one with frame (from 1)");
  check_one_channel(pixels.channels, path);
  if (pixels.has_table)
    throw Error(path.string() +
                ": its values go through a table (ModalityLUTSequence), which is not read; export it without one");
  const Samples samples = read_dicom_frame(pixels, std::max(1, frame));
  const bool is_signed = samples.type != Samples::Type::u8 && samples.type != Samples::Type::u16;
  if (!is_signed && pixels.slope == 1 && pixels.intercept == 0) return image_of(samples, 1, path);
  Image image{cv::Mat(pixels.rows, pixels.columns, CV_32F)};
  scaled_values(pixels, samples, image.pixels.ptr<float>());
  check_finite(image, path);
  return image;
}

Image as_its_camera_sees(Image image, const fs::path& path, int frame) {
  const XrayPixels stored = read_xray_pixels(path, std::max(1, frame));
  if (stored.mirrored) {
    cv::Mat mirrored;
    cv::flip(image.pixels, mirrored, 1);
    image.pixels = mirrored;
  }
  if (stored.inverted) {
    double largest = 0;
    cv::minMaxLoc(image.pixels, nullptr, &largest);
    image.pixels = cv::Mat(largest - image.pixels);
  }
  return image;
}

bool is_dicom(const fs::path& path) {
  const std::string extension = in_small_letters(path.extension().string());
  return extension == ".dcm" || extension == ".dicom";
}

}  // namespace

Image turned_over(Image image, const std::string& mirror) {
  if (mirror == "none") return image;
  cv::Mat turned;
  cv::flip(image.pixels, turned, mirror == "left_right" ? 1 : 0);
  return {turned};
}

bool is_mirrored_as_read(const fs::path& path, int frame) {
  return is_dicom(path) && read_xray_pixels(path, std::max(1, frame)).mirrored;
}

Image read_image_file(const fs::path& path, int frame) {
  const std::string extension = in_small_letters(path.extension().string());
  if (is_dicom(path)) return as_its_camera_sees(read_dicom_image(path, frame), path, frame);
  if (extension != ".tif" && extension != ".tiff" && extension != ".png")
    throw Error(path.string() + ": not an image that can be read; known are .png, .tif and .dcm");
  const Samples samples = extension == ".png" ? read_png(path) : read_tiff(path);
  check_frame(frame, samples.size[2], path,
              " pages; an image has one (a stack is a volume; frame, from 1, picks a page)");
  check_one_channel(samples.components, path);
  return image_of(samples, std::max(1, frame), path);
}

std::vector<Image> read_image_frames(const fs::path& path, const FrameRange& range) {
  std::vector<Image> images;
  const std::string extension = in_small_letters(path.extension().string());
  if (extension != ".tif" && extension != ".tiff") {
    const int count = is_dicom(path) ? read_dicom_pixels(path, 1).frames : 1;
    for (const int frame : frames_of(range, count, path.string())) images.push_back(read_image_file(path, frame));
    return images;
  }
  const Samples samples = read_tiff(path);
  check_one_channel(samples.components, path);
  for (const int frame : frames_of(range, samples.size[2], path.string()))
    images.push_back(image_of(samples, frame, path));
  return images;
}

}  // namespace marrow::files
