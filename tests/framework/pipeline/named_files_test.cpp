// SPDX-License-Identifier: Apache-2.0
// Which files a path names, and the digests of their content.
#include "marrow/runtime/pipeline/named_files.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include "marrow/runtime/pipeline/written_content.hpp"
#include "marrow/runtime/run/keys.hpp"
#include "tests/framework/fixture.hpp"

namespace named_files_test {

namespace fs = std::filesystem;
using marrow::content_of;
using runtime_fixture::Scratch;

class NamedFilesTest : public testing::Test {
 protected:
  NamedFilesTest() {
    fs::create_directories(folder / "sub");
    std::ofstream(folder / "b.txt") << "b";
    std::ofstream(folder / "sub" / "a.txt") << "a";
  }
  std::vector<std::string> names() {
    std::vector<std::string> names;
    for (const marrow::NamedFile& file : marrow::files_named_by(folder))
      names.push_back(file.name + (file.is_there ? "" : " (nowhere)"));
    return names;
  }
  std::string fault() { return MESSAGE_OF(marrow::files_named_by(folder)); }
  Scratch scratch;
  fs::path folder = fs::canonical(scratch.path) / "case";
};

TEST_F(NamedFilesTest, AreAllFilesBelowSorted) {
  EXPECT_EQ(names(), (std::vector<std::string>{"b.txt", "sub/a.txt"}));
  EXPECT_TRUE(marrow::files_named_by(folder / "absent").empty());
  EXPECT_EQ(marrow::files_named_by(folder / "b.txt").at(0).name, ".");
}

TEST_F(NamedFilesTest, ALinkInsideCountsAndALinkToNothingIsNoFault) {
  fs::create_symlink("b.txt", folder / "c.txt");
  fs::create_symlink("gone", folder / "d.txt");
  fs::create_symlink("self", folder / "self");
  EXPECT_EQ(names(), (std::vector<std::string>{"b.txt", "c.txt", "d.txt (nowhere)", "self (nowhere)", "sub/a.txt"}));
}

TEST_F(NamedFilesTest, LinksThatLeaveOrLeadToFoldersAreRefused) {
  fs::create_symlink(scratch.write("outside.txt", "x"), folder / "out.txt");
  EXPECT_EQ(fault(), (folder / "out.txt").string() + ": is a link to a place outside " + folder.string() +
                         "; copy it into the folder");
  fs::remove(folder / "out.txt");
  fs::create_directory_symlink("sub", folder / "link");
  EXPECT_EQ(fault(), (folder / "link").string() + ": is a link to a folder; put the folder itself there");
}

TEST_F(NamedFilesTest, AFolderThatCannotBeReadIsAFault) {
  if (geteuid() == 0) GTEST_SKIP() << "root may read everything";
  fs::permissions(folder / "sub", fs::perms::none);
  EXPECT_EQ(fault(), (folder / "sub").string() + ": cannot be read: Permission denied; all files of a folder count");
  fs::permissions(folder / "sub", fs::perms::owner_all);
}

TEST_F(NamedFilesTest, DigestFollowsContentNotTimes) {
  const fs::path file = folder / "b.txt";
  const marrow::Digest before = marrow::path_digest(folder);
  const auto written = fs::last_write_time(file);
  std::ofstream(file) << "B";
  fs::last_write_time(file, written);  // as an unlucky copy would
  EXPECT_NE(marrow::path_digest(folder), before);
  std::ofstream(file) << "b";
  EXPECT_EQ(marrow::path_digest(folder), before);
  fs::rename(file, folder / "c.txt");
  EXPECT_NE(marrow::path_digest(folder), before);
}

TEST_F(NamedFilesTest, DigestOfASettledFileSeesAWriteThatKeepsSizeAndTime) {
  const fs::path file = folder / "b.txt";
  sleep(3);  // then it is settled, and its digest is kept
  const marrow::Digest before = marrow::path_digest(file);
  const auto written = fs::last_write_time(file);
  std::ofstream(file) << "B";
  fs::last_write_time(file, written);
  EXPECT_NE(marrow::path_digest(file), before);
}

TEST(WrittenContent, OfAFileIsWhatItHolds) {
  const Scratch scratch;
  const marrow::Digest before = content_of(scratch.write("a", "text"));
  EXPECT_EQ(content_of(scratch.write("b", "text")), before) << "wherever it was moved to";
  EXPECT_NE(content_of(scratch.write("a", "texT")), before);
  EXPECT_NE(content_of(scratch.write("a", "")), before);
}

TEST(WrittenContent, OfAFolderIsAllBelowIt) {
  const Scratch scratch;
  for (const char* folder : {"one", "two"}) {
    fs::create_directories(scratch.path / folder / "inner");
    scratch.write(std::string(folder) + "/image.png", "pixels");
    scratch.write(std::string(folder) + "/inner/mask.png", "mask");
  }
  const marrow::Digest whole = content_of(scratch.path / "one");
  EXPECT_EQ(content_of(scratch.path / "two"), whole);
  fs::rename(scratch.path / "two/image.png", scratch.path / "two/other.png");
  EXPECT_NE(content_of(scratch.path / "two"), whole);
  fs::rename(scratch.path / "two/other.png", scratch.path / "two/image.png");
  EXPECT_EQ(content_of(scratch.path / "two"), whole);
  fs::remove(scratch.path / "two/inner/mask.png");
  EXPECT_NE(content_of(scratch.path / "two"), whole);
}

}  // namespace named_files_test
