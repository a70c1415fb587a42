// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "marrow/toolbox/track/track_state.hpp"
#include "shipped.hpp"
#include "tests/harness/comma_locale.hpp"
#include "tests/plugins/read/files.hpp"

namespace tra_test {

using marrow::test::put;
using marrow::test::TemporaryFolder;

const std::string kQuarter = "0,-1,0,1,1,0,0,-2.5,0,0,1,300,0,0,0,1\n";
const std::string kLost = "NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN\n";

class ReadTra : public testing::Test {
 protected:
  shipped::Outputs read(const std::string& text) {
    put(folder / "a.tra", text);
    return shipped::call("read.tra", {}, {{"path", (folder / "a.tra").string()}});
  }
  std::string refusal(const std::string& text) {
    put(folder / "a.tra", text);
    const std::string said = shipped::refusal("read.tra", {}, {{"path", (folder / "a.tra").string()}});
    const std::string where = (folder / "a.tra").string();
    return said.starts_with(where) ? said.substr(where.size()) : said;
  }
  TemporaryFolder folder;
};

TEST_F(ReadTra, AFrameALine) {
  const auto out = read(kQuarter + kLost + kQuarter);
  const auto poses = out.at("poses").as_list<marrow::Pose>();
  EXPECT_EQ(poses.names(), (std::vector<std::string>{"0001", "0003"}));
  EXPECT_EQ(poses[1].world_from_model * Eigen::Vector3d(10, 0, 0), Eigen::Vector3d(1, 7.5, 300));
  const auto& track = out.at("track").as<marrow::track::AutoscoperTrack>();
  ASSERT_EQ(track.world_from_bone.size(), 3u);
  EXPECT_FALSE(track.world_from_bone[1]);
}

TEST_F(ReadTra, WhatIsWrittenIsReadBack) {
  marrow::List<marrow::track::TrackState> states;
  marrow::track::TrackState state;
  state.now.world_from_model.rotation = marrow::rotation_from_vector({0.1, -0.7, 0.3});
  state.now.world_from_model.translation_mm = {1.0 / 3, -200, 1e-7};
  state.measured.emplace();
  states.add("a", state);
  state.measured.reset();
  states.add("b", state);
  const auto track = shipped::call("track.autoscoper", {{"states", shipped::list(states, "frame")}}).at("track");
  const marrow::Catalogue catalogue;
  catalogue.load_writer(track.type).write(track.data.get(), (folder / "b.tra").string());
  const auto again = shipped::call("read.tra", {}, {{"path", (folder / "b.tra").string()}})
                         .at("track")
                         .as<marrow::track::AutoscoperTrack>();
  ASSERT_EQ(again.world_from_bone.size(), 2u);
  EXPECT_LT((again.world_from_bone[0]->rotation - state.now.world_from_model.rotation).norm(), 1e-12);
  EXPECT_EQ(again.world_from_bone[0]->translation_mm, state.now.world_from_model.translation_mm);
  EXPECT_FALSE(again.world_from_bone[1]);
}

// With decimal commas a line has more cells, and 16 of them can be another pose.
TEST_F(ReadTra, IsWrittenTheSameUnderAnyLocale) {
  const marrow::Catalogue catalogue;
  const auto track = read(kQuarter + kLost).at("track");
  const auto written = [&] {
    catalogue.load_writer(track.type).write(track.data.get(), (folder / "w.tra").string());
    return marrow::test::bytes_of(folder / "w.tra");
  };
  const std::string before = written();
  EXPECT_EQ(before, kQuarter + kLost);
  MARROW_NEED_COMMA_LOCALE(german);
  EXPECT_EQ(written(), before);
}

// pandas and others write NaN as an empty cell. If such a line were skipped, all later frames would move by one.
TEST_F(ReadTra, ALineOfEmptyCellsIsAFrameWithoutAPose) {
  const auto out = read(kQuarter + std::string(15, ',') + "\n" + kQuarter + "\n");
  EXPECT_EQ(out.at("poses").as_list<marrow::Pose>().names(), (std::vector<std::string>{"0001", "0003"}));
  EXPECT_FALSE(out.at("track").as<marrow::track::AutoscoperTrack>().world_from_bone.at(1));
}

TEST_F(ReadTra, SaysWhatIsWrong) {
  EXPECT_EQ(refusal("0,-1,0,1,5,1,0,0,-2,5,0,0,1,300,0,0,0,1\n"),
            ":1: expected the 16 numbers of a 4x4 matrix, got 18; a number with a decimal comma counts twice: write "
            "12.5, not 12,5");
  EXPECT_EQ(refusal(kQuarter + "1,2,3\n"), ":2: expected the 16 numbers of a 4x4 matrix, got 3");
  EXPECT_EQ(refusal("0,-1,0,1,1,0,0,x,0,0,1,300,0,0,0,1\n"), ":1:16: expected a number, got 'x'");
  EXPECT_EQ(refusal("2,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1\n"),
            ":1: the matrix is no rigid motion; Autoscoper writes 4x4 matrices row by row, with 0, 0, 0, 1 at the end");
  EXPECT_EQ(refusal(kLost), ": there is no tracked frame in it");
}

}  // namespace tra_test
