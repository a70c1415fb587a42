// SPDX-License-Identifier: Apache-2.0
#pragma once
// Grids of samples as files hold them: the common part of the readers of all formats.
#include <array>
#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "marrow/domain/volume.hpp"
#include "marrow/toolbox/files/input_file.hpp"

namespace marrow::files {

/// The content of a file of samples, as it is stored. It has one to three dimensions; missing ones have size 1.
struct Samples {
  std::array<int, 3> size{1, 1, 1};
  std::array<double, 3> spacing_mm{1, 1, 1};
  std::array<double, 3> origin_mm{0, 0, 0};
  std::array<double, 9> direction{1, 0, 0, 0, 1, 0, 0, 0, 1};  ///< row by row; columns are the grid's axes
  int dimensions = 0;
  int components = 1;
  std::string spacing_field;  ///< the header's field for the voxel size, if the file does not give it; else empty
  std::string other_pages;    ///< what the pages of a TIFF are, if they are not the slices of one volume; else empty
  enum class Type { u8, i8, u16, i16, u32, i32, u64, i64, f32, f64 } type = Type::u8;
  double slope = 1, intercept = 0;  ///< value = slope * sample + intercept
  std::vector<std::byte> bytes;     ///< x runs fastest, then y, then z

  std::size_t count() const { return std::size_t(size[0]) * std::size_t(size[1]) * std::size_t(size[2]); }
};

/// Headers give directions with as few as four digits. So the dot product of two axes may differ from 0 by this much;
/// the axes are then made orthogonal. At the ends of 400 mm this moves a voxel by 0.1 mm.
constexpr double kRoundedDirection = 5e-4;

std::size_t bytes_each(Samples::Type type);

/// A volume: its grid, and its samples as float.
struct VolumeSamples {
  Samples geometry;  ///< without bytes; its type is that of the stored samples, or f32 if they are scaled
  std::vector<float> values;
  std::string note{};  ///< for the log: the files of a folder that were passed over; else empty
};

VolumeSamples read_meta_image(const std::filesystem::path& path, bool folder_is_named);
VolumeSamples read_nrrd(const std::filesystem::path& path, bool folder_is_named);

/// A segmentation of 3D Slicer (.seg.nrrd): layers of labels on one grid, and the notes (key:=value) that name them.
/// Any other NRRD of one volume is one layer.
struct NrrdLayers {
  VolumeSamples samples;  ///< without values
  std::vector<std::vector<float>> values;
  std::map<std::string, std::string> notes;
};
NrrdLayers read_nrrd_layers(const std::filesystem::path& path, bool folder_is_named);

/// `is_placed`: the header must say where the volume lies. If false, the file may hold one image, and the grid is not
/// read.
VolumeSamples read_nifti(const std::filesystem::path& path, bool is_placed = true);
/// A CT series in HU: all slices of one series in a folder, sorted by position and checked for gaps. `series_uid`
/// selects the series; empty: the folder must hold only one CT. Other files of the folder are passed over. Throws Error
/// if slices are missing, damaged or do not fit together.
VolumeSamples read_dicom_series(const std::filesystem::path& folder, const std::string& series_uid);
/// The same of the frames of one enhanced CT file.
VolumeSamples read_dicom_frames(const std::filesystem::path& path);
/// Whether a file has DICOM's mark at byte 128 or, as some programs write it, begins with DICOM elements at once.
bool looks_like_dicom(const std::filesystem::path& path);

/// All pages of a TIFF. Colours of a kind that is not read leave `components` above 1 and give no bytes.
Samples read_tiff(const std::filesystem::path& path);
Samples read_png(const std::filesystem::path& path);
Samples read_jpeg(const std::filesystem::path& path);
Samples read_bmp(const std::filesystem::path& path);
/// Makes one component of equal colours and full opacity. Throws Error, beginning with `what`, for others.
void make_grey(const std::string& what, Samples& samples);

/// Throws Error if a size from the header is not possible for a volume or image, or if a file of `stored_bytes` cannot
/// hold so many samples. To be called before memory is reserved for them. No CT or image is compressed to more than 500
/// samples per byte; the limit of zlib is 1032.
void check_size(const std::string& what, const std::array<long long, 3>& size, std::uint64_t stored_bytes,
                double most_samples_per_byte = 500);

/// Where and how a file holds the samples of a volume.
struct StoredSamples {
  std::uint64_t begin = 0;
  bool is_packed = false;  ///< a zlib or gzip stream begins at `begin`
  std::uint64_t skip = 0;  ///< number of decompressed bytes before the samples
  Samples::Type type = Samples::Type::u8;
  bool big_endian = false;
  std::size_t count = 0;
  double slope = 1, intercept = 0;

  Samples::Type type_of_values() const { return slope == 1 && intercept == 0 ? type : Samples::Type::f32; }
};
/// All samples as float, scaled by slope and intercept. Throws Error if samples are missing or data follow them.
std::vector<float> read_floats(const InputFile& file, const StoredSamples& stored);

/// The values of the samples as float: slope * sample + intercept.
std::vector<float> to_float(const Samples& samples);

/// The grid that the header gives. Directions that are rounded are made exact.
Grid grid_of(const Samples& samples);

/// Reverses the samples along an axis (0 to 2) of the grid.
void flip(Volume& volume, int axis);

/// Reverses the last axis of a left-handed grid. Then it is right-handed, and each voxel keeps its value and its
/// position.
void make_right_handed(Volume& volume);

/// What a file holds. Devices name their files as they like (.IMA, IM000001), so the content decides, not the name.
enum class FileFormat { unknown, png, tiff, jpeg, bmp, dicom, meta_image, nrrd, nifti };

/// The format by the file's first bytes or, if they belong to no known format, as in a damaged file, by its extension.
/// Throws Error as InputFile does; the file may be empty.
FileFormat file_format(const std::filesystem::path& path);

/// "a GIF picture": the name of a format that is not read, if the file's first bytes tell it; else empty.
std::string name_of_other_format(const std::filesystem::path& path);

}  // namespace marrow::files
