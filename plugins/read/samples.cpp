// SPDX-License-Identifier: Apache-2.0
#include "samples.hpp"

#include <itkGDCMImageIO.h>
#include <itkMetaImageIO.h>
#include <itkMultiThreaderBase.h>
#include <itkNiftiImageIO.h>
#include <itkNrrdImageIO.h>
#include <itkTIFFImageIO.h>

#include <cstring>

#include "itk_samples.hpp"
#include "marrow/domain/error.hpp"

namespace marrow::read {
namespace {

/// No compression in use packs zeros more tightly than LZW's 1 : 1400, so a header that claims more is damaged.
constexpr double kBestCompression = 1400;
constexpr double kSmallFile = 65536;

Samples::Type sample_type(itk::IOComponentEnum type, const std::string& what) {
  using Type = Samples::Type;
  switch (type) {
    case itk::IOComponentEnum::UCHAR:
      return Type::u8;
    case itk::IOComponentEnum::CHAR:
      return Type::i8;
    case itk::IOComponentEnum::USHORT:
      return Type::u16;
    case itk::IOComponentEnum::SHORT:
      return Type::i16;
    case itk::IOComponentEnum::UINT:
      return Type::u32;
    case itk::IOComponentEnum::INT:
      return Type::i32;
    case itk::IOComponentEnum::ULONG:
    case itk::IOComponentEnum::ULONGLONG:
      return Type::u64;
    case itk::IOComponentEnum::LONG:
    case itk::IOComponentEnum::LONGLONG:
      return Type::i64;
    case itk::IOComponentEnum::FLOAT:
      return Type::f32;
    case itk::IOComponentEnum::DOUBLE:
      return Type::f64;
    default:
      throw Error(what + ": its samples are of a type that is not read; save it as 16 bit integers or float");
  }
}

Samples describe(const itk::ImageIOBase& io, const std::string& what) {
  Samples samples;
  samples.dimensions = int(io.GetNumberOfDimensions());
  samples.components = int(io.GetNumberOfComponents());
  samples.type = sample_type(io.GetComponentType(), what);
  for (unsigned k = 0; k < io.GetNumberOfDimensions(); ++k) {
    const auto size = io.GetDimensions(k);
    if (k >= 3) {
      if (size != 1)
        throw Error(what + ": has " + std::to_string(samples.dimensions) + " dimensions; expected one volume");
      continue;
    }
    if (size < 1 || size > 100000)
      throw Error(what + ": its header gives a size of " + std::to_string(size) + "; it is damaged");
    samples.size[k] = int(size);
    samples.spacing_mm[k] = io.GetSpacing(k);
    samples.origin_mm[k] = io.GetOrigin(k);
    const std::vector<double> axis = io.GetDirection(k);
    for (unsigned row = 0; row < 3 && row < axis.size(); ++row) samples.direction[row * 3 + k] = axis[row];
  }
  return samples;
}

/// The size of a file, or of all files of the folder that a detached header lies in.
double stored_bytes(const std::filesystem::path& path) {
  if (path.extension() != ".mhd" && path.extension() != ".nhdr") return double(std::filesystem::file_size(path));
  double bytes = 0;
  for (const auto& entry : std::filesystem::directory_iterator(path.parent_path()))
    if (entry.is_regular_file()) bytes += double(entry.file_size());
  return bytes;
}

itk::ImageIOBase::Pointer reader_of(Format format) {
  switch (format) {
    case Format::meta:
      return itk::MetaImageIO::New().GetPointer();
    case Format::nrrd:
      return itk::NrrdImageIO::New().GetPointer();
    case Format::nifti:
      return itk::NiftiImageIO::New().GetPointer();
    case Format::tiff:
      return itk::TIFFImageIO::New().GetPointer();
    case Format::dicom:
      return itk::GDCMImageIO::New().GetPointer();
  }
  return {};
}

const char* name_of(Format format) {
  static constexpr const char* kNames[] = {"MetaImage", "NRRD", "NIfTI", "TIFF", "DICOM"};
  return kNames[int(format)];
}

template <class T>
void convert(const Samples& samples, std::vector<float>& values) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    T sample;
    std::memcpy(&sample, samples.bytes.data() + i * sizeof(T), sizeof(T));
    values[i] = float(sample);
  }
}

}  // namespace

