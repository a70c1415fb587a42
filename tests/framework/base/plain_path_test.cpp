// SPDX-License-Identifier: Apache-2.0
// Paths without '.' and '..' that name what the system finds under the path as it was written.
#include "marrow/base/plain_path.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "tests/framework/fixture.hpp"

namespace plain_path_test {

namespace fs = std::filesystem;
using marrow::plain_path;
using runtime_fixture::Scratch;

TEST(PlainPath, FoldersGoWithWhatLeadsOutOfThem) {
  const Scratch scratch;
  fs::create_directories(scratch.path / "a" / "b");
  EXPECT_EQ(plain_path(scratch.path / "a/b/../../x"), scratch.path / "x");
  EXPECT_EQ(plain_path(scratch.path / "./a/.//b/./x"), scratch.path / "a/b/x");
  EXPECT_EQ(plain_path(scratch.path / "a/b/..").string(), (scratch.path / "a/").string());
  EXPECT_EQ(plain_path(scratch.path / "a/").string(), (scratch.path / "a/").string());
  EXPECT_EQ(plain_path("/../.."), "/");
  EXPECT_EQ(plain_path("/../x"), "/x");
}

TEST(PlainPath, WhatIsNoFolderStays) {
  const Scratch scratch;
  scratch.write("file", "");
  for (const char* name : {"file/../x", "missing/../x"})  // which the system does not find either
    EXPECT_EQ(plain_path(scratch.path / name), scratch.path / name);
}

TEST(PlainPath, AfterALinkThePathGoesUpFromWhereItLeads) {
  const Scratch scratch;
  fs::create_directories(scratch.path / "here");
  fs::create_directories(scratch.path / "real" / "inner" / "most");
  fs::create_directory_symlink(scratch.path / "real" / "inner", scratch.path / "here" / "link");
  for (const char* folder : {"here", "real"}) std::ofstream(scratch.path / folder / "file") << folder;
  EXPECT_EQ(plain_path(scratch.path / "here/link/../file"), scratch.path / "here/link/../file");
  EXPECT_EQ(plain_path(scratch.path / "here/link/../../x"), scratch.path / "here/link/../../x");
  EXPECT_EQ(plain_path(scratch.path / "here/link/most/../x"), scratch.path / "here/link/x");
  EXPECT_TRUE(fs::equivalent(plain_path(scratch.path / "real/../here/./link/../file"), scratch.path / "real/file"));
}

TEST(PlainPath, RelativeOnes) {
  EXPECT_EQ(plain_path(""), "");
  EXPECT_EQ(plain_path("."), ".");
  EXPECT_EQ(plain_path("../../x"), "../../x");
  EXPECT_EQ(plain_path("./x"), "x");
}

}  // namespace plain_path_test
