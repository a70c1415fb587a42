// SPDX-License-Identifier: Apache-2.0
// What holds for volumes of every format: samples, directions and sizes as the header says, and nothing from elsewhere.
#include <sys/stat.h>

#include <Eigen/Geometry>

#include "tests/plugins/read/hostile_volumes.hpp"

namespace hostile_volumes_test {

using namespace hostile_volumes;
using namespace marrow::test;

TEST_F(Hostile, PackedSamplesAreVerifiedToTheirEnd) {
  for (const char* name : {"a.nii.gz", "a.mha", "a.nrrd"}) {
    write_itk(folder / name, stack(), true);
    std::string bytes = bytes_of(folder / name);
    bytes[bytes.size() - 3] = char(bytes[bytes.size() - 3] ^ 1);  // in the checksum or the length
    expect(name, bytes, "compressed samples do not unpack");
  }
}

TEST_F(Hostile, SamplesThatTheHeaderDoesNotTellOfAreRefused) {
  const std::string more = "tells of other samples than it holds: ";
  expect("b.mha", with(good("a.mha"), "MET_SHORT", "MET_UCHAR"), more + "240 bytes of samples expected, got 480");
  expect("b.nrrd", good("a.nrrd") + "x", more + "480 bytes of samples expected, got 481");
  expect("b.nii", good("a.nii") + std::string(16, '\0'), more + "480 bytes of samples expected, got 496");
  for (const char* name : {"a.nii.gz", "a.mha", "a.nrrd"}) {
    write_itk(folder / name, stack(), true);
    expect(name, bytes_of(folder / name) + "junk", "4 bytes follow the end of its compressed samples, none expected");
  }
}

// Directions as programs print them: each number rounded to four digits.
TEST_F(Hostile, RoundedDirectionsAreMadeExact) {
  const Eigen::Matrix3d exact = (Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, -2, 0.5).normalized())).toRotationMatrix();
  const Eigen::Matrix3d rounded = (exact * 1e4).array().round() / 1e4;
  std::string text;
  char number_text[32];
  for (int axis = 0; axis < 3; ++axis)
    for (int row = 0; row < 3; ++row) {
      std::snprintf(number_text, sizeof number_text, " %.4f", exact(row, axis));
      text += number_text;
    }
  put(folder / "b.mha", with(good("a.mha"), "TransformMatrix = 1 0 0 0 1 0 0 0 1", "TransformMatrix =" + text));
  std::string nifti = replaced(good("a.nii"), 252, number<std::int16_t>(0));
  for (int row = 0; row < 3; ++row)
    for (int axis = 0; axis < 3; ++axis)
      nifti = replaced(nifti, 280 + 16 * std::size_t(row) + 4 * std::size_t(axis),
                       number(float(row < 2 ? -rounded(row, axis) : rounded(row, axis))));
  put(folder / "b.nii", nifti);
  for (const char* name : {"b.mha", "b.nii"}) {
    const marrow::Grid grid = volume_at(folder / name).grid;
    EXPECT_LT((grid.direction.transpose() * grid.direction - Eigen::Matrix3d::Identity()).norm(), 1e-12) << name;
    EXPECT_LT((grid.direction - exact).norm(), 3e-4) << name;
  }
}

TEST_F(Hostile, VoxelsOfImpossibleSizes) {
  const std::string bytes = good("a.mha");
  for (const auto& [length, said] :
       {std::pair{"1e-300", "voxel spacing 1e-300 mm; expected 0.001 to 100 mm: is it in another unit?"},
        {"0.0005", "voxel spacing 0.0005 mm; expected"},
        {"1e308", "voxel spacing 1e+308 mm; expected"}})
    expect("b.mha", with(bytes, "ElementSpacing = 1 1 1", "ElementSpacing = 1 1 " + std::string(length)), said);
  expect("b.mha", with(bytes, "Offset = 0 0 0", "Offset = 0 0 1e308"),
         "the volume begins 1e+308 mm from the origin; expected at most 1 km");
}

// By its place in space, each voxel keeps its value.
TEST_F(Hostile, LeftHandedAxesBecomeRightHanded) {
  ItkGrid<std::int16_t> grid = stack();
  grid.spacing = {0.5, 0.75, 1.25};
  grid.origin = {10, 20, 30};
  grid.axes[2] = {0, 0, -1};
  for (const char* name : {"a.mha", "a.nrrd", "a.nii"}) {
    write_itk(folder / name, grid);
    const marrow::Volume volume = volume_at(folder / name);
    EXPECT_TRUE(volume.grid.direction.isIdentity(1e-6)) << name;
    EXPECT_LT((volume.grid.origin_mm - Eigen::Vector3d(10, 20, 30 - 4 * 1.25)).norm(), 1e-5) << name;
    EXPECT_EQ(volume.at(1, 2, 0), (4 * 48 + 2 * 8 + 1) * 13 - 1000) << name;
    EXPECT_EQ(volume.at(1, 2, 4), (2 * 8 + 1) * 13 - 1000) << name;
  }
}

