// SPDX-License-Identifier: Apache-2.0
// By what a file or folder that a run wrote is known again.
#include "marrow/runtime/pipeline/written_content.hpp"

#include <gtest/gtest.h>

#include "tests/framework/fixture.hpp"

namespace written_content_test {

namespace fs = std::filesystem;
using marrow::content_of;
using runtime_fixture::Scratch;

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

}  // namespace written_content_test
