// SPDX-License-Identifier: Apache-2.0
// DICOM series through read.volume.
#include <gtest/gtest.h>

#include "tests/plugins/read/dicom_text.hpp"
#include "tests/plugins/read/files.hpp"
#include "tests/plugins/read/itk_files.hpp"
#include "tests/plugins/read/reading.hpp"

namespace dicom_test {

using marrow::test::DicomSlice;
using marrow::test::TemporaryFolder;
using marrow::test::write_dicom;

marrow::Volume read(const std::filesystem::path& path, const std::string& series_uid = "") {
  return marrow::test::read_by<marrow::Volume>("read.volume", path, {{"series_uid", series_uid}});
}

DicomSlice slice_at(double z, int base) {
  DicomSlice slice;
  slice.position = {-1, -2, z};
  for (int i = 0; i < 12; ++i) slice.values.push_back(std::int16_t(base + i));
  return slice;
}

/// Four slices at z = 10, 12, 14, 16. Their file names are in the reverse order.
void write_series(const TemporaryFolder& folder, const std::string& series = "1.2.3.4",
                  const std::string& prefix = "") {
  for (int k = 0; k < 4; ++k) {
    DicomSlice slice = slice_at(10 + 2 * k, 100 * k - 500);
    slice.series = series;
    write_dicom(folder / (prefix + "slice" + std::to_string(9 - k) + ".dcm"), slice);
  }
}

TEST(ReadDicom, SortsSlicesByPositionAndGivesHounsfieldUnits) {
  const TemporaryFolder folder;
  write_series(folder);
  marrow::test::put(folder / "README.txt", "not a slice");
  const marrow::Volume volume = read(folder.path());
  EXPECT_EQ(volume.grid.size, (std::array<int, 3>{4, 3, 4}));
  EXPECT_LT((volume.grid.origin_mm - Eigen::Vector3d(-1, -2, 10)).norm(), 1e-9);
  EXPECT_LT((volume.grid.spacing_mm - Eigen::Vector3d(0.5, 0.75, 2)).norm(), 1e-9);
  EXPECT_TRUE(volume.grid.direction.isIdentity(1e-12));
  for (int k = 0; k < 4; ++k) EXPECT_EQ(volume.at(2, 1, k), 100 * k - 500 + 6);
}

TEST(ReadDicom, CoronalSlicesKeepTheirDirections) {
  const TemporaryFolder folder;
  for (int k = 0; k < 3; ++k) {
    DicomSlice slice = slice_at(0, 10 * k);
    slice.position = {5, 1.5 * k, 7};
    slice.orientation = "1\\0\\0\\0\\0\\-1";
    write_dicom(folder / ("s" + std::to_string(k) + ".dcm"), slice);
  }
  const marrow::Volume volume = read(folder.path());
  EXPECT_LT((volume.grid.direction.col(1) - Eigen::Vector3d(0, 0, -1)).norm(), 1e-9);
  EXPECT_LT((volume.grid.direction.col(2) - Eigen::Vector3d(0, 1, 0)).norm(), 1e-9);
  EXPECT_NEAR(volume.grid.spacing_mm[2], 1.5, 1e-9);
  EXPECT_EQ(volume.at(0, 0, 2), 20);
}

TEST(ReadDicom, TwoSeriesAreListedAndOneCanBeNamed) {
  const TemporaryFolder folder;
  write_series(folder, "1.2.3.4", "a");
  write_series(folder, "1.2.3.5", "b");
  EXPECT_SAYS(read(folder.path()),
              "holds 2 series; name one with series_uid:\n    1.2.3.4 (CT, 4 slices)\n    1.2.3.5 (CT, 4 slices)");
  EXPECT_EQ(read(folder.path(), "1.2.3.5").grid.size[2], 4);
  EXPECT_SAYS(read(folder.path(), "9.9"), "holds no series 9.9; it holds:\n    1.2.3.4");
}

// If the last slice were left out, no gap would show it. So it is refused, whatever its name is.
TEST(ReadDicom, FilesThatAreNoWholeSliceAreRefused) {
  const TemporaryFolder elsewhere;
  write_dicom(elsewhere / "slice.dcm", slice_at(18, 0));
  const std::string good = marrow::test::bytes_of(elsewhere / "slice.dcm");
  for (const char* name : {"IM5", "IM5.DCM", "IM5.IMA", "im5.dcm", "IM5.img", "IM5.bak", "im5.dcm.gz"})
    for (const auto& [content, text] :
         {std::pair{std::string(), "it is empty"}, std::pair{good.substr(0, 100), "it has 100 bytes"},
          std::pair{good.substr(0, 128) + "XXXX" + good.substr(132), "it has no 'DICM' at byte 128"}}) {
      const TemporaryFolder folder;
      write_series(folder);
      marrow::test::put(folder / name, content);
      EXPECT_SAYS(read(folder.path()),
                  std::string(name) + ": this file in the series' folder is no whole DICOM file (" + text);
      marrow::test::put(folder / name, good);
      EXPECT_EQ(read(folder.path()).grid.size[2], 5) << name;
    }
}

TEST(ReadDicom, FilesThatAreNoSliceByNameArePassedOver) {
  const TemporaryFolder folder;
  write_series(folder);
  for (const char* name : {"LICENSE", "README", "notes.TXT", "Thumbs.db", ".DS_Store", "._IM5", "DICOMDIR",
                           "segmentation.nii.gz", "case.yaml", "below/report.pdf"})
    marrow::test::put(folder / name, "not a slice");
  marrow::test::put(folder / "empty.txt", "");
  EXPECT_EQ(read(folder.path()).grid.size[2], 4);
}

// Otherwise labels beside the CT would be used in its place.
TEST(ReadDicom, AVolumeOfAnotherKindBesideTheSlicesIsRefused) {
  for (const char* name : {"labels.mhd", "labels.nhdr"}) {
    const marrow::test::TemporaryFolder folder;
    write_series(folder);
    marrow::test::put(folder / name, "header");
    EXPECT_SAYS(read(folder.path()), "holds both a DICOM file ('slice");
    EXPECT_SAYS(read(folder.path()),
                std::string("and '") + name + "', which may be another volume; keep one volume per folder");
  }
}

TEST(ReadDicom, SlicesInAFolderBelowAreRefused) {
  const TemporaryFolder folder;
  write_series(folder);
  std::filesystem::create_directories(folder / "more/part");
  std::filesystem::rename(folder / "slice6.dcm", folder / "more/part/slice6.dcm");
  EXPECT_SAYS(read(folder.path()),
              "more: this folder inside the series' folder holds files that may be slices ('part/slice6.dcm')");
  marrow::test::put(folder / "more/part/slice6.dcm", "");
  EXPECT_SAYS(read(folder.path()), "('part/slice6.dcm'), and only one folder is read");
}

void put_slices(const TemporaryFolder& folder, const marrow::test::Elements& changed) {
  for (int z = 0; z < 3; ++z) {
    auto elements = marrow::test::ct_slice(z);
    for (const auto& [tag, value] : changed) elements[tag] = value;
    marrow::test::put(folder / ("s" + std::to_string(z) + ".dcm"), marrow::test::dicom_file(elements));
  }
}

TEST(ReadDicom, PixelsThatTheHeaderDoesNotTellOfAreRefused) {
  const TemporaryFolder folder;
  put_slices(folder, {});
  EXPECT_EQ(read(folder.path()).at(3, 2, 1), 11 - 1024);
  put_slices(folder, {{0x00280010, "US:2"}});
  EXPECT_SAYS(read(folder.path()),
              "s0.dcm: is cut off or damaged: its header tells of 16 bytes of pixels, but there are 24");
  put_slices(folder, {{0x00280100, "US:8"}, {0x00280101, "US:8"}, {0x00280102, "US:7"}});
  EXPECT_SAYS(read(folder.path()),
              "s0.dcm: is cut off or damaged: its header tells of 12 bytes of pixels, but there are 24");
  const marrow::test::Elements odd{
      {0x00280100, "US:8"}, {0x00280101, "US:8"}, {0x00280102, "US:7"}, {0x00280011, "US:3"}};
  auto filled = odd;
  filled[0x7FE00010] = "OW:" + std::string(10, '\5');  // 9 and one byte of filling
  put_slices(folder, filled);
  EXPECT_EQ(read(folder.path()).at(2, 2, 2), 5 - 1024);
  filled[0x7FE00010] = "OW:" + std::string(12, '\5');
  put_slices(folder, filled);
  EXPECT_SAYS(read(folder.path()), "its header tells of 9 bytes of pixels, but there are 12");
  filled[0x7FE00010] =
      "OW:" + std::string(9, '\5') + std::string(129, '\0');  // to the end of a block, as some programs write it
  put_slices(folder, filled);
  EXPECT_EQ(read(folder.path()).at(2, 2, 2), 5 - 1024);
}

TEST(ReadDicom, ScalingOfOnlySomeSlicesIsRefused) {
  const TemporaryFolder folder;
  for (const std::uint32_t tag : {0x00281052u, 0x00281053u}) {
    put_slices(folder, {});
    auto elements = marrow::test::ct_slice(1);
    elements.erase(tag);
    marrow::test::put(folder / "s1.dcm", marrow::test::dicom_file(elements));
    const std::string name = tag == 0x00281052u ? "RescaleIntercept" : "RescaleSlope";
    EXPECT_SAYS(read(folder.path()), "s1.dcm: its header has no " + name + ", but that of");
    EXPECT_SAYS(read(folder.path()), "s0.dcm has one; a series has it in all slices or in none");
  }
}

TEST(ReadDicom, ValuesThatAreNoHounsfieldUnitsAreRefused) {
  const TemporaryFolder folder;
  for (const char* unit : {"HU", "US", ""}) {
    put_slices(folder, {{0x00281054, "LO:" + std::string(unit)}});
    EXPECT_EQ(read(folder.path()).at(3, 2, 1), 11 - 1024) << unit;
  }
  put_slices(folder, {{0x00281054, "LO:Z_EFF"}});
  EXPECT_SAYS(read(folder.path()),
              "s0.dcm: its values are no Hounsfield units: RescaleType (0028,1054) is 'Z_EFF', expected HU");
}

// Each step agrees with even steps up to rounding.
TEST(ReadDicom, SmallStepsThatAddUpAreRefused) {
  const auto series = [](int count, auto place) {
    const TemporaryFolder folder;
    for (int k = 0; k < count; ++k) {
      DicomSlice slice = slice_at(0, 0);
      slice.position = place(k);
      write_dicom(folder / ("s" + std::to_string(1000 + k) + ".dcm"), slice);
    }
    return marrow::test::message_of([&] { read(folder.path()); });
  };
  using Place = std::array<double, 3>;
  EXPECT_EQ(series(20, [](int k) { return Place{0, k % 2 * 0.01, 3.0 * k + (k % 2) * 0.002}; }), "");
  const std::string bent = series(60, [](int k) { return Place{0, 0.02 * std::abs(k - 30), 3.0 * k}; });
  EXPECT_NE(bent.find("the slices are shifted sideways, up to 0.29"), std::string::npos) << bent;
  EXPECT_NE(bent.find("mm from where a tilted gantry would put them"), std::string::npos) << bent;
  const std::string uneven = series(60, [](int k) { return Place{0, 0, 3.0 * k + (k > 30 ? 0.02 * (k - 30) : 0)}; });
  EXPECT_NE(uneven.find("the slices are unevenly spaced; some lie up to 0.29"), std::string::npos) << uneven;
}

TEST(ReadDicom, MissingAndRepeatedSlicesAreDiagnosed) {
  const TemporaryFolder folder;
  for (const double z : {0.0, 1.0, 2.0, 4.0, 5.0})
    write_dicom(folder / ("z" + std::to_string(int(z)) + ".dcm"), slice_at(z, 0));
  EXPECT_SAYS(read(folder.path()), "2 mm between z2.dcm and z4.dcm, 1 mm between most slices; a slice is missing");
  write_dicom(folder / "z3.dcm", slice_at(3, 0));
  EXPECT_EQ(read(folder.path()).grid.size[2], 6);
  std::filesystem::copy(folder / "z3.dcm", folder / "z3again.dcm");
  EXPECT_SAYS(read(folder.path()), "z3.dcm and z3again.dcm lie at the same place");
}

TEST(ReadDicom, RefusesOtherModalitiesSizesAndTilts) {
  {
    const TemporaryFolder folder;
    for (int k = 0; k < 2; ++k) {
      DicomSlice slice = slice_at(k, 0);
      slice.modality = "MR";
      write_dicom(folder / ("s" + std::to_string(k) + ".dcm"), slice);
    }
    EXPECT_SAYS(read(folder.path()), "s0.dcm: is of modality 'MR'; expected CT");
  }
  {
    const TemporaryFolder folder;
    write_series(folder);
    DicomSlice other = slice_at(18, 0);
    other.width = 3;
    other.height = 4;
    write_dicom(folder / "other.dcm", other);
    EXPECT_SAYS(read(folder.path()), "other.dcm: has another size, spacing or direction");
  }
  {
    const TemporaryFolder folder;
    for (int k = 0; k < 3; ++k) {
      DicomSlice slice = slice_at(k, 0);
      slice.position[1] = 1.3 * k;
      write_dicom(folder / ("s" + std::to_string(k) + ".dcm"), slice);
    }
    EXPECT_SAYS(read(folder.path()), "the slices lie sheared by 52.43 degrees, more than a gantry tilts");
  }
  const TemporaryFolder folder;
  EXPECT_SAYS(read(folder.path()), "holds no DICOM file");
  write_dicom(folder / "only.dcm", slice_at(0, 0));
  EXPECT_SAYS(read(folder.path()), "the series has 1 slice; a volume needs at least 2");
  EXPECT_SAYS(read(folder / "only.dcm"), "a folder of DICOM slices (name the folder)");
}

TEST(ReadDicom, VisibleHumanPelvis) {
  MARROW_NEED_DATA(path, "pelvis_dicom");
  const marrow::Volume volume = read(path);
  EXPECT_EQ(volume.grid.size, (std::array<int, 3>{512, 512, 4}));
  EXPECT_NEAR(volume.grid.spacing_mm[2], 1, 1e-6);
  EXPECT_GT(volume.grid.direction(2, 2), 0.99) << "the third axis runs to the head";
  const auto [least, greatest] = std::minmax_element(volume.values.begin(), volume.values.end());
  EXPECT_GE(*least, -2048);
  EXPECT_LE(*least, -900) << "air is near -1000 HU";
  EXPECT_GT(*greatest, 500) << "bone";
}

TEST(ReadDicom, DamagedSlicesAreDiagnosed) {
  const TemporaryFolder good, folder;
  DicomSlice slice = slice_at(0, 0);
  slice.width = slice.height = 64;
  slice.values.assign(4096, 7);
  write_dicom(good / "good.dcm", slice);
  for (int k = 1; k < 4; ++k) {
    slice.position[2] = k;
    write_dicom(folder / ("s" + std::to_string(k) + ".dcm"), slice);
  }
  marrow::test::expect_damage_is_diagnosed(good / "good.dcm", folder / "s0.dcm",
                                           [&](const auto&) { read(folder.path()); });
}

TEST(ReadDicom, TruncatedRealSliceIsDiagnosed) {
  MARROW_NEED_DATA(path, "pelvis_dicom/vhf.1001.dcm");
  const TemporaryFolder folder;
  for (const char* name : {"vhf.1000.dcm", "vhf.1002.dcm", "vhf.1003.dcm"})
    std::filesystem::copy(path.parent_path() / name, folder / name);
  marrow::test::expect_damage_is_diagnosed(path, folder / "vhf.1001.dcm", [&](const auto&) { read(folder.path()); });
}

}  // namespace dicom_test
