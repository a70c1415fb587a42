// SPDX-License-Identifier: Apache-2.0
#include "file_format.hpp"

#include <algorithm>
#include <map>
#include <string_view>

#include "byte_stream.hpp"
#include "header_lines.hpp"
#include "marrow/base/error.hpp"
#include "samples.hpp"

namespace marrow::files {
namespace {

using namespace std::string_view_literals;

constexpr std::size_t kHeadBytes = 4096;

std::string head_of(const InputFile& file) {
  return file.text(0, std::size_t(std::min<std::uint64_t>(file.size(), kHeadBytes)));
}

bool has_at(std::string_view head, std::size_t at, std::string_view mark) {
  return at <= head.size() && head.substr(at, mark.size()) == mark;
}

/// Many texts begin with the same two letters, so the length of the header must be a valid one.
bool is_bmp(std::string_view head) {
  return has_at(head, 0, "BM") && head.size() > 18 && "\x0C\x28\x34\x38\x40\x6C\x7C"sv.find(head[14]) != head.npos &&
         has_at(head, 15, "\0\0\0"sv);
}

bool is_nifti(std::string_view head) {
  if (has_at(head, 0, "\x5C\x01\0\0"sv) || has_at(head, 0, "\0\0\x01\x5C"sv))
    return has_at(head, 344, "n+1\0"sv) || has_at(head, 344, "ni1\0"sv);
  if (has_at(head, 0, "\x1C\x02\0\0"sv) || has_at(head, 0, "\0\0\x02\x1C"sv))
    return has_at(head, 4, "n+2\0"sv) || has_at(head, 4, "ni2\0"sv);
  return false;
}

/// A MetaImage has no mark: it is a text of fields, one of which is NDims.
bool is_meta_image(const std::string& head) {
  const std::string text = in_small_letters(head);
  const std::size_t at = text.find("ndims");
  if (at == text.npos || (at > 0 && text.find_last_of("\r\n", at) != at - 1)) return false;
  const std::size_t sign = text.find_first_not_of(" \t", at + 5);
  return sign != text.npos && (text[sign] == '=' || text[sign] == ':');
}

/// The first bytes of a compressed file's content; empty if they cannot be unpacked.
std::string unpacked_head(const InputFile& file) {
  std::string head(kHeadBytes, '\0');
  try {
    head.resize(bytes_of_gzip_or_plain(file)->take(head.data(), head.size()));
  } catch (const Error&) {  // its reader says what is wrong
    return {};
  }
  return head;
}

FileFormat format_by_content(const InputFile& file) {
  if (looks_like_dicom(file.path())) return FileFormat::dicom;  // its first 128 bytes may be those of a TIFF
  const std::string head = head_of(file);
  if (has_at(head, 0, "\x89PNG")) return FileFormat::png;
  for (const std::string_view mark : {"II*\0"sv, "MM\0*"sv, "II+\0"sv, "MM\0+"sv})
    if (has_at(head, 0, mark)) return FileFormat::tiff;
  if (has_at(head, 0, "\xFF\xD8\xFF")) return FileFormat::jpeg;
  if (has_at(head, 0, "NRRD")) return FileFormat::nrrd;
  if (is_nifti(has_at(head, 0, "\x1F\x8B") ? unpacked_head(file) : head)) return FileFormat::nifti;
  if (is_bmp(head)) return FileFormat::bmp;
  return is_meta_image(head) ? FileFormat::meta_image : FileFormat::unknown;
}

FileFormat format_by_name(const std::filesystem::path& path) {
  static const std::map<std::string, FileFormat> kKnown{
      {".png", FileFormat::png},        {".tif", FileFormat::tiff},       {".tiff", FileFormat::tiff},
      {".jpg", FileFormat::jpeg},       {".jpeg", FileFormat::jpeg},      {".bmp", FileFormat::bmp},
      {".dcm", FileFormat::dicom},      {".dicom", FileFormat::dicom},    {".ima", FileFormat::dicom},
      {".mha", FileFormat::meta_image}, {".mhd", FileFormat::meta_image}, {".nrrd", FileFormat::nrrd},
      {".nhdr", FileFormat::nrrd},      {".nii", FileFormat::nifti}};
  std::string end = extension_of(path);
  if (end == ".gz") end = extension_of(path.stem()) == ".nii" ? ".nii" : "";
  const auto known = kKnown.find(end);
  return known == kKnown.end() ? FileFormat::unknown : known->second;
}

}  // namespace

FileFormat file_format(const std::filesystem::path& path) {
  const FileFormat told = format_by_content(InputFile(path, true));
  return told == FileFormat::unknown ? format_by_name(path) : told;
}

std::string name_of_other_format(const std::filesystem::path& path) {
  struct Known {
    std::size_t at;
    std::string_view mark;
    const char* name;
  };
  static constexpr Known kOthers[] = {
      {0, "P5\n", "a PNM picture"},           {0, "P6\n", "a PNM picture"},
      {0, "GIF8", "a GIF picture"},           {8, "WEBP", "a WebP picture"},
      {4, "jP  \r\n", "a JPEG 2000 picture"}, {0, "\xFF\x4F\xFF\x51", "a JPEG 2000 picture"},
      {4, "ftyphei", "a HEIC picture"},       {4, "ftypmif1", "a HEIC picture"},
      {4, "ftypavif", "an AVIF picture"},     {0, "%PDF", "a PDF document"},
      {0, "PK\x03\x04", "a ZIP archive"},     {0, "\x1F\x8B", "a file compressed by gzip, but no .nii.gz"},
      {0, "CDF\x01", "a MINC volume"},        {0, "\x89HDF", "an HDF5 file"}};
  const std::string head = head_of(InputFile(path, true));
  for (const Known& other : kOthers)
    if (has_at(head, other.at, other.mark)) return other.name;
  return {};
}

}  // namespace marrow::files
