// SPDX-License-Identifier: Apache-2.0
#include "itk_files.hpp"

#include <gdcmImageChangeTransferSyntax.h>
#include <gdcmImageReader.h>
#include <gdcmImageWriter.h>
#include <itkGDCMImageIO.h>
#include <itkMetaDataObject.h>
#include <itkMetaImageIO.h>
#include <itkNiftiImageIO.h>
#include <itkNrrdImageIO.h>
#include <itkPNGImageIO.h>
#include <itkTIFFImageIO.h>

namespace marrow::test {
namespace {

itk::ImageIOBase::Pointer writer_of(const std::string& extension) {
  if (extension == ".mha" || extension == ".mhd") return itk::MetaImageIO::New().GetPointer();
  if (extension == ".nrrd" || extension == ".nhdr") return itk::NrrdImageIO::New().GetPointer();
  if (extension == ".nii" || extension == ".gz") return itk::NiftiImageIO::New().GetPointer();
  if (extension == ".tif") return itk::TIFFImageIO::New().GetPointer();
  if (extension == ".png") return itk::PNGImageIO::New().GetPointer();
  throw std::runtime_error("no writer for " + extension);
}

void write_all(itk::ImageIOBase& io, const std::filesystem::path& path, const void* samples) {
  itk::ImageIORegion region(io.GetNumberOfDimensions());
  for (unsigned k = 0; k < io.GetNumberOfDimensions(); ++k) region.SetSize(k, io.GetDimensions(k));
  io.SetIORegion(region);
  io.SetFileName(path.string());
  io.WriteImageInformation();
  io.Write(samples);
}

}  // namespace

template <class T>
void write_itk(const std::filesystem::path& path, const ItkGrid<T>& grid, bool compressed) {
  const auto io = writer_of(path.extension().string());
  io->SetNumberOfDimensions(unsigned(grid.size.size()));
  for (unsigned k = 0; k < grid.size.size(); ++k) {
    io->SetDimensions(k, grid.size[k]);
    io->SetSpacing(k, k < 3 ? grid.spacing[k] : 1);
    io->SetOrigin(k, k < 3 ? grid.origin[k] : 0);
    if (k < 3 && grid.size.size() == 3) io->SetDirection(k, grid.axes[k]);
  }
  io->SetComponentType(itk::ImageIOBase::MapPixelType<T>::CType);
  io->SetNumberOfComponents(grid.components);
  io->SetPixelType(grid.components == 1 ? itk::IOPixelEnum::SCALAR
                                        : (grid.components == 3 ? itk::IOPixelEnum::RGB : itk::IOPixelEnum::VECTOR));
  io->SetUseCompression(compressed);
  write_all(*io, path, grid.samples.data());
}

template void write_itk(const std::filesystem::path&, const ItkGrid<std::uint8_t>&, bool);
template void write_itk(const std::filesystem::path&, const ItkGrid<std::int16_t>&, bool);
template void write_itk(const std::filesystem::path&, const ItkGrid<std::uint16_t>&, bool);
template void write_itk(const std::filesystem::path&, const ItkGrid<float>&, bool);
template void write_itk(const std::filesystem::path&, const ItkGrid<double>&, bool);

std::vector<double> itk_meta_spacing(const std::filesystem::path& path) {
  const auto io = itk::MetaImageIO::New();
  io->SetFileName(path.string());
  io->ReadImageInformation();
  std::vector<double> spacing;
  for (unsigned k = 0; k < io->GetNumberOfDimensions(); ++k) spacing.push_back(io->GetSpacing(k));
  return spacing;
}

void write_dicom(const std::filesystem::path& path, const DicomSlice& slice) {
  const auto io = itk::GDCMImageIO::New();
  itk::MetaDataDictionary& tags = io->GetMetaDataDictionary();
  const auto set = [&](const char* tag, const std::string& value) {
    itk::EncapsulateMetaData<std::string>(tags, tag, value);
  };
  const auto text = [](double value) { return std::to_string(value); };
  set("0008|0060", slice.modality);
  set("0020|000e", slice.series);
  set("0020|000d", "1.2.3");
  set("0008|0018", slice.series + "." + std::to_string(std::abs(int(slice.position[2] * 1000)) + 1));
  set("0020|0032", text(slice.position[0]) + "\\" + text(slice.position[1]) + "\\" + text(slice.position[2]));
  set("0020|0037", slice.orientation);
  set("0028|1052", "-1024");
  set("0028|1053", "1");
  io->KeepOriginalUIDOn();
  io->SetNumberOfDimensions(2);
  io->SetDimensions(0, unsigned(slice.width));
  io->SetDimensions(1, unsigned(slice.height));
  io->SetSpacing(0, 0.5);
  io->SetSpacing(1, 0.75);
  io->SetOrigin(0, slice.position[0]);
  io->SetOrigin(1, slice.position[1]);
  io->SetComponentType(itk::IOComponentEnum::SHORT);
  io->SetNumberOfComponents(1);
  io->SetPixelType(itk::IOPixelEnum::SCALAR);
  write_all(*io, path, slice.values.data());
}

void compress_dicom(const std::filesystem::path& from, const std::filesystem::path& to,
                    const std::string& transfer_syntax) {
  gdcm::ImageReader reader;
  reader.SetFileName(from.c_str());
  if (!reader.Read()) throw std::runtime_error("GDCM does not read " + from.string());
  gdcm::ImageChangeTransferSyntax change;
  change.SetTransferSyntax(gdcm::TransferSyntax(gdcm::TransferSyntax::GetTSType(transfer_syntax.c_str())));
  change.SetInput(reader.GetImage());
  if (!change.Change()) throw std::runtime_error("GDCM does not compress to " + transfer_syntax);
  gdcm::ImageWriter writer;
  writer.SetFile(reader.GetFile());
  writer.SetImage(change.GetOutput());
  writer.SetFileName(to.c_str());
  if (!writer.Write()) throw std::runtime_error("GDCM does not write " + to.string());
}

}  // namespace marrow::test
