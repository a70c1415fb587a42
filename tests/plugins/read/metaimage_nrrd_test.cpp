// SPDX-License-Identifier: Apache-2.0
// MetaImage and NRRD files, whose headers are texts: fields, sizes of voxels, units and spaces.
#include "marrow/toolbox/files/volume_file.hpp"
#include "tests/plugins/read/damage.hpp"
#include "tests/plugins/read/itk_files.hpp"

namespace metaimage_nrrd_test {

using namespace marrow;
using namespace marrow::test;
using Eigen::Vector3d, Eigen::Matrix3d;

Volume read(const std::filesystem::path& path) { return files::read_volume_file(path, {}); }

/// A good file of this ending, with voxels of 1 mm.
std::string good(const std::string& extension) {
  return itk_bytes(extension, ramp<std::int16_t>({8, 6, 5}, 13, -1000));
}

/// `text` without the lines that begin with these words.
std::string without_lines(std::string text, const std::vector<std::string>& starts) {
  for (const std::string& start : starts) {
    const std::size_t at = text.find("\n" + start);
    EXPECT_NE(at, std::string::npos) << start;
    if (at != std::string::npos) text.erase(at, text.find('\n', at + 1) - at);
  }
  return text;
}

class TextHeader : public InAFolder {
 protected:
  Volume of(const std::string& name, const std::string& bytes) {
    put(folder / name, bytes);
    return read(folder / name);
  }
  Grid grid_of(const std::string& name, const std::string& bytes) { return of(name, bytes).grid; }
  void expect(const std::string& name, const std::string& good, const std::vector<Fault>& faults) {
    expect_faults(folder / name, good, faults, [](const auto& path) { read(path); });
  }
};

using MetaImage = TextHeader;
using Nrrd = TextHeader;

TEST_F(MetaImage, FieldsAreReadStrictly) {
  const std::string bytes = good(".mha"), size = "DimSize = 8 6 5";
  expect("b.mha", bytes,
         {{size, size + "\n" + size, "gives 'dimsize' twice"},
          {size, "DimSize = 8 6 5.5", "expected whole numbers"},
          {size, "DimSize = 8 6 7e60", "expected whole numbers"},
          {"MET_SHORT", "MET_STRING", "expected a kind of number"},
          {"BinaryData = True", "BinaryData = False", "written as text, which is not read"},
          {"BinaryData = True", "BinaryData = perhaps", "expected True or False"},
          {size, "DistanceUnits = cm\n" + size, "expected mm: save it with its lengths in mm"},
          {size, "DistanceUnits = um\n" + size, "expected mm: save it with its lengths in mm"},
          {size, "DistanceUnits = inch\n" + size, "expected mm: save it with its lengths in mm"}});
  EXPECT_EQ(grid_of("b.mha", with(bytes, size, "DistanceUnits = mm\n" + size)).size[0], 8);
  const std::string odd = with(with(bytes, "DimSize", "dimsize"), "ElementDataFile", "# a remark\nELEMENTDATAFILE");
  EXPECT_EQ(of("b.mha", odd).values[9], 9 * 13 - 1000);
}

TEST_F(MetaImage, ThatDoesNotSayHowLargeVoxelsAre) {
  ItkGrid<std::int16_t> grid = ramp<std::int16_t>({8, 6, 5}, 13, -1000);
  grid.spacing = {0.5, 0.75, 1.25};
  const std::string bytes = itk_bytes(".mha", grid);
  const std::string said =
      "its header does not say how large its voxels are; add 'ElementSpacing = X Y Z' (mm) to it, or give "
      "voxel_size_mm";
  expect("b.mha", bytes,
         {{"", without_lines(bytes, {"ElementSpacing"}), said}, {"ElementSpacing", "ElementSpacng", said}});
  put(folder / "b.mha", without_lines(bytes, {"ElementSpacing"}));
  files::VolumeReading reading;
  reading.voxel_size_mm = {1, 2, 3};
  EXPECT_EQ(files::read_volume_file(folder / "b.mha", reading).grid.spacing_mm, Vector3d(1, 2, 3));
  put(folder / "b.mha", with(bytes, "ElementSpacing", "ElementSize"));
  EXPECT_EQ(itk_meta_spacing(folder / "b.mha"), (std::vector<double>{0.5, 0.75, 1.25}));
  EXPECT_EQ(read(folder / "b.mha").grid.spacing_mm, Vector3d(0.5, 0.75, 1.25));
}

TEST_F(MetaImage, OfFourDimensions) {
  std::string four = without_lines(good(".mha"), {"Offset", "CenterOfRotation", "ElementSpacing", "TransformMatrix"});
  four = with(four, "DimSize = 8 6 5", "ElementSpacing = 1 1 1 1\nDimSize = 8 6 5 1");
  four = with(four, "NDims = 3", "TransformMatrix = 0 1 0 0 -1 0 0 0 0 0 1 0 0 0 0 1\nNDims = 4");
  const Matrix3d direction = grid_of("b.mha", four).direction;
  EXPECT_EQ(direction.col(0), Vector3d(0, 1, 0));
  EXPECT_EQ(direction.col(1), Vector3d(-1, 0, 0));
  expect("b.mha", four, {{"= 0 1 0 0", "= 0 1 0 2", "expected zeros between the axes of the volume and others"}});
}

TEST_F(Nrrd, FieldsAreReadStrictly) {
  const std::string bytes = good(".nrrd"), size = "sizes: 8 6 5", raw = "encoding: raw";
  expect("b.nrrd", bytes,
         {{"space origin: (0,0,0)", "space origin: (0" + std::string(2000, '7') + ",0,0)", "'space origin'"},
          {"kinds: domain", "kinds: " + std::string(2000, 'k') + " domain", "'kinds'"},
          {"endian: little", "endian: little\nendian: little", "gives 'endian' twice"},
          {"endian: little", "ending: little", ": expected a field of a NRRD header, got 'ending: little'"},
          {raw, "encoding: hex", "expected raw or gzip"},
          {size, "sizes: 8 6", "expected 3 numbers"},
          {size, "sizes: 8 6 nan", "expected 3 numbers"},
          {"left-posterior-superior", "scanner-xyz", "expected left-posterior-superior"},
          {raw, "space units: \"um\" \"um\" \"um\"\n" + raw, "expected mm"},
          {"", bytes.substr(0, 8) + "\n" + std::string(70000, 'x'), "is longer than"}});
}

TEST_F(Nrrd, OfOtherSpacesIsTurnedToLps) {
  const std::string moved = with(good(".nrrd"), "space origin: (0,0,0)", "space origin: (1,2,3)");
  const std::string ras = with(moved, "left-posterior-superior", "right-anterior-superior");
  EXPECT_EQ(grid_of("b.nrrd", ras).origin_mm, Vector3d(-1, -2, 3));
  const Grid las = grid_of("b.nrrd", with(with(moved, "left-posterior-superior", "LAS"), "(0,1,0)", "(0,-1,0)"));
  EXPECT_EQ(las.origin_mm, Vector3d(1, -2, 3));
  EXPECT_TRUE(las.direction.isIdentity(0));
}

TEST_F(Nrrd, ThatDoesNotSayHowLargeVoxelsAre) {
  const std::string bare = without_lines(good(".nrrd"), {"space:", "space directions", "space origin"}),
                    spaced = with(bare, "\nendian", "\nspacings: 1 2 3\nendian"),
                    no_directions = "but no 'space directions', which say how its axes lie there; add";
  EXPECT_EQ(grid_of("b.nrrd", spaced).spacing_mm, Vector3d(1, 2, 3));
  const auto adding = [](const std::string& lines) { return "\n" + lines + "\nendian"; };
  expect("b.nrrd", spaced,
         {{"spacings: 1 2 3\n", "", "does not say how large its voxels are; add 'spacings: X Y Z' (mm) to it"},
          {"spacings: 1 2 3", "axis mins: 0 0 0\naxis maxs: 8 6 5", "gives the ends of its axes but no 'spacings'"},
          {"\nendian", adding("space: RAS"), no_directions},
          {"\nendian", adding("space origin: (1,2,3)"), no_directions},
          {"\nendian", adding("space dimension: 3"), no_directions},
          {"\nendian", adding("axis mins: 0 0 0\naxis maxs: 8 12 16"), "'axis maxs'"}});
  const std::string ends = adding("axis mins: 0 0 0\naxis maxs: 8 12 15\ncontent: any\nthicknesses: 9 9 9");
  EXPECT_EQ(grid_of("b.nrrd", with(spaced, "\nendian", ends)).origin_mm, Vector3d(0.5, 1, 1.5));
}

TEST_F(Nrrd, ThatSaysTwiceHowLargeVoxelsAre) {
  std::vector<Fault> faults;
  for (const char* value : {"1 1 2", "1 x 1", "1 1 1 1", "1 1 0"})
    faults.push_back({"\nendian", std::string("\nspacings: ") + value + "\nendian",
                      "expected the lengths of the 'space directions' (or take 'spacings' out)"});
  expect("b.nrrd", good(".nrrd"), faults);
  for (const std::string value : {"1 1 1", "nan NaN nan", "1.0005 1 1"}) {
    const std::string bytes = with(good(".nrrd"), "\nendian", "\nspacings: " + value + "\nendian");
    EXPECT_EQ(grid_of("b.nrrd", bytes).spacing_mm, Vector3d::Ones()) << value;
  }
}

// The ends of an axis of cells are the borders of its voxels, of nodes their centres.
TEST_F(Nrrd, CentersAreOfEachAxis) {
  const auto grid_with = [&](const std::string& fields) {
    return grid_of("a.nrrd",
                   "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 5 4 3\nencoding: raw\nspacings: 0.5 0.5 1\n"
                   "axis mins: 0 0 0\n" +
                       fields + "\n" + std::string(60, '\7'));
  };
  EXPECT_EQ(grid_with("").origin_mm, Vector3d(0.25, 0.25, 0.5));
  EXPECT_EQ(grid_with("centers: node node node\n").origin_mm, Vector3d(0, 0, 0));
  EXPECT_EQ(grid_with("centers: cell cell node\n").origin_mm, Vector3d(0.25, 0.25, 0));
  EXPECT_EQ(grid_with("axis maxs: 2 2 3\ncenters: node cell none\n").origin_mm, Vector3d(0, 0.25, 0.5));
  EXPECT_SAYS(grid_with("axis maxs: 2.5 2 3\ncenters: node cell none\n"), "axis maxs");
  for (const std::string wrong : {"node", "node node", "cell cell cell node", "cell cell middle"})
    EXPECT_SAYS(grid_with("centers: " + wrong + "\n"), "expected one of cell, node and none for each of the axes");
}

// The first file is what ITK writes for an image of vectors with one component; a value axis of one sample changes
// nothing in the order of the samples.
TEST_F(Nrrd, AxesOfOneValueAreNoneOfTheVolume) {
  std::string samples;
  for (char i = 0; i < 60; ++i) samples += i;
  const auto volume_with = [&](const std::string& fields) {
    return of("b.nrrd", "NRRD0004\ntype: uchar\nencoding: raw\n" + fields + "\n\n" + samples);
  };
  const std::string space =
      "\nspace: left-posterior-superior\nspace origin: (1,2,3)\nspace directions: none (0.5,0,0) (0,2,0) (0,0,3)";
  for (const std::string& fields :
       {"dimension: 4\nsizes: 1 5 4 3\nkinds: vector domain domain domain" + space,
        "dimension: 4\nsizes: 1 5 4 3\nkinds: list domain domain domain\nunits: \"\" \"mm\" \"mm\" \"mm\"" + space,
        "dimension: 4\nsizes: 1 5 4 3" + space, "dimension: 5\nsizes: 1 5 4 3 1" + space + " none",
        std::string("dimension: 4\nsizes: 5 4 3 1\nspacings: 0.5 2 3 nan\naxis mins: 0.75 1 1.5 nan")}) {
    const Volume volume = volume_with(fields);
    EXPECT_EQ(volume.grid.size, (std::array<int, 3>{5, 4, 3})) << fields;
    EXPECT_EQ(volume.grid.spacing_mm, Vector3d(0.5, 2, 3)) << fields;
    EXPECT_EQ(volume.grid.origin_mm, Vector3d(1, 2, 3)) << fields;
    EXPECT_EQ(volume.at(4, 1, 2), 49) << fields;
  }
  EXPECT_SAYS(volume_with("dimension: 4\nsizes: 3 5 4 1\nkinds: vector domain domain domain" + space),
              "has 3 values per voxel; a CT has one");
  EXPECT_SAYS(volume_with("dimension: 4\nsizes: 5 4 1 3\nspacings: 1 1 1 1"), "has 4 dimensions; expected one volume");
}

}  // namespace metaimage_nrrd_test
