// SPDX-License-Identifier: Apache-2.0
// Volumes of every format: their grid, samples and directions as the header says, and what is no CT.
// Folders that hold a volume: a header with its samples in another file, or slices; and nothing from elsewhere.
#include <sys/stat.h>

#include "marrow/toolbox/files/volume_file.hpp"
#include "tests/plugins/read/damage.hpp"
#include "tests/plugins/read/itk_files.hpp"
#include "tests/plugins/read/reading.hpp"

namespace volume_test {

using namespace marrow;
using namespace marrow::test;
using Eigen::Vector3d, Eigen::Matrix3d;

Volume read(const std::filesystem::path& path, const shipped::Options& options = {}) {
  return read_by<Volume>("read.volume", path, options);
}

shipped::Options options(const std::vector<double>& voxel_size_mm, const std::vector<std::string>& flip = {},
                         double value_offset_hu = 0) {
  return {{"voxel_size_mm", voxel_size_mm}, {"flip", flip}, {"value_offset_hu", value_offset_hu}};
}

/// A grid turned about a skew axis, so that a transposed or mirrored direction would be seen.
ItkGrid<std::int16_t> turned_grid() {
  ItkGrid<std::int16_t> grid = ramp<std::int16_t>({5, 4, 3}, 37, -1000);
  grid.spacing = {0.5, 0.75, 1.25};
  grid.origin = {-10, 20, 30.5};
  const Matrix3d turn = rotation_from_vector({0.3, -0.2, 0.5});
  for (int k = 0; k < 3; ++k) grid.axes[k] = {turn(0, k), turn(1, k), turn(2, k)};
  return grid;
}

ItkGrid<std::int16_t> stack() { return ramp<std::int16_t>({8, 6, 5}, 13, -1000); }

class ReadVolume : public InAFolder {
 protected:
  /// A volume of these bytes, which the name's ending tells.
  Volume of(const std::string& name, const std::string& bytes) {
    put(folder / name, bytes);
    return read(folder / name);
  }
  template <class T>
  Volume of(const std::string& name, const ItkGrid<T>& grid, const shipped::Options& how = {}) {
    write_itk(folder / name, grid);
    return read(folder / name, how);
  }
  /// By the reader itself: to load the node takes memory.
  void expect_refused(const std::string& name, const std::string& said) {
    files::VolumeReading reading;
    reading.voxel_size_mm = {1, 1, 1};
    EXPECT_REFUSED(files::read_volume_file(folder / name, reading), name, said);
  }
  void expect_refused(const std::string& name, const std::string& bytes, const std::string& said) {
    put(folder / name, bytes);
    expect_refused(name, said);
  }
};

TEST_F(ReadVolume, FormatsAreReadWithTheirGridAsItkWroteThem) {
  for (const auto& [extension, compressed] : {std::pair{".mha", false},
                                              {".mha", true},
                                              {".nrrd", false},
                                              {".nrrd", true},
                                              {".nii", false},
                                              {".nii.gz", true}}) {
    SCOPED_TRACE(extension);
    const Volume volume = of(std::string("ct") + extension, itk_bytes(extension, turned_grid(), compressed));
    EXPECT_EQ(volume.grid.size, (std::array<int, 3>{5, 4, 3}));
    EXPECT_EQ(volume.grid.frame, "ct");
    const double tolerance = 1e-5;  // NIfTI keeps its matrix in float
    EXPECT_LT((volume.grid.spacing_mm - Vector3d(0.5, 0.75, 1.25)).norm(), tolerance);
    EXPECT_LT((volume.grid.origin_mm - Vector3d(-10, 20, 30.5)).norm(), tolerance);
    EXPECT_LT((volume.grid.direction - rotation_from_vector({0.3, -0.2, 0.5})).norm(), tolerance);
    for (int i = 0; i < 60; ++i) EXPECT_EQ(volume.values[i], float(i * 37 - 1000));
  }
}

/// How many samples of 10 x 10 x 10 have a value; the others are zeros.
using Parts = std::vector<std::pair<int, std::int16_t>>;

TEST_F(ReadVolume, AForgottenOffsetIsSaidInWords) {
  const std::string doubt =
      "/ct.mha: the CT seems to hold HU + 1024, not Hounsfield units: no value is below 0, and soft tissue and bone "
      "lie "
      "about 1024 too high. If so, give value_offset_hu: -1024 (-1000 if 1000 was added); without it, thresholds and "
      "simulated X-ray images are wrong";
  for (const auto& [what, parts, is_doubtful] :
       {std::tuple{"a bone alone, + 1024", Parts{{100, 950}, {100, 1300}, {100, 2500}}, true},
        {"a patient, + 1024", Parts{{300, 20}, {20, 500}, {300, 1060}, {50, 900}, {50, 2300}}, true},
        {"a patient", Parts{{400, -1000}, {400, 40}, {100, 1300}}, false},
        {"a bone alone", Parts{{40, 100}, {60, 300}, {100, 700}, {100, 1500}}, false},
        {"a bone cut out of a patient, cut off at 0", Parts{{500, 40}, {60, 400}, {60, 1000}, {60, 1500}}, false},
        {"labels", Parts{{300, 1}, {200, 117}}, false}}) {
    ItkGrid<std::int16_t> grid{.size = {10, 10, 10}};
    for (const auto& [count, value] : parts) grid.samples.insert(grid.samples.end(), std::size_t(count), value);
    grid.samples.resize(1000);
    write_itk(folder / "ct.mha", grid);
    const auto warned = [&](double offset) {
      std::string said;
      for (const std::string& line : said_by(
               [&](const Context& context) {
                 read_by<Volume>("read.volume", folder / "ct.mha", {{"value_offset_hu", offset}}, context);
               },
               LogLevel::warning))
        said += without_folder(line, folder.path());
      return said;
    };
    EXPECT_EQ(warned(0), is_doubtful ? doubt : "") << what;
    EXPECT_EQ(warned(-1024), "") << what;
  }
}

TEST_F(ReadVolume, FlipVoxelSizeAndOffset) {
  const Volume plain = of("a.mha", turned_grid());
  const Volume changed = read(folder / "a.mha", options({1, 2, 3}, {"x", "z"}, -24));
  EXPECT_EQ(changed.grid.spacing_mm, Vector3d(1, 2, 3));
  for (int z = 0; z < 3; ++z)
    for (int y = 0; y < 4; ++y)
      for (int x = 0; x < 5; ++x) EXPECT_EQ(changed.at(x, y, z), plain.at(4 - x, y, 2 - z) - 24);
  EXPECT_SAYS(read(folder / "a.mha", options({}, {"w"})), "flip: expected axes x, y or z, got 'w'");
  EXPECT_SAYS(read(folder / "a.mha", options({1, 2})), "voxel_size_mm: expected 3 lengths, got 2");
  EXPECT_SAYS(read(folder / "a.mha", options({1, 0, 1})), "expected positive lengths");
}

TEST_F(ReadVolume, ATiffNeedsTheSizeOfItsVoxels) {
  const std::string refusal = "a TIFF does not say how large its voxels are; give voxel_size_mm";
  const Volume volume = of("ct.tif", ramp<std::uint16_t>({5, 4, 3}, 60), options({0.4, 0.5, 0.6}, {}, -1024));
  EXPECT_EQ(volume.grid.size, (std::array<int, 3>{5, 4, 3}));
  EXPECT_EQ(volume.grid.spacing_mm, Vector3d(0.4, 0.5, 0.6));
  EXPECT_EQ(volume.at(4, 3, 2), 59 * 60 - 1024);
  EXPECT_SAYS(read(folder / "ct.tif"), refusal);
  MARROW_NEED_DATA(path, "wrist/volumes/rad_dcm_cropped.tif");
  const Volume real = read(path, options({0.39625, 0.39625, 0.625}, {}, -1024));
  EXPECT_EQ(real.grid.size, (std::array<int, 3>{68, 86, 128}));
  EXPECT_EQ(real.grid.spacing_mm, Vector3d(0.39625, 0.39625, 0.625));
  const auto [least, greatest] = std::minmax_element(real.values.begin(), real.values.end());
  EXPECT_EQ(*least, -1024);
  EXPECT_LE(*greatest, 4095 - 1024);
  EXPECT_GT(*greatest, 1000);
  EXPECT_SAYS(read(path), refusal);
}

TEST_F(ReadVolume, ANiftiMayHoldOneSlice) {
  auto slice = turned_grid();
  slice.size = {5, 4, 1};
  slice.samples.resize(20);
  const Volume volume = of("slice.nii.gz", itk_bytes(".nii.gz", slice, true));
  EXPECT_EQ(volume.grid.size, (std::array<int, 3>{5, 4, 1}));
  EXPECT_EQ(volume.at(4, 3, 0), 19 * 37 - 1000);
  MARROW_NEED_DATA(path, "pelvis_dicom/slice_1000_segmentation.nii.gz");  // labels of the Visible Human
  EXPECT_EQ(read(path).grid.size, (std::array<int, 3>{512, 512, 1}));
}

TEST_F(ReadVolume, WhatIsNoCtIsRefused) {
  ItkGrid<float> nan = ramp<float>({2, 2, 2}, 1);
  nan.samples[3] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_SAYS(of("nan.mha", nan), "voxel (1, 1, 0) is not a finite number");
  ItkGrid<std::uint8_t> colours = filled<std::uint8_t>({2, 2, 2, 3}, 0);
  colours.size.pop_back();
  colours.components = 3;
  EXPECT_SAYS(of("colours.mha", colours), "has 3 values per voxel; a CT has one");
  EXPECT_SAYS(of("flat.mha", ramp<float>({2, 2}, 1)), "is one image, not a volume");
  EXPECT_SAYS(of("series.mha", filled<float>({2, 2, 2, 3}, 0)), "has 4 dimensions; expected one volume");
  EXPECT_SAYS(read(folder / "absent.mha"), "there is no such file or folder");
  EXPECT_SAYS(of("a.xyz", "x"), "not a volume that can be read; known are .mha");
  EXPECT_SAYS(of("huge.mha", with(itk_bytes(".mha", turned_grid()), "DimSize = 5 4 3", "DimSize = 9000 9000 9000")),
              "its header claims 9000 x 9000 x 9000 samples, but the file has only");
}

TEST_F(ReadVolume, PackedSamplesAreVerifiedToTheirEndAndOthersRefused) {
  for (const char* extension : {".nii.gz", ".mha", ".nrrd"}) {
    const std::string name = std::string("a") + extension, good = itk_bytes(extension, stack(), true);
    std::string bytes = good;
    bytes[bytes.size() - 3] = char(bytes[bytes.size() - 3] ^ 1);  // in the checksum or the length
    expect_refused(name, bytes, "compressed samples do not unpack");
    expect_refused(name, good + "junk", "4 bytes follow the end of its compressed samples, none expected");
  }
  const std::string more = "tells of other samples than it holds: ";
  expect_refused("b.mha", with(itk_bytes(".mha", stack()), "MET_SHORT", "MET_UCHAR"),
                 more + "240 bytes of samples expected, got 480");
  expect_refused("b.nrrd", itk_bytes(".nrrd", stack()) + "x", more + "480 bytes of samples expected, got 481");
  expect_refused("b.nii", itk_bytes(".nii", stack()) + std::string(16, '\0'),
                 more + "480 bytes of samples expected, got 496");
}

// Directions as programs print them: each number rounded to four digits.
TEST_F(ReadVolume, RoundedDirectionsAreMadeExact) {
  const Matrix3d exact = (Eigen::AngleAxisd(0.7, Vector3d(1, -2, 0.5).normalized())).toRotationMatrix();
  std::string text, nifti = replaced(itk_bytes(".nii", stack()), 252, number<std::int16_t>(0));
  for (int axis = 0; axis < 3; ++axis)
    for (int row = 0; row < 3; ++row) {
      char digits[32];
      std::snprintf(digits, sizeof digits, " %.4f", exact(row, axis));
      text += digits;
      const float rounded = float(std::round(exact(row, axis) * 1e4) / 1e4);
      nifti = replaced(nifti, std::size_t(280 + 16 * row + 4 * axis), number(row < 2 ? -rounded : rounded));
    }
  const std::string mha = itk_bytes(".mha", stack());
  for (const Volume& volume :
       {of("b.mha", with(mha, "TransformMatrix = 1 0 0 0 1 0 0 0 1", "TransformMatrix =" + text)),
        of("b.nii", nifti)}) {
    const Matrix3d& direction = volume.grid.direction;
    EXPECT_LT((direction.transpose() * direction - Matrix3d::Identity()).norm(), 1e-12);
    EXPECT_LT((direction - exact).norm(), 3e-4);
  }
}

TEST_F(ReadVolume, VoxelsOfImpossibleSizes) {
  const auto spaced = [](const std::string& length) { return "ElementSpacing = 1 1 " + length; };
  expect_faults(
      folder / "b.mha", itk_bytes(".mha", stack()),
      {{spaced("1"), spaced("1e-300"), "voxel spacing 1e-300 mm; expected 0.001 to 100 mm: is it in another unit?"},
       {spaced("1"), spaced("0.0005"), "voxel spacing 0.0005 mm; expected"},
       {spaced("1"), spaced("1e308"), "voxel spacing 1e+308 mm; expected"},
       {"Offset = 0 0 0", "Offset = 0 0 1e308", "the volume begins 1e+308 mm from the origin; expected at most 1 km"}},
      [](const auto& path) { read(path); });
}

// By its place in space, each voxel keeps its value.
TEST_F(ReadVolume, LeftHandedAxesBecomeRightHanded) {
  ItkGrid<std::int16_t> grid = stack();
  grid.spacing = {0.5, 0.75, 1.25};
  grid.origin = {10, 20, 30};
  grid.axes[2] = {0, 0, -1};
  for (const char* name : {"a.mha", "a.nrrd", "a.nii"}) {
    const Volume volume = of(name, grid);
    EXPECT_TRUE(volume.grid.direction.isIdentity(1e-6)) << name;
    EXPECT_LT((volume.grid.origin_mm - Vector3d(10, 20, 30 - 4 * 1.25)).norm(), 1e-5) << name;
    EXPECT_EQ(volume.at(1, 2, 0), (4 * 48 + 2 * 8 + 1) * 13 - 1000) << name;
    EXPECT_EQ(volume.at(1, 2, 4), (2 * 8 + 1) * 13 - 1000) << name;
  }
}

TEST_F(ReadVolume, PipesDevicesAndLinksToThemselvesAreNoFiles) {
  for (const char* name : {"a.mha", "a.nrrd", "a.nii", "a.nii.gz", "a.tif"}) {
    ASSERT_EQ(::mkfifo((folder / name).c_str(), 0600), 0);
    expect_refused(name, "expected a file, this is none");
  }
  std::filesystem::create_symlink("/dev/zero", folder / "z.nii");
  expect_refused("z.nii", "expected a file, this is none");
}

class VolumeFolder : public InAFolder {
 protected:
  VolumeFolder() {
    for (const char* name : {"mhd/ct.mhd", "nhdr/ct.nhdr"}) {
      std::filesystem::create_directories((folder / name).parent_path());
      write_itk(folder / name, ramp<std::int16_t>({8, 6, 5}, 13, -1000));
    }
  }
};

TEST_F(VolumeFolder, HeadersNameFilesInTheirFolderInAnyForm) {
  for (const char* header : {"mhd/ct.mhd", "nhdr/ct.nhdr"}) {
    const auto path = folder / header, ct = path.parent_path();
    EXPECT_SAYS(read(path), "name the folder that holds both");
    std::filesystem::create_directories(ct / "sub");
    std::filesystem::copy_file(ct / "ct.raw", ct / "sub/below.raw");
    std::filesystem::copy_file(ct / "ct.raw", ct / "odd\\name..raw");
    const std::string bytes = bytes_of(path);
    const auto naming = [&](const std::string& file) {
      put(path, with(bytes, "ct.raw", file));
      return read(ct).values.at(7);
    };
    for (const char* file :
         {"ct.raw", "./ct.raw", ".\\ct.raw", ".//./ct.raw", "sub/below.raw", ".\\sub\\below.raw", "odd\\name..raw"})
      EXPECT_EQ(naming(file), 7 * 13 - 1000) << file;
    for (const char* file :
         {"../mhd/ct.raw", "sub/../ct.raw", "..\\mhd\\ct.raw", "/etc/hostname", "\\etc\\hostname", "./", "sub/", "."})
      EXPECT_SAYS(naming(file), "for its samples; expected one file that lies beside it, or in a folder beside it");
    EXPECT_SAYS(naming("./gone.raw"), "names './gone.raw' for its samples, which is not there");
    const TemporaryFolder elsewhere;
    std::filesystem::copy_file(ct / "ct.raw", elsewhere / "ct.raw");
    std::filesystem::create_directory_symlink(elsewhere.path(), ct / "link");
    EXPECT_SAYS(naming("link/ct.raw"), "link: is a link to a place outside the folder");
  }
}

// A header in any spelling names no file outside the folder.
TEST_F(VolumeFolder, NothingOutsideIsOpened) {
  const TemporaryFolder elsewhere;
  std::filesystem::copy(folder / "mhd/ct.raw", elsewhere / "ct.raw");
  const std::string raw = (elsewhere / "ct.raw").string(), mhd = "ElementDataFile = ct.raw", nhdr = "data file: ct.raw";
  const std::string beside = "expected one file that lies beside it", several = "names several files for its samples";
  std::string remarks;
  for (int i = 0; i < 300; ++i) remarks += "Comment" + std::to_string(i) + " = x\n";
  struct Row {
    std::string header, from, to, said;
  };
  for (const auto& [header, from, to, said] :
       {Row{"mhd/ct.mhd", mhd, "elementdatafile = " + raw, beside},
        {"mhd/ct.mhd", mhd, "ELEMENTDATAFILE : ../x/a.raw", beside},
        {"mhd/ct.mhd", mhd, remarks + "ElementDataFile = " + raw, beside},
        {"mhd/ct.mhd", mhd, "ElementDataFile = LIST\n" + raw, several},
        {"mhd/ct.mhd", mhd, "ElementDataFile = LIST 2\n" + raw, several},
        {"mhd/ct.mhd", mhd, "ElementDataFile = /tmp/a%d.raw 1 5 1", several},
        {"mhd/ct.mhd", "ct.raw", "gone.raw", "'gone.raw' for its samples, which is not there"},
        {"nhdr/ct.nhdr", nhdr, "DATA FILE: " + raw, beside},
        {"nhdr/ct.nhdr", nhdr, "data file: LIST\n" + raw, several},
        {"nhdr/ct.nhdr", nhdr, "datafile: a%02d.raw 1 5 1 2", several}}) {
    const std::string good = bytes_of(folder / header);
    put(folder / header, with(good, from, to));
    EXPECT_SAYS(read((folder / header).parent_path()), said);
    put(folder / header, good);
  }
}

TEST_F(VolumeFolder, LinksOutOfItAreRefused) {
  namespace fs = std::filesystem;
  const TemporaryFolder elsewhere;
  const auto moved_out = [&](const fs::path& file) {
    fs::copy(file, elsewhere / file.filename());
    fs::remove(file);
    fs::create_symlink(elsewhere / file.filename(), file);
  };
  moved_out(folder / "mhd/ct.raw");
  EXPECT_SAYS(read(folder / "mhd"), "ct.raw: is a link to a place outside the folder; copy the file itself");
  moved_out(folder / "mhd/ct.mhd");
  EXPECT_SAYS(read(folder / "mhd"), "ct.mhd: is a link to a place outside the folder");
  fs::create_directories(folder / "series");
  for (int k = 0; k < 3; ++k) {
    DicomSlice slice;
    slice.position = {0, 0, double(k)};
    slice.values.assign(12, std::int16_t(k));
    write_dicom(folder / ("series/s" + std::to_string(k) + ".dcm"), slice);
  }
  const fs::path second = folder / "series/s1.dcm";
  moved_out(second);
  EXPECT_SAYS(read(folder / "series"), "s1.dcm: is a link to a place outside the folder");
  fs::remove(second);
  fs::create_symlink("s1.dcm", second);
  EXPECT_SAYS(read(folder / "series"), "s1.dcm: is a link that leads nowhere");
  fs::remove(second);
  fs::copy(elsewhere / "s1.dcm", folder / "series/real");
  fs::create_symlink("real", second);
  EXPECT_SAYS(read(folder / "series"), "lie at the same place");  // a link inside the folder is followed
}

}  // namespace volume_test