// A header in any spelling names no file outside the folder.
TEST_F(Hostile, NothingOutsideTheFolderIsOpened) {
  const TemporaryFolder elsewhere;
  write_itk(elsewhere / "a.mhd", stack());
  write_itk(elsewhere / "a.nhdr", stack());
  const std::string mhd = bytes_of(elsewhere / "a.mhd"), nhdr = bytes_of(elsewhere / "a.nhdr"),
                    raw = (elsewhere / "a.raw").string();
  ASSERT_TRUE(std::filesystem::exists(raw));
  const auto refused = [&](const std::string& name, const std::string& text, const std::string& header) {
    const TemporaryFolder ct;
    std::filesystem::copy(raw, ct / "a.raw");
    put(ct / name, header);
    EXPECT_SAYS(volume_at(ct.path()), text);
  };
  refused("a.mhd", "expected one file that lies beside it",
          with(mhd, "ElementDataFile = a.raw", "elementdatafile = " + raw));
  refused("a.mhd", "expected one file that lies beside it",
          with(mhd, "ElementDataFile = a.raw", "ELEMENTDATAFILE : ../x/a.raw"));
  std::string remarks;
  for (int i = 0; i < 300; ++i) remarks += "Comment" + std::to_string(i) + " = x\n";
  refused("a.mhd", "expected one file that lies beside it",
          remarks + with(mhd, "ElementDataFile = a.raw", "ElementDataFile = " + raw));
  refused("a.mhd", "names several files for its samples",
          with(mhd, "ElementDataFile = a.raw", "ElementDataFile = LIST\n" + raw));
  refused("a.mhd", "names several files for its samples",
          with(mhd, "ElementDataFile = a.raw", "ElementDataFile = LIST 2\n" + raw));
  refused("a.mhd", "names several files for its samples",
          with(mhd, "ElementDataFile = a.raw", "ElementDataFile = /tmp/a%d.raw 1 5 1"));
  refused("a.nhdr", "expected one file that lies beside it", with(nhdr, "data file: a.raw", "DATA FILE: " + raw));
  refused("a.nhdr", "names several files for its samples", with(nhdr, "data file: a.raw", "data file: LIST\n" + raw));
  refused("a.nhdr", "names several files for its samples",
          with(nhdr, "data file: a.raw", "datafile: a%02d.raw 1 5 1 2"));
  refused("a.mhd", "'gone.raw' for its samples, which is not there", with(mhd, "a.raw", "gone.raw"));
}

TEST_F(Hostile, LinksOutOfTheFolderAreRefused) {
  const TemporaryFolder elsewhere;
  write_itk(elsewhere / "a.mhd", stack());
  std::filesystem::create_directory(folder / "mhd");
  std::filesystem::copy(elsewhere / "a.mhd", folder / "mhd/a.mhd");
  std::filesystem::create_symlink(elsewhere / "a.raw", folder / "mhd/a.raw");
  EXPECT_SAYS(volume_at(folder / "mhd"), "a.raw: is a link to a place outside the folder; copy the file itself");
  std::filesystem::remove(folder / "mhd/a.mhd");
  std::filesystem::create_symlink(elsewhere / "a.mhd", folder / "mhd/a.mhd");
  EXPECT_SAYS(volume_at(folder / "mhd"), "a.mhd: is a link to a place outside the folder");
  for (int k = 0; k < 3; ++k) {
    DicomSlice slice;
    slice.position = {0, 0, double(k)};
    slice.values.assign(12, std::int16_t(k));
    std::filesystem::create_directories(folder / "series");
    write_dicom((k == 1 ? elsewhere / "s1.dcm" : folder / ("series/s" + std::to_string(k) + ".dcm")), slice);
  }
  std::filesystem::create_symlink(elsewhere / "s1.dcm", folder / "series/s1.dcm");
  EXPECT_SAYS(volume_at(folder / "series"), "s1.dcm: is a link to a place outside the folder");
  std::filesystem::remove(folder / "series/s1.dcm");
  std::filesystem::create_symlink("s1.dcm", folder / "series/s1.dcm");
  EXPECT_SAYS(volume_at(folder / "series"), "s1.dcm: is a link that leads nowhere");
  std::filesystem::remove(folder / "series/s1.dcm");
  std::filesystem::copy(elsewhere / "s1.dcm", folder / "series/real");
  std::filesystem::create_symlink("real", folder / "series/s1.dcm");
  EXPECT_SAYS(volume_at(folder / "series"), "lie at the same place");  // a link inside the folder is followed
}

TEST_F(Hostile, PipesDevicesAndLinksToThemselvesAreNoFiles) {
  for (const char* name : {"a.mha", "a.nrrd", "a.nii", "a.nii.gz", "a.tif"}) {
    ASSERT_EQ(::mkfifo((folder / name).c_str(), 0600), 0);
    EXPECT_REFUSED(volume_at(folder / name), name, "expected a file, this is none");
  }
  std::filesystem::create_symlink("/dev/zero", folder / "z.nii");
  EXPECT_REFUSED(volume_at(folder / "z.nii"), "z.nii", "expected a file, this is none");
}

}  // namespace hostile_volumes_test
