// SPDX-License-Identifier: Apache-2.0
// Saving a case, also while others do the same.

#include <thread>

#include "tests/framework/fixture.hpp"
#include "tests/framework/identities.hpp"
#include "workbench/case_files.hpp"

namespace {

namespace fs = std::filesystem;

using marrow::workbench::PlannedCase;
using marrow::workbench::with_comments_of;
using marrow::workbench::write_case_files;
using runtime_fixture::Scratch;

TEST(FilesOfCase, AFolderThatIsBeingSavedNamesItsProcessAmongAllHosts) {
  const Scratch scratch;
  std::string name;
  write_case_files(scratch.path / "case", {}, "case", "",
                   [&](const fs::path& staged) { name = staged.filename().string(); });
  EXPECT_TRUE(name.starts_with(".saving-" + marrow::this_process() + "-")) << name;
}

TEST(FilesOfCase, OnlyWhatAnEndedProcessLeftIsRemoved) {
  const Scratch scratch;
  const fs::path place = scratch.path / "case";
  const std::string ended = ".saving-" + runtime_fixture::ended_process() + "-1",
                    elsewhere = ".saving-" + runtime_fixture::process_elsewhere() + "-1";
  for (const std::string& name : {ended, elsewhere, std::string(".saving-4194304-1"), std::string(".saving-")})
    fs::create_directories(place / name);
  write_case_files(place, {}, "case", "", [](const fs::path&) {});
  EXPECT_FALSE(fs::exists(place / ended));
  EXPECT_FALSE(fs::exists(place / ".saving-4194304-1")) << "of an older version";
  EXPECT_TRUE(fs::exists(place / elsewhere));
  EXPECT_TRUE(fs::exists(place / ".saving-"));
  fs::last_write_time(place / elsewhere, fs::file_time_type::clock::now() - std::chrono::hours(25));
  write_case_files(place, {}, "case", "", [](const fs::path&) {});
  EXPECT_FALSE(fs::exists(place / elsewhere)) << "nobody saves that long";
}

TEST(FilesOfCase, OfTwoThatSaveAtTheSameTimeTheLaterOneTakesNothingBack) {
  const Scratch scratch;
  scratch.write("ct.mha", "voxels");
  PlannedCase plan;
  plan.files.push_back({scratch.path / "ct.mha", "ct.mha", true});
  for (int round = 0; round < 100 && !testing::Test::HasFailure(); ++round) {
    const fs::path place = scratch.path / std::to_string(round);
    std::atomic<int> ready{0}, saved{0};
    const auto save = [&] {
      try {
        write_case_files(place, plan, "case", "landmarks", [&](const fs::path&) {
          for (++ready; ready < 2;) std::this_thread::yield();
        });
        ++saved;
      } catch (const marrow::Error&) {  // the other one was quicker
      }
    };
    std::thread other(save);
    save();
    other.join();
    EXPECT_EQ(saved, 1);
    for (const char* name : {"ct.mha", "case.yaml", "landmarks.yaml"}) EXPECT_TRUE(fs::exists(place / name)) << name;
  }
}

// A case that is saved again: comments stay with the parts that did not change, and lost comments are reported.
using Lost = std::vector<std::string>;

const std::string kOlder = R"(# Patient 7, left femur
marrow-case: 1   # the format
ct: ct.mha
views:
  # taken first
  - name: frontal
    image: frontal.png   # 12 March
    camera: {width_px: 6, c_arm: {beta_deg: 0}}
fragments:
  distal:   # the long one
    seeds: [[1, 2, 3]]   # in the condyle
    start:
      rotation: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
      translation_mm: [4, 5, 6]
  # end of the fragments
)";

/// The same case as the workbench writes it.
const std::string kNewer = R"(marrow-case: 1
ct: "ct.mha"
views:
  - name: "frontal"
    image: "frontal.png"
    camera:
      c_arm:
        beta_deg: 0
      width_px: 6
fragments:
  "distal":
    seeds:
      - [1, 2, 3]
    start:
      matrix:
        - [1, 0, 0, 4]
        - [0, 1, 0, 5]
        - [0, 0, 1, 6]
        - [0, 0, 0, 1]
)";

