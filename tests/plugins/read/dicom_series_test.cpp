// SPDX-License-Identifier: Apache-2.0
// DICOM series through read.volume: their slices lie within 0.1 mm of an even, straight grid, and none is missing.
#include <cstdio>

#include "tests/plugins/read/dicom_text.hpp"
#include "tests/plugins/read/itk_files.hpp"
#include "tests/plugins/read/reading.hpp"

namespace dicom_series_test {

using namespace marrow;
using namespace marrow::test;
using Eigen::Vector3d;

std::string rounded(double value, int decimals) {
  char text[32];
  std::snprintf(text, sizeof text, "%.*f", decimals, value);
  return text;
}

DicomSlice slice_at(double z, int base = 0) {
  DicomSlice slice;
  slice.position = {-1, -2, z};
  for (int i = 0; i < 12; ++i) slice.values.push_back(std::int16_t(base + i));
  return slice;
}

class DicomSeries : public InAFolder {
 protected:
  Volume read(const std::string& series_uid = "") const {
    return read_by<Volume>("read.volume", folder.path(), {{"series_uid", series_uid}});
  }
  /// Four slices by ITK at z = 10, 12, 14, 16. Their file names are in the reverse order.
  void write_series(const std::string& series = "1.2.3.4", const std::string& prefix = "") {
    for (int k = 0; k < 4; ++k) {
      DicomSlice slice = slice_at(10 + 2 * k, 100 * k - 500);
      slice.series = series;
      write_dicom(folder / (prefix + "slice" + std::to_string(9 - k) + ".dcm"), slice);
    }
  }
  void write(const std::string& name, const DicomSlice& slice) { write_dicom(folder / name, slice); }
  void clear() {
    for (const auto& entry : std::filesystem::directory_iterator(folder.path())) std::filesystem::remove_all(entry);
  }
  /// Slices with these elements, named s100, s101, ...; all values of a slice are its number.
  Volume of(const std::vector<Elements>& slices) {
    clear();
    for (std::size_t i = 0; i < slices.size(); ++i) {
      std::string pixels = "OW:";
      for (int k = 0; k < 12; ++k) pixels += little(i, 2);
      put(folder / ("s" + std::to_string(100 + i)),
          dicom_file(but(but(ct_slice(0), {{0x7FE00010, pixels}}), slices[i])));
    }
    return read();
  }
  /// Slices at these z, which are written as given.
  Volume at(const std::vector<std::string>& z_mm) {
    std::vector<Elements> slices;
    for (const std::string& z : z_mm) slices.push_back({{0x00200032, "DS:-115.5\\-1.85\\" + z}});
    return of(slices);
  }
  /// Three slices with these changes, which are read.
  Volume changed(const Elements& by) {
    for (int z = 0; z < 3; ++z) put(folder / ("s" + std::to_string(z) + ".dcm"), dicom_file(but(ct_slice(z), by)));
    return read();
  }
};

TEST_F(DicomSeries, IsSortedByPositionAndGivesHounsfieldUnits) {
  write_series();
  put(folder / "README.txt", "not a slice");
  const Volume volume = read();
  EXPECT_EQ(volume.grid.size, (std::array<int, 3>{4, 3, 4}));
  EXPECT_LT((volume.grid.origin_mm - Vector3d(-1, -2, 10)).norm(), 1e-9);
  EXPECT_LT((volume.grid.spacing_mm - Vector3d(0.5, 0.75, 2)).norm(), 1e-9);
  EXPECT_TRUE(volume.grid.direction.isIdentity(1e-12));
  for (int k = 0; k < 4; ++k) EXPECT_EQ(volume.at(2, 1, k), 100 * k - 500 + 6);
}

TEST_F(DicomSeries, OfCoronalSlicesKeepsTheirDirections) {
  for (int k = 0; k < 3; ++k) {
    DicomSlice slice = slice_at(0, 10 * k);
    slice.position = {5, 1.5 * k, 7};
    slice.orientation = "1\\0\\0\\0\\0\\-1";
    write("s" + std::to_string(k) + ".dcm", slice);
  }
  const Volume volume = read();
  EXPECT_LT((volume.grid.direction.col(1) - Vector3d(0, 0, -1)).norm(), 1e-9);
  EXPECT_LT((volume.grid.direction.col(2) - Vector3d(0, 1, 0)).norm(), 1e-9);
  EXPECT_NEAR(volume.grid.spacing_mm[2], 1.5, 1e-9);
  EXPECT_EQ(volume.at(0, 0, 2), 20);
}

TEST_F(DicomSeries, TwoAreListedAndOneCanBeNamed) {
  write_series("1.2.3.4", "a");
  write_series("1.2.3.5", "b");
  EXPECT_SAYS(read(),
              "holds 2 series; name one with series_uid:\n    1.2.3.4 (CT, 4 slices)\n    1.2.3.5 (CT, 4 slices)");
  EXPECT_EQ(read("1.2.3.5").grid.size[2], 4);
  EXPECT_SAYS(read("9.9"), "holds no series 9.9; it holds:\n    1.2.3.4");
}

// If the last slice were left out, no gap would show it. So it is refused, whatever its name is.
TEST_F(DicomSeries, FilesThatAreNoWholeSliceAreRefused) {
  write_series();
  write("fifth", slice_at(18));
  const std::string good = bytes_of(folder / "fifth");
  std::filesystem::remove(folder / "fifth");
  for (const std::string name : {"IM5", "IM5.DCM", "IM5.IMA", "im5.dcm", "IM5.img", "IM5.bak", "im5.dcm.gz"}) {
    for (const auto& [content, text] :
         {std::pair{std::string(), "it is empty"}, std::pair{good.substr(0, 100), "it has 100 bytes"},
          std::pair{replaced(good, 128, "XXXX"), "it has no 'DICM' at byte 128"}}) {
      put(folder / name, content);
      EXPECT_SAYS(read(), name + ": this file in the series' folder is no whole DICOM file (" + text);
    }
    put(folder / name, good);
    EXPECT_EQ(read().grid.size[2], 5) << name;
    std::filesystem::remove(folder / name);
  }
}

TEST_F(DicomSeries, FilesThatAreNoSliceByNameArePassedOver) {
  write_series();
  for (const char* name : {"LICENSE", "README", "notes.TXT", "Thumbs.db", ".DS_Store", "._IM5", "DICOMDIR",
                           "segmentation.nii.gz", "case.yaml", "below/report.pdf"})
    put(folder / name, "not a slice");
  put(folder / "empty.txt", "");
  EXPECT_EQ(read().grid.size[2], 4);
}

// Otherwise labels beside the CT would be used in its place.
TEST_F(DicomSeries, AVolumeOfAnotherKindBesideTheSlicesIsRefused) {
  write_series();
  for (const std::string name : {"labels.mhd", "labels.nhdr"}) {
    put(folder / name, "header");
    EXPECT_SAYS(read(), "holds both a DICOM file ('slice");
    EXPECT_SAYS(read(), "and '" + name + "', which may be another volume; keep one volume per folder");
    std::filesystem::remove(folder / name);
  }
}

TEST_F(DicomSeries, SlicesInAFolderBelowAreRefused) {
  write_series();
  std::filesystem::create_directories(folder / "more/part");
  std::filesystem::rename(folder / "slice6.dcm", folder / "more/part/slice6.dcm");
  EXPECT_SAYS(read(), "more: this folder inside the series' folder holds files that may be slices ('part/slice6.dcm')");
  put(folder / "more/part/slice6.dcm", "");
  EXPECT_SAYS(read(), "('part/slice6.dcm'), and only one folder is read");
}

TEST_F(DicomSeries, PixelsThatTheHeaderDoesNotTellOfAreRefused) {
  EXPECT_EQ(changed({}).at(3, 2, 1), 11 - 1024);
  const std::string damaged = "s0.dcm: is cut off or damaged: its header tells of ";
  EXPECT_SAYS(changed({{0x00280010, "US:2"}}), damaged + "16 bytes of pixels, but there are 24");
  Elements bits_8 = elements_of("00280100 US:8 00280101 US:8 00280102 US:7");
  EXPECT_SAYS(changed(bits_8), damaged + "12 bytes of pixels, but there are 24");
  const auto pixels = [&](const std::string& bytes) {
    return changed(but(bits_8, {{0x00280011, "US:3"}, {0x7FE00010, "OW:" + bytes}}));
  };
  EXPECT_EQ(pixels(std::string(10, '\5')).at(2, 2, 2), 5 - 1024);  // 9 and one byte of filling
  EXPECT_SAYS(pixels(std::string(12, '\5')), "its header tells of 9 bytes of pixels, but there are 12");
  // To the end of a block, as some programs write it.
  EXPECT_EQ(pixels(std::string(9, '\5') + std::string(129, '\0')).at(2, 2, 2), 5 - 1024);
}

TEST_F(DicomSeries, ScalingOfOnlySomeSlicesAndOtherUnitsAreRefused) {
  for (const auto& [tag, name] : {std::pair{0x00281052u, "RescaleIntercept"}, {0x00281053u, "RescaleSlope"}}) {
    changed({});
    put(folder / "s1.dcm", dicom_file(without(ct_slice(1), {tag})));
    EXPECT_SAYS(read(), std::string("s1.dcm: its header has no ") + name + ", but that of");
    EXPECT_SAYS(read(), "s0.dcm has one; a series has it in all slices or in none");
  }
  for (const std::string unit : {"HU", "US", ""})
    EXPECT_EQ(changed({{0x00281054, "LO:" + unit}}).at(3, 2, 1), 11 - 1024) << unit;
  EXPECT_SAYS(changed({{0x00281054, "LO:Z_EFF"}}),
              "s0.dcm: its values are no Hounsfield units: RescaleType (0028,1054) is 'Z_EFF', expected HU");
}

// Each step agrees with even steps up to rounding.
TEST_F(DicomSeries, SmallStepsThatAddUpAreRefused) {
  const auto series = [&](int count, auto place) {
    std::vector<Elements> slices;
    for (int k = 0; k < count; ++k) {
      const Vector3d at = place(k);
      slices.push_back({{0x00200032, "DS:" + rounded(at[0], 6) + "\\" + rounded(at[1], 6) + "\\" + rounded(at[2], 6)}});
    }
    return message_of([&] { of(slices); });
  };
  EXPECT_EQ(series(20, [](int k) { return Vector3d(0, k % 2 * 0.01, 3.0 * k + (k % 2) * 0.002); }), "");
  const std::string bent = series(60, [](int k) { return Vector3d(0, 0.02 * std::abs(k - 30), 3.0 * k); });
  EXPECT_HAS(bent, "the slices are shifted sideways, up to 0.29");
  EXPECT_HAS(bent, "mm from where a tilted gantry would put them");
  const std::string uneven = series(60, [](int k) { return Vector3d(0, 0, 3.0 * k + (k > 30 ? 0.02 * (k - 30) : 0)); });
  EXPECT_HAS(uneven, "the slices are unevenly spaced; some lie up to 0.29");
}

TEST_F(DicomSeries, MissingAndRepeatedSlicesAreDiagnosed) {
  for (const int z : {0, 1, 2, 4, 5}) write("z" + std::to_string(z) + ".dcm", slice_at(z));
  EXPECT_SAYS(read(), "2 mm between z2.dcm and z4.dcm, 1 mm between most slices; a slice is missing");
  write("z3.dcm", slice_at(3));
  EXPECT_EQ(read().grid.size[2], 6);
  std::filesystem::copy(folder / "z3.dcm", folder / "z3again.dcm");
  EXPECT_SAYS(read(), "z3.dcm and z3again.dcm lie at the same place");
}

TEST_F(DicomSeries, OfOtherModalitiesSizesAndTiltsIsRefused) {
  EXPECT_SAYS(read(), "holds no DICOM file");
  write("only.dcm", slice_at(0));
  EXPECT_SAYS(read(), "the series has 1 slice; a volume needs at least 2");
  EXPECT_SAYS(read_by<Volume>("read.volume", folder / "only.dcm"), "a folder of DICOM slices (name the folder)");
  clear();
  for (int k = 0; k < 2; ++k) {
    DicomSlice slice = slice_at(k);
    slice.modality = "MR";
    write("s" + std::to_string(k) + ".dcm", slice);
  }
  EXPECT_SAYS(read(), "s0.dcm: is of modality 'MR'; expected CT");
  clear();
  write_series();
  DicomSlice other = slice_at(18);
  std::swap(other.width, other.height);
  write("other.dcm", other);
  EXPECT_SAYS(read(), "other.dcm: has another size, spacing or direction");
  EXPECT_SAYS(of({{{0x00200032, "DS:0\\0\\0"}}, {{0x00200032, "DS:0\\1.3\\1"}}, {{0x00200032, "DS:0\\2.6\\2"}}}),
              "the slices lie sheared by 52.43 degrees, more than a gantry tilts");
}

// The spacing follows from the first and the last position as written: for 0.625 mm with two decimals 11.88 mm / 19.
TEST_F(DicomSeries, WithRoundedPositionsIsRead) {
  for (const double gap_mm : {0.3, 0.4, 0.625, 0.75, 0.8, 1.25, 2.5})
    for (const int decimals : {1, 2, 3}) {
      std::vector<std::string> z_mm;
      for (int i = 0; i < 20; ++i) z_mm.push_back(rounded(736.17 + gap_mm * i, decimals));
      const Volume volume = at(z_mm);
      SCOPED_TRACE(std::to_string(gap_mm) + " mm, " + std::to_string(decimals) + " decimals");
      ASSERT_EQ(volume.grid.size[2], 20);
      EXPECT_NEAR(volume.grid.origin_mm[2], std::stod(z_mm.front()), 1e-9);
      EXPECT_NEAR(volume.grid.spacing_mm[2], (std::stod(z_mm.back()) - std::stod(z_mm.front())) / 19, 1e-9);
      EXPECT_EQ(volume.at(0, 0, 7), 7 - 1024);
    }
}

TEST_F(DicomSeries, ASliceThatIsMissingIsNoticedAtAnyDistanceAndRounding) {
  for (const double gap_mm : {0.05, 0.1, 0.3, 0.625, 1.0, 5.0})
    for (const int decimals : {1, 2, 3})
      for (const int count : {4, 20})
        for (const int missing : {1, count / 2, count - 2}) {
          if (gap_mm < 2 * std::pow(10, -decimals)) continue;  // the rounded positions say nothing then
          std::vector<std::string> z_mm;
          for (int i = 0; i < count; ++i)
            if (i != missing) z_mm.push_back(rounded(gap_mm * i, decimals));
          SCOPED_TRACE(std::to_string(gap_mm) + " mm, slice " + std::to_string(missing) + " of " +
                       std::to_string(count));
          EXPECT_SAYS(at(z_mm), "a slice is missing or the series is unevenly spaced");
        }
}

// In an oblique series the first slice's own rounding may be as large as that of any other: by numpy, slices lie up to
// 0.127 mm sideways of the first one here, and up to 0.064 mm of the straight line through all.
TEST_F(DicomSeries, OfObliqueSlicesWithOneDecimalIsRead) {
  std::vector<Elements> slices;
  for (int i = 0; i < 30; ++i)
    slices.push_back({{0x00200037, "DS:0.8\\0.6\\0\\-0.36\\0.48\\0.8"},
                      {0x00200032, "DS:" + rounded(-115.448 + 0.8 * 0.48 * i, 1) + "\\" +
                                       rounded(-1.782 - 0.8 * 0.64 * i, 1) + "\\" + rounded(3.04 + 0.8 * 0.6 * i, 1)}});
  EXPECT_EQ(of(slices).grid.size[2], 30);
}

TEST_F(DicomSeries, FartherThanATenthOfAMillimetreFromTheGridIsRefused) {
  EXPECT_EQ(at({"0", "1.09", "2", "3"}).grid.size[2], 4);
  EXPECT_SAYS(at({"0", "1.11", "2", "3"}),
              "the slices are unevenly spaced; some lie up to 0.11 mm from where even ones of 1 mm would");
}

// The positions by pydicom: 20 of 0 to 11.88 mm, at most 0.0095 mm from the grid, and 6 of 736.17 to 761.25 mm.
TEST_F(DicomSeries, OfRealSlicesWithRoundedPositionsIsRead) {
  MARROW_NEED_DATA(data, "strangers/slices");
  for (const auto& [name, count, first_mm, last_mm] :
       {std::tuple{"dz0.625_dec2", 20, 0.0, 11.88}, {"jitter_0.04mm", 6, 736.17, 761.25}}) {
    const Grid grid = read_by<Volume>("read.volume", data / name).grid;
    EXPECT_EQ(grid.size[2], count);
    EXPECT_NEAR(grid.spacing_mm[2], (last_mm - first_mm) / (count - 1), 1e-9);
    EXPECT_NEAR(grid.origin_mm[2], first_mm, 1e-9);
  }
}

TEST_F(DicomSeries, VisibleHumanPelvis) {
  MARROW_NEED_DATA(path, "pelvis_dicom");
  const Volume volume = read_by<Volume>("read.volume", path);
  EXPECT_EQ(volume.grid.size, (std::array<int, 3>{512, 512, 4}));
  EXPECT_NEAR(volume.grid.spacing_mm[2], 1, 1e-6);
  EXPECT_GT(volume.grid.direction(2, 2), 0.99) << "the third axis runs to the head";
  const auto [least, greatest] = std::minmax_element(volume.values.begin(), volume.values.end());
  EXPECT_GE(*least, -2048);
  EXPECT_LE(*least, -900) << "air is near -1000 HU";
  EXPECT_GT(*greatest, 500) << "bone";
}

}  // namespace dicom_series_test
