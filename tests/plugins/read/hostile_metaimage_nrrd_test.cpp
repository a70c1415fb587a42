// SPDX-License-Identifier: Apache-2.0
// MetaImage and NRRD files whose headers, which are texts, lie: fields, sizes of voxels, units and spaces.
#include "tests/plugins/read/hostile_volumes.hpp"

namespace hostile_metaimage_nrrd_test {

using namespace hostile_volumes;
using namespace marrow::test;

/// `text` without the line that begins with `start`.
std::string without_line(std::string text, const std::string& start) {
  const std::size_t at = text.find("\n" + start);
  EXPECT_NE(at, std::string::npos) << start;
  return at == std::string::npos ? text : text.erase(at, text.find('\n', at + 1) - at);
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

}  // namespace hostile_metaimage_nrrd_test
