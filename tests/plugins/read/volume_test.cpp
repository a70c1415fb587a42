// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "tests/plugins/read/files.hpp"
#include "tests/plugins/read/itk_files.hpp"
#include "tests/plugins/read/reading.hpp"

namespace volume_test {

using marrow::test::ItkGrid;
using marrow::test::TemporaryFolder;
using marrow::test::write_itk;

marrow::Volume read(const std::filesystem::path& path, const shipped::Options& options = {}) {
  return marrow::test::read_by<marrow::Volume>("read.volume", path, options);
}

shipped::Options options(const std::vector<double>& voxel_size_mm, const std::vector<std::string>& flip = {},
                         double value_offset_hu = 0) {
  return {{"voxel_size_mm", voxel_size_mm}, {"flip", flip}, {"value_offset_hu", value_offset_hu}};
}

/// A grid turned about a skew axis, so that a transposed or mirrored direction would be seen.
ItkGrid<std::int16_t> turned_grid() {
  ItkGrid<std::int16_t> grid;
  grid.size = {5, 4, 3};
  grid.spacing = {0.5, 0.75, 1.25};
  grid.origin = {-10, 20, 30.5};
  const Eigen::Matrix3d turn = marrow::rotation_from_vector({0.3, -0.2, 0.5});
  for (int k = 0; k < 3; ++k) grid.axes[k] = {turn(0, k), turn(1, k), turn(2, k)};
  for (int i = 0; i < 60; ++i) grid.samples.push_back(std::int16_t(i * 37 - 1000));
  return grid;
}

class VolumeFormats : public testing::TestWithParam<std::tuple<const char*, bool>> {};

TEST_P(VolumeFormats, AreReadWithTheirGridAsItkWroteThem) {
  const TemporaryFolder folder;
  const auto path = folder / ("ct" + std::string(std::get<0>(GetParam())));
  const auto written = turned_grid();
  write_itk(path, written, std::get<1>(GetParam()));
  const marrow::Volume volume = read(path);
  EXPECT_EQ(volume.grid.size, (std::array<int, 3>{5, 4, 3}));
  EXPECT_EQ(volume.grid.frame, "ct");
  const double tolerance = 1e-5;  // NIfTI keeps its matrix in float
  EXPECT_LT((volume.grid.spacing_mm - Eigen::Vector3d(0.5, 0.75, 1.25)).norm(), tolerance);
  EXPECT_LT((volume.grid.origin_mm - Eigen::Vector3d(-10, 20, 30.5)).norm(), tolerance);
  EXPECT_LT((volume.grid.direction - marrow::rotation_from_vector({0.3, -0.2, 0.5})).norm(), tolerance);
  for (int i = 0; i < 60; ++i) EXPECT_EQ(volume.values[i], float(i * 37 - 1000));
}

INSTANTIATE_TEST_SUITE_P(All, VolumeFormats,
                         testing::Values(std::tuple{".mha", false}, std::tuple{".mha", true},
                                         std::tuple{".nrrd", false}, std::tuple{".nrrd", true},
                                         std::tuple{".nii", false}, std::tuple{".nii.gz", true}));

/// Samples of 10 x 10 x 10 voxels: `count` of each value, then zeros.
ItkGrid<std::int16_t> grid_with(const std::vector<std::pair<int, std::int16_t>>& parts) {
  ItkGrid<std::int16_t> grid{.size = {10, 10, 10}};
  for (const auto& [count, value] : parts) grid.samples.insert(grid.samples.end(), std::size_t(count), value);
  grid.samples.resize(1000);
  return grid;
}

struct Offset {
  const char* what;
  std::vector<std::pair<int, std::int16_t>> parts;
  bool is_doubtful;
};

class ForgottenOffset : public testing::TestWithParam<Offset> {};

TEST_P(ForgottenOffset, IsSaidInWords) {
  const TemporaryFolder folder;
  write_itk(folder / "ct.mha", grid_with(GetParam().parts));
  std::string said;
  marrow::Context::Hooks hooks;
  hooks.log = [&](std::string_view text, marrow::LogLevel level) {
    if (level == marrow::LogLevel::warning) said += text;
  };
  const auto warned = [&](double offset) {
    said.clear();
    marrow::test::read_by<marrow::Volume>("read.volume", folder / "ct.mha", {{"value_offset_hu", offset}},
                                          marrow::Context(hooks));
    return said;
  };
  EXPECT_EQ(marrow::test::without_folder(warned(0), folder.path()),
            GetParam().is_doubtful
                ? "/ct.mha: the CT seems to hold HU + 1024, not Hounsfield units: no value is below 0, and soft tissue "
                  "and bone lie about 1024 too high. If so, give value_offset_hu: -1024 (-1000 if 1000 was added); "
                  "without it, thresholds and simulated X-ray images are wrong"
                : "")
      << GetParam().what;
  EXPECT_EQ(warned(-1024), "");
}

INSTANTIATE_TEST_SUITE_P(
    All, ForgottenOffset,
    testing::Values(
        Offset{"a bone alone, + 1024", {{100, 950}, {100, 1300}, {100, 2500}}, true},
        Offset{"a patient, + 1024", {{300, 20}, {20, 500}, {300, 1060}, {50, 900}, {50, 2300}}, true},
        Offset{"a patient", {{400, -1000}, {400, 40}, {100, 1300}}, false},
        Offset{"a bone alone", {{40, 100}, {60, 300}, {100, 700}, {100, 1500}}, false},
        Offset{"a bone cut out of a patient, cut off at 0", {{500, 40}, {60, 400}, {60, 1000}, {60, 1500}}, false},
        Offset{"labels", {{300, 1}, {200, 117}}, false}));

TEST(ReadVolume, FlipVoxelSizeAndOffset) {
  const TemporaryFolder folder;
  write_itk(folder / "a.mha", turned_grid());
  const marrow::Volume plain = read(folder / "a.mha");
  const marrow::Volume changed = read(folder / "a.mha", options({1, 2, 3}, {"x", "z"}, -24));
  EXPECT_EQ(changed.grid.spacing_mm, Eigen::Vector3d(1, 2, 3));
  for (int z = 0; z < 3; ++z)
    for (int y = 0; y < 4; ++y)
      for (int x = 0; x < 5; ++x) EXPECT_EQ(changed.at(x, y, z), plain.at(4 - x, y, 2 - z) - 24);
  EXPECT_SAYS(read(folder / "a.mha", options({}, {"w"})), "flip: expected axes x, y or z, got 'w'");
  EXPECT_SAYS(read(folder / "a.mha", options({1, 2})), "voxel_size_mm: expected 3 lengths, got 2");
  EXPECT_SAYS(read(folder / "a.mha", options({1, 0, 1})), "expected positive lengths");
}

TEST(ReadVolume, ATiffNeedsTheSizeOfItsVoxels) {
  const TemporaryFolder folder;
  ItkGrid<std::uint16_t> stack{.size = {5, 4, 3}};
  for (int i = 0; i < 60; ++i) stack.samples.push_back(std::uint16_t(i * 60));
  write_itk(folder / "ct.tif", stack);
  const marrow::Volume volume = read(folder / "ct.tif", options({0.4, 0.5, 0.6}, {}, -1024));
  EXPECT_EQ(volume.grid.size, (std::array<int, 3>{5, 4, 3}));
  EXPECT_EQ(volume.grid.spacing_mm, Eigen::Vector3d(0.4, 0.5, 0.6));
  EXPECT_EQ(volume.at(4, 3, 2), 59 * 60 - 1024);
  EXPECT_SAYS(read(folder / "ct.tif"), "a TIFF does not say how large its voxels are; give voxel_size_mm");
}

TEST(ReadVolume, ANiftiMayHoldOneSlice) {
  const TemporaryFolder folder;
  auto slice = turned_grid();
  slice.size = {5, 4, 1};
  slice.samples.resize(20);
  write_itk(folder / "slice.nii.gz", slice, true);
  const marrow::Volume volume = read(folder / "slice.nii.gz");
  EXPECT_EQ(volume.grid.size, (std::array<int, 3>{5, 4, 1}));
  EXPECT_EQ(volume.at(4, 3, 0), 19 * 37 - 1000);
}

TEST(ReadVolume, WristTiff) {
  MARROW_NEED_DATA(path, "wrist/volumes/rad_dcm_cropped.tif");
  const marrow::Volume volume = read(path, options({0.39625, 0.39625, 0.625}, {}, -1024));
  EXPECT_EQ(volume.grid.size, (std::array<int, 3>{68, 86, 128}));
  EXPECT_EQ(volume.grid.spacing_mm, Eigen::Vector3d(0.39625, 0.39625, 0.625));
  const auto [least, greatest] = std::minmax_element(volume.values.begin(), volume.values.end());
  EXPECT_EQ(*least, -1024);
  EXPECT_LE(*greatest, 4095 - 1024);
  EXPECT_GT(*greatest, 1000);
  EXPECT_SAYS(read(path), "a TIFF does not say how large its voxels are; give voxel_size_mm");
}

TEST(ReadVolume, NiftiLabelSliceOfTheVisibleHuman) {
  MARROW_NEED_DATA(path, "pelvis_dicom/slice_1000_segmentation.nii.gz");
  const marrow::Volume volume = read(path);
  EXPECT_EQ(volume.grid.size, (std::array<int, 3>{512, 512, 1}));
}

TEST(ReadVolume, DetachedHeadersNeedTheFolderThatHoldsTheirData) {
  const TemporaryFolder folder;
  for (const char* name : {"mhd/ct.mhd", "nhdr/ct.nhdr"}) {
    const auto path = folder / name;
    std::filesystem::create_directories(path.parent_path());
    write_itk(path, turned_grid());
    EXPECT_EQ(read(path.parent_path()).values[7], 7 * 37 - 1000) << name;
    EXPECT_SAYS(read(path), "name the folder that holds both");
  }
  const auto header = folder / "mhd/ct.mhd";
  marrow::test::put(
      header, marrow::test::with(marrow::test::bytes_of(header), "ElementDataFile = ", "ElementDataFile = ../mhd/"));
  EXPECT_SAYS(read(folder / "mhd"), "expected one file that lies beside it");
}

TEST(ReadVolume, DetachedHeadersNameFilesInTheirFolderInAnyForm) {
  const TemporaryFolder folder;
  for (const char* header : {"mhd/ct.mhd", "nhdr/ct.nhdr"}) {
    const auto path = folder / header, ct = path.parent_path();
    std::filesystem::create_directories(ct / "sub");
    write_itk(path, turned_grid());
    std::filesystem::copy_file(ct / "ct.raw", ct / "sub/below.raw");
    std::filesystem::copy_file(ct / "ct.raw", ct / "odd\\name..raw");
    const std::string bytes = marrow::test::bytes_of(path);
    const auto naming = [&](const std::string& file) {
      marrow::test::put(path, marrow::test::with(bytes, "ct.raw", file));
      return read(ct).values.at(7);
    };
    for (const char* file :
         {"ct.raw", "./ct.raw", ".\\ct.raw", ".//./ct.raw", "sub/below.raw", ".\\sub\\below.raw", "odd\\name..raw"})
      EXPECT_EQ(naming(file), 7 * 37 - 1000) << file;
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

TEST(ReadVolume, RefusesWhatIsNoCt) {
  const TemporaryFolder folder;
  ItkGrid<float> nan{.size = {2, 2, 2}, .samples = {0, 1, 2, std::numeric_limits<float>::quiet_NaN(), 4, 5, 6, 7}};
  write_itk(folder / "nan.mha", nan);
  EXPECT_SAYS(read(folder / "nan.mha"), "voxel (1, 1, 0) is not a finite number");
  ItkGrid<std::uint8_t> colours{.size = {2, 2, 2}, .samples = std::vector<std::uint8_t>(24), .components = 3};
  write_itk(folder / "colours.mha", colours);
  EXPECT_SAYS(read(folder / "colours.mha"), "has 3 values per voxel; a CT has one");
  ItkGrid<float> flat{.size = {2, 2}, .samples = {1, 2, 3, 4}};
  write_itk(folder / "flat.mha", flat);
  EXPECT_SAYS(read(folder / "flat.mha"), "is one image, not a volume");
  ItkGrid<float> series{.size = {2, 2, 2, 3}, .samples = std::vector<float>(24)};
  write_itk(folder / "series.mha", series);
  EXPECT_SAYS(read(folder / "series.mha"), "has 4 dimensions; expected one volume");
  EXPECT_SAYS(read(folder / "absent.mha"), "there is no such file or folder");
  marrow::test::put(folder / "a.xyz", "x");
  EXPECT_SAYS(read(folder / "a.xyz"), "not a volume that can be read; known are .mha");
}

TEST(ReadVolume, DamagedFilesAreDiagnosed) {
  const TemporaryFolder folder;
  ItkGrid<std::int16_t> grid = turned_grid();
  grid.size = {20, 20, 20};
  grid.samples.assign(8000, 0);
  for (int i = 0; i < 8000; ++i) grid.samples[i] = std::int16_t((i * 7919) % 2000);
  for (const char* extension : {".mha", ".nrrd", ".nii", ".nii.gz"})
    for (const bool compressed : {false, true}) {
      SCOPED_TRACE(std::string(extension) + (compressed ? " compressed" : ""));
      write_itk(folder / ("good" + std::string(extension)), grid, compressed);
      marrow::test::expect_damage_is_diagnosed(folder / ("good" + std::string(extension)),
                                               folder / ("damaged" + std::string(extension)),
                                               [](const auto& path) { read(path); });
    }
}

TEST(ReadVolume, DamagedTiffIsDiagnosed) {
  MARROW_NEED_DATA(path, "wrist/volumes/rad_dcm_cropped.tif");
  const TemporaryFolder folder;
  marrow::test::expect_damage_is_diagnosed(path, folder / "damaged.tif", [](const auto& damaged) {
    read(damaged, options({1, 1, 1}));
  });
}

TEST(ReadVolume, HeadersThatClaimTooMuchAreRefusedBeforeAnythingIsAllocated) {
  const TemporaryFolder folder;
  write_itk(folder / "ct.mha", turned_grid());
  const std::string good = marrow::test::bytes_of(folder / "ct.mha");
  for (const char* size : {"90000 90000 90000", "-5 4 3", "0 4 3", "2000000000 2000000000 2000000000", "5 4"}) {
    marrow::test::put(folder / "bad.mha",
                      marrow::test::with(good, "DimSize = 5 4 3", "DimSize = " + std::string(size)));
    SCOPED_TRACE(size);
    EXPECT_SAYS(read(folder / "bad.mha"), "bad.mha");
  }
  marrow::test::put(folder / "huge.mha", marrow::test::with(good, "DimSize = 5 4 3", "DimSize = 9000 9000 9000"));
  EXPECT_SAYS(read(folder / "huge.mha"), "its header claims 9000 x 9000 x 9000 samples, but the file has only");
}

}  // namespace volume_test
