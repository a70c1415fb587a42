// SPDX-License-Identifier: Apache-2.0
// Volumes whose headers lie: sizes, types, fields, places, and files that lie elsewhere.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <zlib.h>

#include <cstring>

#include "marrow/toolbox/files/volume_file.hpp"
#include "read/files.hpp"
#include "read/hostile.hpp"
#include "read/itk_files.hpp"

namespace {

using namespace marrow::test;
using Path = std::filesystem::path;

marrow::Volume volume_at(const Path& path) {
  marrow::files::VolumeReading reading;
  if (path.extension() == ".tif") reading.voxel_size_mm = {1, 1, 1};
  return marrow::files::read_volume_file(path, reading);
}

ItkGrid<std::int16_t> stack() {
  ItkGrid<std::int16_t> grid{.size = {8, 6, 5}};
  for (int i = 0; i < 240; ++i) grid.samples.push_back(std::int16_t(i * 13 - 1000));
  return grid;
}

template <class T>
std::string number(T value) {
  return {reinterpret_cast<const char*>(&value), sizeof value};
}

std::string replaced(std::string bytes, std::size_t at, const std::string& by) {
  return bytes.replace(at, by.size(), by);
}

class Hostile : public testing::Test {
 protected:
  std::string good(const std::string& name) {
    write_itk(folder / name, stack());
    return bytes_of(folder / name);
  }
  void expect(const std::string& name, const std::string& bytes, const std::string& text) {
    put(folder / name, bytes);
    EXPECT_REFUSED(volume_at(folder / name), name, text);
  }
  TemporaryFolder folder;
};

TEST_F(Hostile, NiftiWhoseTypeAndBitsDisagree) {
  const std::string bytes = good("a.nii");
  expect("b.nii", replaced(bytes, 70, number<std::int16_t>(16)),
         "says that samples are of type 16, which have 32 bits, and that they have 16 bits");
  expect("b.nii", replaced(bytes, 72, number<std::int16_t>(8)),
         "type 4, which have 16 bits, and that they have 8 bits");
  expect("b.nii", replaced(bytes, 70, number<std::int16_t>(1536)), "of type 1536, which is not read");
  expect("b.nii", replaced(bytes, 70, number<std::int16_t>(32)), "of type 32, which is not read");
}

TEST_F(Hostile, NiftiWhosePlacesAndLengthsAreNone) {
  const std::string bytes = good("a.nii");
  for (const float place : {std::nanf(""), HUGE_VALF, -1.f, 0.f, 352.5f, 1e30f})
    expect("b.nii", replaced(bytes, 108, number(place)), "samples begin at byte");
  expect("b.nii", replaced(bytes, 80, number(std::nanf(""))), "is not a positive length");
  expect("b.nii", replaced(bytes, 80, number(-1.f)), "is not a positive length");
  expect("b.nii", replaced(bytes, 112, number(HUGE_VALF)), "scales samples by a number that is not finite");
  expect("b.nii", replaced(bytes, 42, number<std::int16_t>(-8)), "gives a size of -8");
  expect("b.nii", replaced(bytes, 40, number<std::int16_t>(9)), "tells of 9 dimensions");
  expect("b.nii", replaced(bytes, 46, number<std::int16_t>(6)),
         "is cut off or damaged: 576 bytes of samples expected, got 480");
  expect("b.nii", replaced(bytes, 344, "ni1"), "is not a NIfTI-1 file with its samples in it");
}

TEST_F(Hostile, NiftiSaysWhereItLies) {
  std::string bytes = replaced(good("a.nii"), 254, number<std::int16_t>(0));  // no sform: by its quaternion
  put(folder / "b.nii", bytes);
  EXPECT_LT((volume_at(folder / "b.nii").grid.direction - Eigen::Matrix3d::Identity()).norm(), 1e-6);
  bytes = replaced(replaced(good("a.nii"), 252, number<std::int16_t>(0)), 284, number(0.5f));  // sform alone, sheared
  expect("b.nii", bytes, "by a matrix that is sheared or damaged");
}

TEST_F(Hostile, BombIsRefusedBeforeItIsUnpacked) {
  std::string header = good("a.nii").substr(0, 352);
  header = replaced(replaced(header, 70, number<std::int16_t>(2)), 72, number<std::int16_t>(8));
  for (const int at : {42, 44, 46}) header = replaced(header, std::size_t(at), number<std::int16_t>(400));
  const gzFile file = gzopen((folder / "bomb.nii.gz").c_str(), "wb9");
  gzwrite(file, header.data(), unsigned(header.size()));
  const std::vector<char> zeros(1 << 20);
  for (int i = 0; i < 62; ++i) gzwrite(file, zeros.data(), unsigned(zeros.size()));
  gzclose(file);
  ASSERT_LT(std::filesystem::file_size(folder / "bomb.nii.gz"), 70000u);
  EXPECT_REFUSED(volume_at(folder / "bomb.nii.gz"), "bomb.nii.gz",
                 "its header claims 400 x 400 x 400 samples, but the file has only");
}

TEST_F(Hostile, PackedSamplesAreVerifiedToTheirEnd) {
  for (const char* name : {"a.nii.gz", "a.mha", "a.nrrd"}) {
    write_itk(folder / name, stack(), true);
    std::string bytes = bytes_of(folder / name);
    bytes[bytes.size() - 3] = char(bytes[bytes.size() - 3] ^ 1);  // in the checksum or the length
    expect(name, bytes, "compressed samples do not unpack");
  }
}

TEST_F(Hostile, NrrdFieldsAreReadStrictly) {
  const std::string bytes = good("a.nrrd");
  expect("b.nrrd", with(bytes, "space origin: (0,0,0)", "space origin: (0" + std::string(2000, '7') + ",0,0)"),
         "'space origin'");
  expect("b.nrrd", with(bytes, "kinds: domain", "kinds: " + std::string(2000, 'k') + " domain"), "'kinds'");
  expect("b.nrrd", with(bytes, "endian: little", "endian: little\nendian: little"), "gives 'endian' twice");
  expect("b.nrrd", with(bytes, "endian: little", "ending: little"),
         ": expected a field of a NRRD header, got 'ending: little'");
  expect("b.nrrd", with(bytes, "encoding: raw", "encoding: hex"), "expected raw or gzip");
  expect("b.nrrd", with(bytes, "sizes: 8 6 5", "sizes: 8 6"), "expected 3 numbers");
  expect("b.nrrd", with(bytes, "sizes: 8 6 5", "sizes: 8 6 nan"), "expected 3 numbers");
  expect("b.nrrd", with(bytes, "left-posterior-superior", "scanner-xyz"), "expected left-posterior-superior");
  expect("b.nrrd", with(bytes, "encoding: raw", "space units: \"um\" \"um\" \"um\"\nencoding: raw"), "expected mm");
  expect("b.nrrd", bytes.substr(0, 8) + "\n" + std::string(70000, 'x'), "is longer than");
}

TEST_F(Hostile, NrrdOfOtherSpacesIsTurnedToLps) {
  const std::string bytes = good("a.nrrd");
  put(folder / "b.nrrd", with(with(bytes, "left-posterior-superior", "right-anterior-superior"),
                              "space origin: (0,0,0)", "space origin: (1,2,3)"));
  EXPECT_EQ(volume_at(folder / "b.nrrd").grid.origin_mm, Eigen::Vector3d(-1, -2, 3));
  put(folder / "b.nrrd", with(with(with(bytes, "left-posterior-superior", "LAS"), "(0,1,0)", "(0,-1,0)"),
                              "space origin: (0,0,0)", "space origin: (1,2,3)"));
  const marrow::Volume volume = volume_at(folder / "b.nrrd");
  EXPECT_EQ(volume.grid.origin_mm, Eigen::Vector3d(1, -2, 3));
  EXPECT_TRUE(volume.grid.direction.isIdentity(0));
}

TEST_F(Hostile, MetaImageFieldsAreReadStrictly) {
  const std::string bytes = good("a.mha");
  expect("b.mha", with(bytes, "DimSize = 8 6 5", "DimSize = 8 6 5\nDimSize = 8 6 5"), "gives 'dimsize' twice");
  expect("b.mha", with(bytes, "DimSize = 8 6 5", "DimSize = 8 6 5.5"), "expected whole numbers");
  expect("b.mha", with(bytes, "DimSize = 8 6 5", "DimSize = 8 6 7e60"), "expected whole numbers");
  expect("b.mha", with(bytes, "MET_SHORT", "MET_STRING"), "expected a kind of number");
  expect("b.mha", with(bytes, "BinaryData = True", "BinaryData = False"), "written as text, which is not read");
  expect("b.mha", with(bytes, "BinaryData = True", "BinaryData = perhaps"), "expected True or False");
  put(folder / "b.mha", with(with(bytes, "DimSize", "dimsize"), "ElementDataFile", "# a remark\nELEMENTDATAFILE"));
  EXPECT_EQ(volume_at(folder / "b.mha").values[9], 9 * 13 - 1000);
}

/// `text` without the line that begins with `start`.
std::string without_line(std::string text, const std::string& start) {
  const std::size_t at = text.find("\n" + start);
  EXPECT_NE(at, std::string::npos) << start;
  return at == std::string::npos ? text : text.erase(at, text.find('\n', at + 1) - at);
}

TEST_F(Hostile, MetaImageThatDoesNotSayHowLargeVoxelsAre) {
  ItkGrid<std::int16_t> grid = stack();
  grid.spacing = {0.5, 0.75, 1.25};
  write_itk(folder / "a.mha", grid);
  const std::string bytes = bytes_of(folder / "a.mha"), without = without_line(bytes, "ElementSpacing");
  const std::string said =
      "its header does not say how large its voxels are; add 'ElementSpacing = X Y Z' (mm) to it, or give "
      "voxel_size_mm";
  expect("b.mha", without, said);
  expect("b.mha", with(bytes, "ElementSpacing", "ElementSpacng"), said);
  marrow::files::VolumeReading reading;
  reading.voxel_size_mm = {1, 2, 3};
  EXPECT_EQ(marrow::files::read_volume_file(folder / "b.mha", reading).grid.spacing_mm, Eigen::Vector3d(1, 2, 3));
  put(folder / "b.mha", with(bytes, "ElementSpacing", "ElementSize"));
  EXPECT_EQ(itk_meta_spacing(folder / "b.mha"), (std::vector<double>{0.5, 0.75, 1.25}));
  EXPECT_EQ(volume_at(folder / "b.mha").grid.spacing_mm, Eigen::Vector3d(0.5, 0.75, 1.25));
}

TEST_F(Hostile, MetaImageOfOtherUnitsAndOfFourDimensions) {
  const std::string bytes = good("a.mha");
  for (const char* unit : {"cm", "um", "inch"})
    expect("b.mha", with(bytes, "DimSize", "DistanceUnits = " + std::string(unit) + "\nDimSize"),
           "expected mm: save it with its lengths in mm");
  put(folder / "b.mha", with(bytes, "DimSize", "DistanceUnits = mm\nDimSize"));
  EXPECT_EQ(volume_at(folder / "b.mha").grid.size[0], 8);
  std::string four = without_line(without_line(without_line(bytes, "Offset"), "CenterOfRotation"), "ElementSpacing");
  four = with(with(four, "NDims = 3", "NDims = 4"), "DimSize = 8 6 5", "ElementSpacing = 1 1 1 1\nDimSize = 8 6 5 1");
  const auto turned = [&](const std::string& axes) {
    return with(without_line(four, "TransformMatrix"), "NDims", "TransformMatrix = " + axes + "\nNDims");
  };
  put(folder / "b.mha", turned("0 1 0 0 -1 0 0 0 0 0 1 0 0 0 0 1"));
  EXPECT_EQ(volume_at(folder / "b.mha").grid.direction.col(0), Eigen::Vector3d(0, 1, 0));
  EXPECT_EQ(volume_at(folder / "b.mha").grid.direction.col(1), Eigen::Vector3d(-1, 0, 0));
  expect("b.mha", turned("0 1 0 2 -1 0 0 0 0 0 1 0 0 0 0 1"),
         "expected zeros between the axes of the volume and others");
}

TEST_F(Hostile, NrrdThatDoesNotSayHowLargeVoxelsAre) {
  const std::string bytes = good("a.nrrd"),
                    bare =
                        without_line(without_line(without_line(bytes, "space:"), "space directions"), "space origin");
  const auto adds = [&](const std::string& to, const std::string& lines) {
    return with(to, "\nendian", "\n" + lines + "endian");
  };
  expect("b.nrrd", bare, "does not say how large its voxels are; add 'spacings: X Y Z' (mm) to it");
  expect("b.nrrd", adds(bare, "axis mins: 0 0 0\naxis maxs: 8 6 5\n"), "gives the ends of its axes but no 'spacings'");
  const std::string spaced = adds(bare, "spacings: 1 2 3\n");
  put(folder / "b.nrrd", spaced);
  EXPECT_EQ(volume_at(folder / "b.nrrd").grid.spacing_mm, Eigen::Vector3d(1, 2, 3));
  for (const char* line : {"space: RAS\n", "space origin: (1,2,3)\n", "space dimension: 3\n"})
    expect("b.nrrd", adds(spaced, line), "but no 'space directions', which say how its axes lie there; add");
  put(folder / "b.nrrd", adds(spaced, "axis mins: 0 0 0\naxis maxs: 8 12 15\ncontent: any\nthicknesses: 9 9 9\n"));
  EXPECT_EQ(volume_at(folder / "b.nrrd").grid.origin_mm, Eigen::Vector3d(0.5, 1, 1.5));
  expect("b.nrrd", adds(spaced, "axis mins: 0 0 0\naxis maxs: 8 12 16\n"), "'axis maxs'");
}

TEST_F(Hostile, NrrdThatSaysTwiceHowLargeVoxelsAre) {
  const std::string bytes = good("a.nrrd");  // of voxels of 1 mm
  const auto spaced = [&](const std::string& value) {
    return with(bytes, "\nendian", "\nspacings: " + value + "\nendian");
  };
  for (const char* value : {"1 1 2", "1 x 1", "1 1 1 1", "1 1 0"})
    expect("b.nrrd", spaced(value), "expected the lengths of the 'space directions' (or take 'spacings' out)");
  for (const char* value : {"1 1 1", "nan NaN nan", "1.0005 1 1"}) {
    put(folder / "b.nrrd", spaced(value));
    EXPECT_EQ(volume_at(folder / "b.nrrd").grid.spacing_mm, Eigen::Vector3d::Ones()) << value;
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

TEST_F(Hostile, NiftiInOtherUnitsLiesWhereItSays) {
  ItkGrid<std::int16_t> grid = stack();
  for (const auto& [unit, scale] : {std::pair{1, 1e3}, std::pair{3, 1e-3}}) {
    grid.spacing = {0.5 / scale, 0.75 / scale, 1.25 / scale};
    grid.origin = {10 / scale, 20 / scale, 30 / scale};
    write_itk(folder / "a.nii", grid);
    const std::string bytes = replaced(bytes_of(folder / "a.nii"), 123, std::string(1, char(unit)));
    for (const bool by_sform : {true, false}) {
      put(folder / "b.nii", replaced(bytes, by_sform ? 252 : 254, number<std::int16_t>(0)));
      const marrow::Grid read = volume_at(folder / "b.nii").grid;
      EXPECT_LT((read.spacing_mm - Eigen::Vector3d(0.5, 0.75, 1.25)).norm(), 1e-6) << unit;
      EXPECT_LT((read.origin_mm - Eigen::Vector3d(10, 20, 30)).norm(), 1e-5) << unit;
    }
  }
}

TEST_F(Hostile, NiftiThatDoesNotSayWhichSideIsLeft) {
  expect("b.nii", replaced(replaced(good("a.nii"), 252, number<std::int16_t>(0)), 254, number<std::int16_t>(0)),
         "does not say which axis is left or right, front or back, up or down (qform_code and sform_code are 0)");
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

TEST_F(Hostile, NiftiThatSaysTwiceHowLargeVoxelsAre) {
  const std::string bytes = replaced(good("a.nii"), 252, number<std::int16_t>(0));  // by its sform
  expect("b.nii", replaced(bytes, 88, number(1.5f)),
         "says twice how large a voxel is along axis 3: 1.000000 mm by its sform, 1.500000 mm by its pixdim");
  put(folder / "b.nii", replaced(bytes, 88, number(1.0005f)));
  EXPECT_EQ(volume_at(folder / "b.nii").grid.spacing_mm[2], 1);
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

std::string tiff_entry(int tag, int type, std::uint32_t count, std::uint32_t value) {
  return number(std::uint16_t(tag)) + number(std::uint16_t(type)) + number(count) + number(value);
}

std::string tiff_directory(std::uint32_t next) {
  return number<std::uint16_t>(8) + tiff_entry(256, 4, 1, 2) + tiff_entry(257, 4, 1, 2) + tiff_entry(258, 4, 1, 8) +
         tiff_entry(259, 4, 1, 1) + tiff_entry(262, 4, 1, 1) + tiff_entry(273, 4, 1, 4) + tiff_entry(278, 4, 1, 2) +
         tiff_entry(279, 4, 1, 4) + number(next);
}

TEST_F(Hostile, TiffWhoseZeroIsWhite) {
  const std::string start = "II" + number<std::uint16_t>(42) + number<std::uint32_t>(8);  // 4 pixels are the 8
  const std::uint32_t page = std::uint32_t(tiff_directory(0).size());
  const auto white = [&](std::string bytes) {
    for (const std::size_t at : {bytes.find(tiff_entry(262, 4, 1, 1)), bytes.rfind(tiff_entry(262, 4, 1, 1))})
      bytes.replace(at, 12, tiff_entry(262, 4, 1, 0));
    return bytes;
  };
  put(folder / "a.tif", start + white(tiff_directory(8 + page) + tiff_directory(0)));
  const auto values = volume_at(folder / "a.tif").values;
  EXPECT_EQ(values, (std::vector<float>{247, 255, 255, 255, 247, 255, 255, 255}));
  std::string with_sign = white(tiff_directory(8 + page) + tiff_directory(0));  // SampleFormat instead of RowsPerStrip
  for (std::size_t at; (at = with_sign.find(tiff_entry(278, 4, 1, 2))) != std::string::npos;)
    with_sign.replace(at, 12, tiff_entry(339, 4, 1, 2));
  expect("a.tif", start + with_sign, "its zero is white (PhotometricInterpretation WhiteIsZero)");
}

TEST_F(Hostile, TiffOfImageJWhosePagesAreNoSlices) {
  const std::uint32_t page = std::uint32_t(tiff_directory(0).size());
  const auto stack = [&](const std::string& description) {
    std::string bytes = "II" + number<std::uint16_t>(42) + number<std::uint32_t>(8) + tiff_directory(8 + page);
    bytes += tiff_directory(0);
    const std::size_t at = bytes.find(tiff_entry(278, 4, 1, 2));  // the default does too
    return bytes.replace(at, 12, tiff_entry(270, 2, std::uint32_t(description.size()), 8 + 2 * page)) + description;
  };
  put(folder / "a.tif", stack("ImageJ=1.54f\nimages=2\nslices=2\nchannels=1\n"));
  EXPECT_EQ(volume_at(folder / "a.tif").grid.size, (std::array<int, 3>{2, 2, 2}));
  expect("a.tif", stack("ImageJ=1.54f\nimages=2\nchannels=2\n"), "is an ImageJ stack of 2 channels");
  expect("a.tif", stack("ImageJ=1.54f\nimages=2\nframes=2\n"), "is an ImageJ stack of 2 frames");
  expect("a.tif", stack("<?xml?><OME><Image><Pixels SizeX=\"2\" SizeZ=\"1\" SizeC=\"2\" SizeT=\"1\"/></Image></OME>"),
         "is an OME stack of 2 channels, whose pages are not slices of one volume");
  expect("a.tif", stack("<OME><Pixels SizeC=\"1\" SizeT=\"2\"/></OME>"), "is an OME stack of 2 times");
  expect("a.tif", stack("{\"shape\": [2, 1, 2, 2, 2]}"), "is an array of 4 dimensions, [2, 1, 2, 2, 2]");
  expect("a.tif", stack("{\"axes\": \"TZYX\", \"shape\": [2, 2, 2, 2]}"), "is an array of 4 dimensions, [2, 2, 2, 2]");
  expect("a.tif", stack("{\"shape\": [2, 2, 2], \"axes\": \"TYX\"}"), "is a stack of times");
  expect("a.tif", stack("{\"shape\": [2, 2, 2], \"truncated\": true}"), "its first page stands for several");
  for (const char* slices :
       {"{\"shape\": [2, 2, 2]}", "{\"shape\": [1, 2, 2, 2], \"axes\": \"TZYX\"}",
        "{\"shape\": [2, 2, 2], \"axes\": \"ZYX\"}", "<OME><Pixels SizeC=\"1\" SizeT=\"1\"/></OME>"}) {
    put(folder / "a.tif", stack(slices));
    EXPECT_EQ(volume_at(folder / "a.tif").grid.size, (std::array<int, 3>{2, 2, 2})) << slices;
  }
}

TEST_F(Hostile, TiffFieldsOfKindsThatAreNotRead) {
  std::string bytes = "II" + number<std::uint16_t>(42) + number<std::uint32_t>(8) + tiff_directory(0);
  const std::size_t at = bytes.find(tiff_entry(278, 4, 1, 2));
  expect("a.tif", bytes.replace(at, 12, tiff_entry(339, 8, 1, 2)),
         "its field 339 has no number of a kind that is read");
}

TEST_F(Hostile, TiffWhosePagesRunInACircle) {
  const std::string start = "II" + number<std::uint16_t>(42) + number<std::uint32_t>(8);
  const std::uint32_t page = std::uint32_t(tiff_directory(0).size());
  put(folder / "a.tif", start + tiff_directory(8 + page) + tiff_directory(0));
  EXPECT_EQ(volume_at(folder / "a.tif").grid.size, (std::array<int, 3>{2, 2, 2}));
  expect("a.tif", start + tiff_directory(8), "its pages run in a circle");
  expect("a.tif", start + tiff_directory(8 + page) + tiff_directory(8), "its pages run in a circle");
}

// 5000 entries a page, all of whose values are the same 60000 bytes.
TEST_F(Hostile, TiffWhosePagesShareTheirBytes) {
  std::string bytes = "II" + number<std::uint16_t>(42) + number<std::uint32_t>(60008) + std::string(60000, '\1');
  for (std::uint32_t pages = 0; pages < 100; ++pages) {
    bytes += number<std::uint16_t>(40) + tiff_entry(256, 4, 1, 2) + tiff_entry(257, 4, 1, 2);
    for (int i = 0; i < 38; ++i) bytes += tiff_entry(278, 3, 30000, 8);
    bytes += number(pages == 99 ? 0u : std::uint32_t(bytes.size() + 4));
  }
  expect("a.tif", bytes, "its pages lie over each other");
}

}  // namespace
