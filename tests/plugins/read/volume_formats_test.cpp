// SPDX-License-Identifier: Apache-2.0
// MetaImage and NRRD files, whose headers are texts: fields, sizes of voxels, units and spaces.
// NIfTI files: headers that lie, or say twice where the volume lies (by an sform and by a qform); and NIfTI-2.
#include <zlib.h>

#include "marrow/toolbox/files/volume_file.hpp"
#include "tests/plugins/read/damage.hpp"
#include "tests/plugins/read/itk_files.hpp"

namespace volume_formats_test {

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

class Nifti : public InAFolder {
 protected:
  Volume of(const std::string& bytes) {
    put(folder / "b.nii", bytes);
    return files::read_volume_file(folder / "b.nii", {});
  }
  Grid grid_of(const std::string& bytes) { return of(bytes).grid; }
  void expect_refused(const std::string& bytes, const std::string& text) { EXPECT_REFUSED(of(bytes), "b.nii", text); }
};

std::string good() { return itk_bytes(".nii", ramp<std::int16_t>({8, 6, 5}, 13, -1000)); }
std::string short_at(std::string bytes, std::size_t at, int value) {
  return replaced(std::move(bytes), at, number(std::int16_t(value)));
}
std::string float_at(std::string bytes, std::size_t at, float value) {
  return replaced(std::move(bytes), at, number(value));
}

TEST_F(Nifti, FieldsThatLie) {
  const std::string bytes = good();
  expect_refused(short_at(bytes, 70, 16),
                 "says that samples are of type 16, which have 32 bits, and that they have 16 bits");
  expect_refused(short_at(bytes, 72, 8), "type 4, which have 16 bits, and that they have 8 bits");
  expect_refused(short_at(bytes, 70, 1536), "of type 1536, which is not read");
  expect_refused(short_at(bytes, 70, 32), "of type 32, which is not read");
  for (const float place : {std::nanf(""), HUGE_VALF, -1.f, 0.f, 352.5f, 1e30f})
    expect_refused(float_at(bytes, 108, place), "samples begin at byte");
  expect_refused(float_at(bytes, 80, std::nanf("")), "is not a positive length");
  expect_refused(float_at(bytes, 80, -1), "is not a positive length");
  expect_refused(float_at(bytes, 112, HUGE_VALF), "scales samples by a number that is not finite");
  expect_refused(short_at(bytes, 42, -8), "gives a size of -8");
  expect_refused(short_at(bytes, 40, 9), "tells of 9 dimensions");
  expect_refused(short_at(bytes, 46, 6), "is cut off or damaged: 576 bytes of samples expected, got 480");
  expect_refused(replaced(bytes, 344, "ni1"), "is not a NIfTI file with its samples in it");
}

TEST_F(Nifti, SaysWhereItLies) {
  const std::string no_sform = short_at(good(), 254, 0), no_qform = short_at(good(), 252, 0);
  EXPECT_LT((grid_of(no_sform).direction - Matrix3d::Identity()).norm(), 1e-6) << "by its quaternion";
  expect_refused(float_at(no_qform, 284, 0.5f), "by a matrix that is sheared or damaged");
  expect_refused(short_at(no_qform, 254, 0),
                 "does not say which axis is left or right, front or back, up or down (qform_code and sform_code are "
                 "0)");
  expect_refused(float_at(no_qform, 88, 1.5f),
                 "says twice how large a voxel is along axis 3: 1.000000 mm by its sform, 1.500000 mm by its pixdim");
  EXPECT_EQ(grid_of(float_at(no_qform, 88, 1.0005f)).spacing_mm[2], 1);
}

TEST_F(Nifti, ABombIsRefusedBeforeItIsUnpacked) {
  std::string header = short_at(short_at(good().substr(0, 352), 70, 2), 72, 8);
  for (const std::size_t at : {42, 44, 46}) header = short_at(header, at, 400);
  const gzFile file = gzopen((folder / "bomb.nii.gz").c_str(), "wb9");
  gzwrite(file, header.data(), unsigned(header.size()));
  const std::vector<char> zeros(1 << 20);
  for (int i = 0; i < 62; ++i) gzwrite(file, zeros.data(), unsigned(zeros.size()));
  gzclose(file);
  ASSERT_LT(std::filesystem::file_size(folder / "bomb.nii.gz"), 70000u);
  EXPECT_REFUSED(files::read_volume_file(folder / "bomb.nii.gz", {}), "bomb.nii.gz",
                 "its header claims 400 x 400 x 400 samples, but the file has only");
}

TEST_F(Nifti, InOtherUnitsLiesWhereItSays) {
  ItkGrid<std::int16_t> grid = ramp<std::int16_t>({8, 6, 5}, 13, -1000);
  for (const auto& [unit, scale] : {std::pair{1, 1e3}, std::pair{3, 1e-3}}) {
    grid.spacing = {0.5 / scale, 0.75 / scale, 1.25 / scale};
    grid.origin = {10 / scale, 20 / scale, 30 / scale};
    const std::string bytes = replaced(itk_bytes(".nii", grid), 123, std::string(1, char(unit)));
    for (const std::size_t missing : {252, 254}) {
      const Grid read = grid_of(short_at(bytes, missing, 0));
      EXPECT_LT((read.spacing_mm - Vector3d(0.5, 0.75, 1.25)).norm(), 1e-6) << unit;
      EXPECT_LT((read.origin_mm - Vector3d(10, 20, 30)).norm(), 1e-5) << unit;
    }
  }
}

class TwoPlaces : public Nifti {
 protected:
  std::string with_codes(int sform, int qform) const {
    static const std::string plain = itk_bytes(".nii", filled<std::int16_t>({4, 5, 30}, 0));
    return short_at(short_at(plain, 254, sform), 252, qform);
  }
};

/// Where an element of the sform lies in the header.
std::size_t place(std::size_t row, std::size_t column) { return 280 + 16 * row + 4 * column; }

// A CT of a tilted gantry: the qform cannot say it, and the last slice would lie tens of millimetres off.
TEST_F(TwoPlaces, ShearedOrDamagedSformIsNotThrownAway) {
  const float z = std::sqrt(1 - 0.26f * 0.26f);  // the third column stays 1 mm long
  for (const auto& [sform, qform] : {std::pair{1, 1}, {1, 2}, {2, 2}, {3, 1}})
    expect_refused(float_at(float_at(with_codes(sform, qform), place(1, 2), 0.26f), place(2, 2), z),
                   "do not agree: the sform is a matrix that is sheared");
  const std::string rounded = float_at(with_codes(1, 1), place(0, 2), 0.0006f);  // 0.017 mm at the last slice
  EXPECT_TRUE(grid_of(rounded).direction.isIdentity(1e-6));
  const std::string other_scan = float_at(with_codes(2, 1), place(1, 2), 0.26f);
  EXPECT_TRUE(grid_of(other_scan).direction.isIdentity(1e-6));  // decided: then the qform is this scan's
  for (const int sform : {1, 2}) {
    const std::string bytes = with_codes(sform, 1);
    expect_refused(float_at(bytes, place(0, 1), std::nanf("")), "sheared (as of a CT with a tilted gantry) or damaged");
    expect_refused(float_at(bytes, place(0, 3), HUGE_VALF), "or damaged");
    expect_refused(float_at(bytes, place(2, 2), 0), "or damaged");
  }
}

TEST_F(TwoPlaces, SformBesideTheQform) {
  const auto moved = [&](int sform, int qform) { return float_at(with_codes(sform, qform), place(2, 3), 25); };
  EXPECT_EQ(grid_of(moved(1, 1)).origin_mm[2], 25);  // the scanner's own
  EXPECT_EQ(grid_of(moved(2, 1)).origin_mm[2], 0);
  for (const auto& [sform, qform] : {std::pair{2, 2}, {3, 1}, {4, 1}, {4, 4}})
    expect_refused(moved(sform, qform), "its sform (code " + std::to_string(sform) + ") and its qform (code " +
                                            std::to_string(qform) + ") put the same voxels to different places");
  EXPECT_FLOAT_EQ(float(grid_of(float_at(with_codes(3, 1), place(2, 3), 0.001f)).origin_mm[2]), 0.001f);
}

// nibabel refuses such a quaternion, too, if its squared length is 1 + 3.6e-7 or more. Scaled to 1 it would be another
// turn.
TEST_F(TwoPlaces, QuaternionLongerThanARotationHas) {
  const auto turned = [&](float b, float c, float d) {
    return replaced(with_codes(0, 1), 256, number(b) + number(c) + number(d));
  };
  expect_refused(turned(1.32f, 0, 0),
                 "the quaternion (b, c, d) of its qform has the length 1.32, but that of a rotation is at most 1; it "
                 "is damaged, or was written wrongly: export it again, or set qform_code to 0 if its sform is right");
  expect_refused(turned(0.6f, 0.6f, 0.6f), "has the length 1.03923");
  expect_refused(turned(0.71f, 0.71f, 0), "has the length 1.00409");
  // A half turn about x, with float's rounding: RAS (x, -y, -z), so LPS has the other signs of x and y.
  const Matrix3d half = Vector3d(-1, 1, -1).asDiagonal();
  for (const float b : {1.f, 1.000001f}) EXPECT_TRUE(grid_of(turned(b, 0, 0)).direction.isApprox(half, 1e-6)) << b;
  EXPECT_TRUE(grid_of(float_at(with_codes(1, 1), 256, 1.32f)).direction.isIdentity(1e-6))
      << "the sform of the scanner is used, so it does not matter";
  expect_refused(replaced(with_codes(2, 1), 256, number(1.32f) + number(0.f) + number(0.f)), "has the length 1.32");
}

/// A header of NIfTI-2 by https://nifti.nimh.nih.gov/pub/dist/doc/nifti2.h, whose numbers are wider: 540 bytes, then
/// four that name no extensions.
std::string nifti2(bool big_endian, int sform, int qform) {
  std::string file(544, '\0');
  const auto set = [&](std::size_t at, auto value) {
    std::string bytes = number(value);
    if (big_endian) std::reverse(bytes.begin(), bytes.end());
    file.replace(at, bytes.size(), bytes);
  };
  set(0, std::int32_t(540));
  file.replace(4, 8, std::string("n+2\0\r\n\x1A\n", 8));
  set(12, std::int16_t(4)), set(14, std::int16_t(16));
  const std::int64_t sizes[] = {3, 4, 3, 2};
  const double lengths[] = {1, 0.5, 0.75, 1.25}, origin[] = {10, 20, 30};
  for (std::size_t k = 0; k < 4; ++k) set(16 + 8 * k, sizes[k]), set(104 + 8 * k, lengths[k]);
  set(168, std::int64_t(544));
  set(176, 2.0), set(184, -1024.0);
  set(344, std::int32_t(qform)), set(348, std::int32_t(sform));
  for (std::size_t k = 0; k < 3; ++k) {
    set(376 + 8 * k, origin[k]);
    set(400 + 40 * k, lengths[k + 1]), set(424 + 32 * k, origin[k]);  // the rows of the sform
  }
  set(500, std::int32_t(2));
  for (std::size_t i = 0; i < 24; ++i) set(544 + 2 * i, std::int16_t(i * 13));
  return file;
}

TEST_F(Nifti, SecondVersionIsReadAsTheFirst) {
  for (const bool big_endian : {false, true})
    for (const auto& [sform, qform] : {std::pair{1, 0}, {0, 1}, {1, 1}}) {
      const Volume volume = of(nifti2(big_endian, sform, qform));
      EXPECT_EQ(volume.grid.size, (std::array<int, 3>{4, 3, 2}));
      EXPECT_EQ(volume.grid.spacing_mm, Vector3d(0.5, 0.75, 1.25));
      // RAS becomes LPS; the axes are then left-handed only if an odd number of them turns, and two do.
      EXPECT_EQ(volume.grid.origin_mm, Vector3d(-10, -20, 30));
      EXPECT_EQ(volume.grid.direction, Matrix3d(Vector3d(-1, -1, 1).asDiagonal()));
      EXPECT_EQ(volume.at(3, 2, 1), 2 * 23 * 13 - 1024);
    }
  const gzFile packed = gzopen((folder / "c.nii.gz").c_str(), "wb");
  const std::string bytes = nifti2(false, 1, 0);
  gzwrite(packed, bytes.data(), unsigned(bytes.size()));
  gzclose(packed);
  EXPECT_EQ(files::read_volume_file(folder / "c.nii.gz", {}).at(3, 2, 1), 2 * 23 * 13 - 1024);
}

TEST_F(Nifti, FaultsOfTheSecondVersionAreThoseOfTheFirst) {
  const std::string bytes = nifti2(false, 1, 0);
  expect_refused(replaced(bytes, 4, "ni2"), "is not a NIfTI file with its samples in it");
  expect_refused(replaced(bytes, 8, "\n\n"), "is not a NIfTI file with its samples in it, or is damaged at its start");
  expect_refused(replaced(bytes, 168, number(std::int64_t(352))), "samples begin at byte 352.000000");
  expect_refused(replaced(bytes, 16, number(std::int64_t(9))), "tells of 9 dimensions");
  expect_refused(replaced(bytes, 24, number(std::int64_t(1) << 40)), "gives a size of 1099511627776");
  expect_refused(replaced(nifti2(false, 0, 1), 352, number(1.32)), "has the length 1.32");
  expect_refused(bytes.substr(0, 500), "is not a NIfTI file");
}

}  // namespace volume_formats_test
