// SPDX-License-Identifier: Apache-2.0
// What lies beside the slices of a CT: other DICOM objects, and files of other kinds.
#include <zlib.h>

#include "tests/plugins/read/dicom_text.hpp"
#include "tests/plugins/read/reading.hpp"

namespace dicom_folder_test {

using namespace marrow;
using namespace marrow::test;

constexpr const char* kCtClass = "1.2.840.10008.5.1.4.1.1.2";
constexpr const char* kOtherSeries = "UI:1.2.77";

/// All elements after the start packed by Deflate, without a header (PS3.5 A.5).
std::string deflated_file(const Elements& elements) {
  const std::string plain = dicom_elements(elements);
  std::string packed(compressBound(plain.size()), '\0');
  uLongf length = packed.size();
  EXPECT_EQ(compress(reinterpret_cast<Bytef*>(packed.data()), &length, reinterpret_cast<const Bytef*>(plain.data()),
                     plain.size()),
            Z_OK);
  return dicom_start("1.2.840.10008.1.2.1.99", kCtClass) + packed.substr(2, length - 6);
}

/// A slice of another CT series.
Elements other_slice(const Elements& by = {}) {
  return but(but(ct_slice(0), {{0x00080016, std::string("UI:") + kCtClass}, {0x0020000E, kOtherSeries}}), by);
}

/// A report, plan or the like.
Elements other_object(const std::string& class_uid, const std::string& modality) {
  return {{0x00080016, "UI:" + class_uid}, {0x00080060, "CS:" + modality}, {0x0020000E, kOtherSeries}};
}

class DicomFolder : public InAFolder {
 protected:
  void SetUp() override {
    for (int z = 0; z < 3; ++z) put_file("s" + std::to_string(z), dicom_file(ct_slice(z)));
  }
  void put_file(const std::string& name, const std::string& bytes) { put(folder / name, bytes); }
  Volume read(const std::string& series_uid = "") {
    Volume volume;
    lines = said_by([&](const Context& context) {
      volume = read_by<Volume>("read.volume", folder.path(), {{"series_uid", series_uid}}, context);
    });
    return volume;
  }
  /// The volume consists of the three slices alone, and one line of the log says what was left out.
  void expect_passed_over(const std::string& said, const std::string& series_uid = "") {
    Volume volume;
    ASSERT_EQ(message_of([&] { volume = read(series_uid); }), "") << said;
    ASSERT_EQ(volume.grid.size, (std::array<int, 3>{4, 3, 3}));
    EXPECT_EQ(volume.at(3, 2, 1), 11 - 1024);
    ASSERT_EQ(lines.size(), 1u) << said;
    EXPECT_EQ(lines[0], "passed over what is no slice of the series: " + said);
  }
  std::vector<std::string> lines;
};

TEST_F(DicomFolder, MoreReportsThanSlicesInTheSameSeries) {
  for (int i = 0; i < 5; ++i) {
    Elements report = other_object("1.2.840.10008.5.1.4.1.1.88.11", "SR");
    report[0x0020000E] = ct_slice(0).at(0x0020000E);
    put_file("r" + std::to_string(i), dicom_file(report));
  }
  EXPECT_EQ(read().grid.size[2], 3);
  EXPECT_EQ(read("1.2.9").grid.size[2], 3);
}

// A disc for patients contains the program that shows the images.
TEST_F(DicomFolder, ProgramsAndArchivesArePassedOver) {
  put_file("VIEWER", "MZ\x90" + std::string(200, '\1'));
  put_file("viewer.bin", "\x7f" + ("ELF" + std::string(200, '\1')));
  put_file("plugin.dat", "PK\3\4" + std::string(200, '\1'));
  expect_passed_over("VIEWER, plugin.dat, viewer.bin");
}

TEST_F(DicomFolder, ObjectsThatAreNoSliceOfACtArePassedOver) {
  const std::string storage = "1.2.840.10008.5.1.4.1.1.";
  const Elements colours{
      {0x00080016, "UI:" + storage + "7"}, {0x00080060, "CS:CT"}, {0x00280002, "US:3"}, {0x00280004, "CS:RGB"}},
      mr{{0x00080016, "UI:" + storage + "4"}, {0x00080060, "CS:MR"}},
      localizer{{0x00080008, "CS:ORIGINAL\\PRIMARY\\LOCALIZER"}},
      page{{0x00080016, "UI:" + storage + "7"}, {0x00280010, "US:3"}};
  const std::pair<std::string, std::string> objects[] = {
      {dicom_start("1.2.840.10008.1.2.1", "1.2.840.10008.1.3.10"), "a media directory"},
      {dicom_file(other_object(storage + "88.33", "SR")), "SR"},
      {dicom_file(other_object(storage + "481.5", "RTPLAN")), "RTPLAN"},
      {implicit_file(other_object(storage + "481.2", "RTDOSE")), "RTDOSE"},
      {implicit_elements(but(other_object(storage + "481.3", "RTSTRUCT"), {{0x00080005, "CS:ISO_IR 100"}})),
       "RTSTRUCT"},
      {dicom_file(other_object(storage + "66.4", "SEG")), "SEG"},
      {dicom_file(other_slice(colours)), "in colours"},
      {dicom_file(other_slice(mr)), "MR"},
      {dicom_file(other_slice(localizer)), "a localizer"},
      {dicom_file(without(other_slice(page), {0x00200032})), "without a place in the patient"},
      {dicom_start("1.2.840.10008.1.2.4.90") + dicom_elements(other_slice(mr)), "MR"}};
  for (const auto& [bytes, why] : objects)
    for (const char* name : {"other.dcm", "IM77"})
      for (const char* series : {"", "1.2.9"}) {
        put_file(name, bytes);
        expect_passed_over(std::string(name) + " (" + why + ")", series);
        std::filesystem::remove(folder / name);
      }
}

TEST_F(DicomFolder, AnotherCtSeriesIsPassedOverWhereTheWantedOneIsNamed) {
  const std::string cut_off = dicom_file(other_slice()).substr(0, dicom_file(other_slice()).size() - 5);
  for (const std::string& bytes : {dicom_file(other_slice()), deflated_file(other_slice()), cut_off,
                                   dicom_start("1.2.840.10008.1.2.4.91") + dicom_elements(other_slice())}) {
    put_file("other", bytes);
    expect_passed_over("other (of the series 1.2.77)", "1.2.9");
    EXPECT_SAYS(read(),
                "holds 2 series; name one with series_uid:\n    1.2.77 (CT, 1 slices)\n    1.2.9 (CT, 3 slices)");
  }
}

TEST_F(DicomFolder, WhatIsNoCtIsNoChoice) {
  put_file("other", dicom_file(other_slice()));
  put_file("report", dicom_file(other_object("1.2.840.10008.5.1.4.1.1.88.33", "SR")));
  const std::string said = message_of([&] { read(); });
  EXPECT_HAS(said, "1.2.77 (CT, ");
  EXPECT_EQ(said.find("(SR"), std::string::npos) << said;
}

// If it is cut off before it names its series, it may be a slice of the wanted one.
TEST_F(DicomFolder, AFileWhoseSeriesCannotBeToldIsRefused) {
  const std::string whole = dicom_file(ct_slice(3));
  put_file("s3", whole.substr(0, whole.find("1.2.9") - 2));
  for (const char* series : {"", "1.2.9"}) EXPECT_SAYS(read(series), "s3: is cut off or damaged:");
}

// A byte of the class or modality of a slice may be damaged.
TEST_F(DicomFolder, ASliceIsNotPassedOverForOneWrongElement) {
  const Elements classed{{0x00080016, std::string("UI:") + kCtClass}};
  for (int z = 0; z < 3; ++z) put_file("s" + std::to_string(z), dicom_file(but(ct_slice(z), classed)));
  const auto last = [&](const Elements& by) { put_file("s2", dicom_file(but(but(ct_slice(2), classed), by))); };
  last({{0x00080016, "UI:1.2.840.10008.5.1.4.1.1.4"}});
  EXPECT_EQ(read().grid.size[2], 3);
  last({{0x00080060, "CS:CU"}});
  EXPECT_SAYS(read(), "s2: is of modality 'CU'; expected CT");
  last({{0x00280002, "US:3"}});
  EXPECT_SAYS(read(), "s2: has colours");
}

TEST_F(DicomFolder, ADataSetWithoutAFilesStartIsRead) {
  put_file("s1", implicit_elements(but(ct_slice(1), {{0x00080005, "CS:ISO_IR 100"}})));
  put_file("s2", dicom_elements(but(ct_slice(2), {{0x00080005, "CS:ISO_IR 100"}})));
  const Volume volume = read();
  for (int z = 0; z < 3; ++z) EXPECT_EQ(volume.at(3, 2, z), 11 - 1024);
  EXPECT_TRUE(lines.empty());
}

TEST_F(DicomFolder, FilesOfMarrowAndOtherProgramsArePassedOver) {
  put_file("a.tra", "1,0,0");
  put_file("b.tfm", "#Insight");
  put_file("c.fcsv", "# Markups");
  put_file("d.h5", std::string("\x89HDF\0\0", 6));
  put_file("e.mrk.json", "{}");
  put_file("f.unheard", "a text");
  put_file("Thumbs.db", std::string(8, '\0'));
  put_file("runs/first/out.yaml", "a: 1");
  put_file("runs/first/.store/0a1b", std::string(300, '\1'));
  put_file("runs/report.dcm", dicom_file(other_object("1.2.840.10008.5.1.4.1.1.88.33", "SR")));
  expect_passed_over("Thumbs.db, a.tra, b.tfm, c.fcsv, d.h5, e.mrk.json, f.unheard, runs/");
}

TEST_F(DicomFolder, AllFilesThatMayBeDamagedSlicesAreNamedAtOnce) {
  put_file("IM7", "");
  put_file("IM8", "<html>not found</html>");
  put_file("IM9.dcm", std::string(500, '\1'));
  EXPECT_SAYS(read(),
              "holds 3 files beside the slices that are no whole DICOM files; those that are slices are damaged at "
              "their start: fetch them again, and remove the others from the folder:");
  for (const char* line :
       {"\n    IM7: this file in the series' folder is no whole DICOM file (it is empty)",
        "\n    IM8: this file in the series' folder is no whole DICOM file (it has 22 bytes, at least",
        "\n    IM9.dcm: this file in the series' folder is no whole DICOM file (it has no 'DICM'"})
    EXPECT_SAYS(read(), line);
}

TEST_F(DicomFolder, SlicesBelowAreNamedAllAtOnceAndOtherObjectsArePassedOver) {
  put_file("more/other", dicom_file(other_slice()));
  expect_passed_over("more/");
  put_file("more/s3", dicom_file(ct_slice(3)));
  put_file("more/deep/s4", dicom_file(ct_slice(4)));
  EXPECT_SAYS(read(), "more: this folder inside the series' folder holds files that may be slices ('s3', 'deep/s4')");
}

TEST(DicomFolderWithoutACt, SaysWhatIsThere) {
  const TemporaryFolder folder;
  const auto read = [&] { read_by<Volume>("read.volume", folder.path()); };
  put(folder / "a", dicom_file(other_object("1.2.840.10008.5.1.4.1.1.88.33", "SR")));
  EXPECT_SAYS(read(), "a: holds no image, it is of modality SR; expected a CT slice or an X-ray image");
  put(folder / "b",
      dicom_file(but(other_object("1.2.840.10008.5.1.4.1.1.481.5", "RTPLAN"), {{0x0020000E, "UI:1.2.78"}})));
  EXPECT_SAYS(read(), "holds no slice of a CT; its DICOM files are of these series:\n    1.2.77 (SR, 1 ");
}

}  // namespace dicom_folder_test