std::string with(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

/// The same document, and the comments that are lost.
void expect_kept(const std::string& newer, const std::string& expected, const Lost& lost = {}) {
  const auto kept = with_comments_of(kOlder, newer);
  EXPECT_EQ(kept.text, expected);
  EXPECT_EQ(kept.lost, lost);
}

TEST(KeptComments, TheSameCaseIsTheSameText) { expect_kept(kNewer, kOlder); }

TEST(KeptComments, OnlyWhatChangedIsWrittenAgain) {
  expect_kept(with(kNewer, "- [1, 2, 3]", "- [1, 2, 3.5]\n      - [7, 8, 9]"),
              with(kOlder, "seeds: [[1, 2, 3]]", "seeds:\n      - [1, 2, 3.5]\n      - [7, 8, 9]"));
  expect_kept(with(kNewer, "\"frontal.png\"", "\"other.png\""), with(kOlder, "frontal.png", "\"other.png\""));
  expect_kept(
      with(kNewer, "beta_deg: 0", "beta_deg: 5"),
      with(kOlder, " {width_px: 6, c_arm: {beta_deg: 0}}", "\n      c_arm:\n        beta_deg: 5\n      width_px: 6"));
}

TEST(KeptComments, ViewsAndFragmentsAreAdded) {
  expect_kept(with(kNewer, "fragments:", "  - name: \"lateral\"\n    image: \"l.png\"\nfragments:"),
              with(kOlder, "\nfragments:", "\n  - name: \"lateral\"\n    image: \"l.png\"\nfragments:"));
  expect_kept(kNewer + "  \"proximal\":\n    seeds:\n      - [4, 5, 6]\n",
              with(kOlder, "[4, 5, 6]\n", "[4, 5, 6]\n  \"proximal\":\n    seeds:\n      - [4, 5, 6]\n"));
}

TEST(KeptComments, WhatIsRemovedTakesItsCommentsWithIt) {
  const std::string start = kNewer.substr(kNewer.find("    start:"));
  expect_kept(
      with(kNewer, start, ""),
      with(kOlder, "    start:\n      rotation: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\n      translation_mm: [4, 5, 6]\n",
           ""));
  const std::string seeds = "    seeds:\n      - [1, 2, 3]\n";
  expect_kept(with(kNewer, seeds, ""), with(kOlder, "    seeds: [[1, 2, 3]]   # in the condyle\n", ""),
              {"# in the condyle"});
}

TEST(KeptComments, ARemovedViewLosesTheCommentsOfTheList) {
  const auto kept = with_comments_of(kOlder, with(kNewer, "\"frontal\"", "\"oblique\""));
  EXPECT_EQ(kept.lost, (Lost{"# taken first", "# 12 March"}));
  EXPECT_NE(kept.text.find("# in the condyle"), std::string::npos);
  EXPECT_NE(kept.text.find("- name: \"oblique\""), std::string::npos);
}

TEST(KeptComments, TextsThatMeanSomethingElseAreNotTheSame) {
  for (const auto& [before, after] :
       {std::pair{"a: '7'", "a: 7"}, {"a: yes", "a: \"yes\""}, {"a: true", "a: \"true\""}})
    EXPECT_EQ(with_comments_of(before, after).text.substr(0, std::string(after).size()), after) << before;
  EXPECT_EQ(with_comments_of("a: 7.0 # x\n", "a: 7\n").text, "a: 7.0 # x\n");
}

TEST(KeptComments, OtherwiseTheHeadStays) {
  const std::string anchors = "# head\n\n# more\na: &x 1\nb: *x  # twice\n";
  const auto kept = with_comments_of(anchors, "a: 1\nb: 2\n");
  EXPECT_EQ(kept.text, "# head\n\n# more\na: 1\nb: 2\n");
  EXPECT_EQ(kept.lost, Lost{"# twice"});
  const auto broken = with_comments_of("# head\n[", "a: 1\n");
  EXPECT_EQ(broken.text, "# head\na: 1\n");
}

TEST(KeptComments, LinesEndAsBefore) {
  EXPECT_EQ(with_comments_of("a: 1  # x\r\nb: 2\r\n", "a: 1\nb: 3\nc:\n  - 4\n").text,
            "a: 1  # x\r\nb: 3\r\nc:\r\n  - 4\r\n");
}

}  // namespace
