// SPDX-License-Identifier: Apache-2.0
// Cases as read.case reads them back. file_stems() is called itself with names that are too odd for any case that can
// be written.
#include "plugins/write/case.cpp"

#include "tests/plugins/read/files.hpp"
#include "tests/plugins/read/reading.hpp"
#include "tests/plugins/write/example_case.hpp"
#include "tests/plugins/write/writing.hpp"

namespace {

using example_case::example, example_case::example_view;
using marrow::test::case_at;
using WriteCase = marrow::test::InAFolder;
using writing::write;

TEST_F(WriteCase, ReadCaseGivesTheSameToTheLastBit) {
  const marrow::Case written = example();
  write(written, folder / "case");
  const marrow::Case read = case_at(folder / "case");
  EXPECT_EQ(marrow::hash_of(read.ct), marrow::hash_of(written.ct));
  EXPECT_EQ(marrow::hash_of(read.views), marrow::hash_of(written.views));
  EXPECT_EQ(marrow::hash_of(read.seeds), marrow::hash_of(written.seeds));
  EXPECT_EQ(marrow::hash_of(read.start), marrow::hash_of(written.start));
  EXPECT_EQ(marrow::hash_of(read.truth), marrow::hash_of(written.truth));
}

TEST_F(WriteCase, EachViewHasFilesOfItsOwn) {
  EXPECT_EQ(file_stems({"frontal", "view-2", "a/b", "a b", "view-3", "", std::string(300, 'x')}),
            (std::vector<std::string>{"frontal", "view-2", "view-4", "view-5", "view-3", "view-6", "view-7"}));
  marrow::Case written = example();
  written.views = {};
  for (const char* name : {"view-2", "a/b", "a b", "a: b # c"})
    written.views.add(name, example_view(name, CV_16U, double(written.views.size())));
  write(written, folder / "case");
  EXPECT_EQ(marrow::hash_of(case_at(folder / "case").views), marrow::hash_of(written.views));
}

}  // namespace
