// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstring>

#include "dicom_pixels.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/toolbox/files/sequence_files.hpp"
#include "marrow/toolbox/files/volume_file.hpp"
#include "marrow/toolbox/files/xray_header.hpp"

namespace marrow::files {
namespace {

namespace fs = std::filesystem;

void check_one_channel(int channels, const fs::path& path) {
  if (channels != 1)
    throw Error(
        formatted("{}: has {} channels; an X-ray image has one: save it as grey levels", path.string(), channels));
}

void check_frame(int frame, long long frames, const fs::path& path, const std::string& several) {
  if (frames != 1 && frame == 0) throw Error(formatted("{}: has {}{}", path.string(), frames, several));
  if (frame > frames) throw Error(formatted("{}: has {} frames; there is no frame {}", path.string(), frames, frame));
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
  const std::size_t page_bytes = std::size_t(samples.size[0]) * std::size_t(samples.size[1]) * bytes_each(samples.type);
  if (type < 0 || samples.slope != 1 || samples.intercept != 0) {
    const std::vector<float> values = to_float(samples);
    const std::size_t page_pixels = values.size() / std::size_t(samples.size[2]);
    Image image{cv::Mat(samples.size[1], samples.size[0], CV_32F)};
    std::copy_n(values.begin() + std::ptrdiff_t(std::size_t(frame - 1) * page_pixels), page_pixels,
                image.pixels.ptr<float>());
    check_finite(image, path);
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
  if (!pixels.is_plain_rgb) check_one_channel(pixels.channels, path);
  Samples samples = read_dicom_frame(pixels, std::max(1, frame));
  make_grey(path.string(), samples);
  const bool is_signed = samples.type != Samples::Type::u8 && samples.type != Samples::Type::u16;
  if (!is_signed && !pixels.table && pixels.slope == 1 && pixels.intercept == 0) return image_of(samples, 1, path);
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
  if (stored.inverted_from) image.pixels = cv::Mat(*stored.inverted_from - image.pixels);
  return image;
}

bool is_dicom(const fs::path& path) { return file_format(path) == FileFormat::dicom; }

template <class T>
void put_values(const std::vector<float>& values, std::byte* to) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    const T value = T(values[i]);
    std::memcpy(to + i * sizeof(T), &value, sizeof(T));
  }
}

/// The pages of a format for volumes. Whole numbers of 8 and 16 bits without sign stay so; all others become float.
Samples pages_of(const VolumeSamples& volume) {
  Samples pages = volume.geometry;
  if (pages.type != Samples::Type::u8 && pages.type != Samples::Type::u16) pages.type = Samples::Type::f32;
  pages.bytes.resize(pages.count() * bytes_each(pages.type));
  if (pages.type == Samples::Type::u8) put_values<std::uint8_t>(volume.values, pages.bytes.data());
  if (pages.type == Samples::Type::u16) put_values<std::uint16_t>(volume.values, pages.bytes.data());
  if (pages.type == Samples::Type::f32) put_values<float>(volume.values, pages.bytes.data());
  return pages;
}

[[noreturn]] void refuse_format(const fs::path& path) {
  const std::string other = name_of_other_format(path);
  if (!other.empty()) throw Error(path.string() + ": is " + other + ", not an image that can be read; save it as PNG");
  throw Error(path.string() +
              ": not an image that can be read; known are PNG, TIFF, JPEG, BMP, DICOM, MetaImage, NRRD and NIfTI");
}

Samples read_stored_pages(const fs::path& path) {
  switch (file_format(path)) {
    case FileFormat::png:
      return read_png(path);
    case FileFormat::tiff:
      return read_tiff(path);
    case FileFormat::jpeg:
      return read_jpeg(path);
    case FileFormat::bmp:
      return read_bmp(path);
    case FileFormat::meta_image:
      return pages_of(read_meta_image(path, false));
    case FileFormat::nrrd:
      return pages_of(read_nrrd(path, false));
    case FileFormat::nifti:
      return pages_of(read_nifti(path, false));
    case FileFormat::dicom:
    case FileFormat::unknown:
      break;
  }
  refuse_format(path);
}

/// All pages of a file that is not DICOM, as grey levels.
Samples read_pages(const fs::path& path) {
  Samples pages = read_stored_pages(path);
  make_grey(path.string(), pages);
  return pages;
}

constexpr DicomTag kHorizontalFlip{0x0018, 0x7034, "FieldOfViewHorizontalFlip"};

bool has_dicom_header(const std::filesystem::path& path) { return file_format(path) == FileFormat::dicom; }

/// The patient's side that a direction points to most.
std::string side_of(const Eigen::Vector3d& direction) {
  static const char* kSides[3][2] = {{"left", "right"}, {"back", "front"}, {"head", "feet"}};
  Eigen::Index axis = 0;
  direction.cwiseAbs().maxCoeff(&axis);
  return kSides[axis][direction[axis] < 0];
}

constexpr DicomTag kLossy{0x0028, 0x2110, "LossyImageCompression"};

/// Headers of copies forget that their pixels were compressed, so the way they are written now counts too.
bool is_lossy_dicom(const std::filesystem::path& path) {
  constexpr const char* kLossySyntaxes[] = {"1.2.840.10008.1.2.4.50", "1.2.840.10008.1.2.4.51",
                                            "1.2.840.10008.1.2.4.81", "1.2.840.10008.1.2.4.91"};
  const DicomFile file(path);
  return std::find(std::begin(kLossySyntaxes), std::end(kLossySyntaxes), file.transfer_syntax()) !=
             std::end(kLossySyntaxes) ||
         DicomHeader(file, 1).text(kLossy).value_or("") == "01";
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
  if (is_dicom(path)) return as_its_camera_sees(read_dicom_image(path, frame), path, frame);
  const Samples pages = read_pages(path);
  check_frame(frame, pages.size[2], path,
              " pages; an image has one (a stack is a volume; frame, from 1, picks a page)");
  return image_of(pages, std::max(1, frame), path);
}

std::vector<Image> read_image_frames(const fs::path& path, const FrameRange& range) {
  std::vector<Image> images;
  if (is_dicom(path)) {
    const int count = read_dicom_pixels(path, 1).frames;
    for (const int frame : frames_of(range, count, path.string())) images.push_back(read_image_file(path, frame));
    return images;
  }
  const Samples pages = read_pages(path);
  for (const int frame : frames_of(range, pages.size[2], path.string())) images.push_back(image_of(pages, frame, path));
  return images;
}

std::vector<std::string> doubts_about_sides(const std::filesystem::path& image, int frame) {
  if (!has_dicom_header(image)) return {};
  const DicomFile file(image);
  const DicomHeader header(file, std::max(1, frame));
  const auto oriented = patient_orientation(header);
  const std::string advice =
      "compare it with the anatomy, or mark landmarks in two views, and mirror the image if it is";
  if (!oriented) {
    if (header.text(kHorizontalFlip).value_or("") != "YES") return {};
    return {image.string() + ": was flipped left to right after it was taken (" + kHorizontalFlip.text() + "), and " +
            kPatientOrientation.text() + " does not say how the patient lies in it; it may be mirrored: " + advice};
  }
  if (header.number(kPrimaryAngle) && header.number(kSecondaryAngle)) return {};  // mirrored back if it was mirrored
  return {image.string() + ": the patient's " + side_of(oriented->right) + " is on its right and the " +
          side_of(oriented->down) + " below (" + kPatientOrientation.text() +
          "), but the header does not say from where it was taken; whether it is mirrored is not known: " + advice};
}

std::vector<std::string> doubts_about_sides(const std::filesystem::path& image, int frame, const Camera& camera) {
  if (!has_dicom_header(image)) return {};
  const DicomFile file(image);
  const auto oriented = patient_orientation(DicomHeader(file, std::max(1, frame)));
  if (!oriented) return doubts_about_sides(image, frame);
  constexpr double kClear = 0.5;  // the patient's axes and the camera's differ by less than 60 degrees
  const bool is_turned = is_mirrored_as_read(image, frame);
  const Eigen::Vector3d right = is_turned ? Eigen::Vector3d(-oriented->right) : oriented->right;
  const Eigen::Vector3d away = camera.camera_from_world.rotation.row(2).transpose();  // from the source
  if (!(right.cross(oriented->down).dot(away) < -kClear)) return {};
  return {image.string() + ": is mirrored: by its header (" + kPatientOrientation.text() + ") the patient's " +
          side_of(right) + " is on the right and the " + side_of(oriented->down) +
          " below, as nobody sees it from the source of this camera; mirror the image, or correct the angles"};
}

bool is_lossy_image(const std::filesystem::path& image) {
  const FileFormat format = file_format(image);
  return format == FileFormat::jpeg || (format == FileFormat::dicom && is_lossy_dicom(image));
}

void warn_of_pixels(const std::filesystem::path& image, const Context& context) {
  if (is_lossy_image(image))
    context.warn(image.string() +
                 ": was compressed with loss (JPEG or the like): grey levels are changed a little, most where edges "
                 "are, and may have lost bits; use the device's own file where there is one");
  if (file_format(image) == FileFormat::nifti)
    context.warn(image.string() +
                 ": NIfTI does not say which row of an image is the upper one; the first that is stored is taken as "
                 "the upper one, as ITK writes it: compare it with the anatomy, or save it as PNG");
}

}  // namespace marrow::files
