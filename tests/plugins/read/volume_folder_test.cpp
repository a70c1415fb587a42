// SPDX-License-Identifier: Apache-2.0
// Folders that hold a volume: a header with its samples in another file, or slices; and nothing from elsewhere.
#include "marrow/toolbox/files/volume_file.hpp"
#include "tests/plugins/read/damage.hpp"
#include "tests/plugins/read/itk_files.hpp"

namespace volume_folder_test {

using namespace marrow;
using namespace marrow::test;

Volume read(const std::filesystem::path& path) { return files::read_volume_file(path, {}); }

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

}  // namespace volume_folder_test
