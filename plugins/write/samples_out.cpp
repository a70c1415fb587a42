// SPDX-License-Identifier: Apache-2.0
#include "samples_out.hpp"

#include <itkMetaImageIO.h>
#include <itkMultiThreaderBase.h>
#include <itkTIFFImageIO.h>

#include <fstream>

#include "marrow/domain/error.hpp"

namespace marrow::write {
namespace {

[[noreturn]] void fail(const std::filesystem::path& path) {
  throw Error(path.string() + ": cannot be written; is the disk full or the folder read-only?");
}

/// ITK does not say when a disk is full, so the file's end is looked at. MHA: all compressed bytes are there.
bool mha_is_whole(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  std::string line;
  std::uintmax_t stored = 0;
  while (std::getline(stream, line) && line.size() < 4096) {
    if (line.rfind("CompressedDataSize = ", 0) == 0) stored = std::stoull(line.substr(21));
    if (line.rfind("ElementDataFile = LOCAL", 0) == 0)
      return stored > 0 && std::filesystem::file_size(path) == std::uintmax_t(stream.tellg()) + stored;
  }
  return false;
}

template <class Io>
void write(Io& io, const std::filesystem::path& path, const void* samples) {
  itk::MultiThreaderBase::SetGlobalDefaultNumberOfThreads(1);
  itk::ImageIORegion region(io.GetNumberOfDimensions());
  for (unsigned k = 0; k < io.GetNumberOfDimensions(); ++k) region.SetSize(k, io.GetDimensions(k));
  io.SetIORegion(region);
  io.SetFileName(path.string());
  try {
    io.WriteImageInformation();
    io.Write(samples);
  } catch (const itk::ExceptionObject&) {
    fail(path);
  }
}

}  // namespace

void write_mha(const std::filesystem::path& path, const GridOut& grid, const float* values) {
  const auto io = itk::MetaImageIO::New();
  io->SetNumberOfDimensions(3);
  io->SetComponentType(itk::IOComponentEnum::FLOAT);
  io->SetNumberOfComponents(1);
  io->SetPixelType(itk::IOPixelEnum::SCALAR);
  for (unsigned k = 0; k < 3; ++k) {
    io->SetDimensions(k, unsigned(grid.size[k]));
    io->SetSpacing(k, grid.spacing_mm[k]);
    io->SetOrigin(k, grid.origin_mm[k]);
    io->SetDirection(k, std::vector<double>(grid.axes[k].begin(), grid.axes[k].end()));
  }
  io->SetUseCompression(true);
  write(*io, path, values);
  if (!mha_is_whole(path)) fail(path);
}

void write_float_tiff(const std::filesystem::path& path, int width, int height, const float* pixels) {
  const auto io = itk::TIFFImageIO::New();
  io->SetNumberOfDimensions(2);
  io->SetDimensions(0, unsigned(width));
  io->SetDimensions(1, unsigned(height));
  io->SetComponentType(itk::IOComponentEnum::FLOAT);
  io->SetNumberOfComponents(1);
  io->SetPixelType(itk::IOPixelEnum::SCALAR);
  io->SetUseCompression(false);
  write(*io, path, pixels);
  std::error_code failure;
  const std::uintmax_t least = std::uintmax_t(width) * std::uintmax_t(height) * sizeof(float);
  if (std::filesystem::file_size(path, failure) < least || failure) fail(path);
}

}  // namespace marrow::write