std::string reason(const itk::ExceptionObject& error) {
  std::string text = error.GetDescription();
  if (const std::size_t at = text.find("): "); text.rfind("ITK ERROR", 0) == 0 && at != std::string::npos)
    text = text.substr(at + 3);
  if (const std::size_t at = text.find("): "); text.rfind("itk::ERROR", 0) == 0 && at != std::string::npos)
    text = text.substr(at + 3);
  for (char& c : text)
    if (c == '\n' || c == '\r') c = ' ';
  while (!text.empty() && text.back() == ' ') text.pop_back();
  return text.empty() ? "no reason given" : text;
}

Samples read_through(itk::ImageIOBase& io, const std::filesystem::path& path, const std::string& format_name) {
  const std::string what = path.string();
  try {
    if (!io.CanReadFile(what.c_str()))
      throw Error(what + ": is not a " + format_name + " file, or is damaged at its start");
    io.SetFileName(what);
    io.ReadImageInformation();
    Samples samples = describe(io, what);
    const double claimed = double(samples.count()) * samples.components * io.GetComponentSize();
    check_claim(what, samples, claimed, stored_bytes(path));
    if (dynamic_cast<itk::MetaImageIO*>(&io)) check_meta_data(path, claimed);
    if (dynamic_cast<itk::NrrdImageIO*>(&io)) check_nrrd_data(path, claimed, double(samples.count()) * samples.components);
    itk::ImageIORegion region(io.GetNumberOfDimensions());
    for (unsigned k = 0; k < io.GetNumberOfDimensions(); ++k) region.SetSize(k, io.GetDimensions(k));
    io.SetIORegion(region);
    samples.bytes.resize(std::size_t(claimed));
    io.Read(samples.bytes.data());
    return samples;
  } catch (const itk::ExceptionObject& error) {
    throw Error(what + ": cannot be read as " + format_name + ", it may be cut off or damaged (" + reason(error) +
                "); copy or export it again");
  }
}

void check_file(const std::filesystem::path& path) {
  std::error_code failure;
  if (!std::filesystem::exists(path, failure)) throw Error(path.string() + ": there is no such file");
  if (!std::filesystem::is_regular_file(path, failure)) throw Error(path.string() + ": expected a file, this is none");
  if (std::filesystem::file_size(path, failure) == 0) throw Error(path.string() + ": the file is empty");
}

void check_claim(const std::string& what, const Samples& samples, double claimed_bytes, double stored_bytes) {
  if (claimed_bytes > kBestCompression * stored_bytes + kSmallFile)
    throw Error(what + ": its header claims " + std::to_string(samples.size[0]) + " x " +
                std::to_string(samples.size[1]) + " x " + std::to_string(samples.size[2]) +
                " samples, but the file has only " + std::to_string(std::size_t(stored_bytes)) +
                " bytes; it is damaged or cut off");
}

Samples read_samples(const std::filesystem::path& path, Format format) {
  check_file(path);
  if (format == Format::meta) check_meta_header(path);
  if (format == Format::nifti) check_nifti_data(path);
  if (format == Format::tiff) check_tiff_pages(path);
  if (format == Format::dicom) check_dicom_file(path);
  itk::MultiThreaderBase::SetGlobalDefaultNumberOfThreads(1);
  const itk::ImageIOBase::Pointer io = reader_of(format);
  return read_through(*io, path, name_of(format));
}

std::vector<float> to_float(const Samples& samples) {
  std::vector<float> values(samples.count());
  switch (samples.type) {
    case Samples::Type::u8:
      convert<std::uint8_t>(samples, values);
      break;
    case Samples::Type::i8:
      convert<std::int8_t>(samples, values);
      break;
    case Samples::Type::u16:
      convert<std::uint16_t>(samples, values);
      break;
    case Samples::Type::i16:
      convert<std::int16_t>(samples, values);
      break;
    case Samples::Type::u32:
      convert<std::uint32_t>(samples, values);
      break;
    case Samples::Type::i32:
      convert<std::int32_t>(samples, values);
      break;
    case Samples::Type::u64:
      convert<std::uint64_t>(samples, values);
      break;
    case Samples::Type::i64:
      convert<std::int64_t>(samples, values);
      break;
    case Samples::Type::f32:
      convert<float>(samples, values);
      break;
    case Samples::Type::f64:
      convert<double>(samples, values);
      break;
  }
  return values;
}

}  // namespace marrow::read
