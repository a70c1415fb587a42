// SPDX-License-Identifier: Apache-2.0
#include <fstream>
#include <sstream>

#include "tests/harness/comma_locale.hpp"
#include "tests/plugins/read/files.hpp"
#include "tests/plugins/track/sequences.hpp"
#include "tests/plugins/write/writing.hpp"

namespace marrow::test::trajectory_test {

using track::TrackState;
using track::Trajectory;

/// The cells of each line, without quotes: no cell of these has a comma.
std::vector<Strings> table_of(const Trajectory& trajectory) {
  const TemporaryFolder folder;
  writing::write(trajectory, folder / "way.csv");
  std::istringstream lines(bytes_of(folder / "way.csv"));
  std::vector<Strings> table;
  for (std::string line; std::getline(lines, line);) {
    std::erase(line, '"');
    std::istringstream row(line + ",");
    table.emplace_back();
    for (std::string cell; std::getline(row, cell, ',');) table.back().push_back(cell);
  }
  return table;
}

List<Verdict> verdicts_of_frames(int count) {
  List<Verdict> verdicts;
  for (int i = 0; i < count; ++i) {
    Verdict verdict;
    verdict.judgement = i == 1 ? Judgement::doubtful : Judgement::trusted;
    verdict.failure_probability = i == 1 ? 0.25 : 0;
    verdicts.add("000" + std::to_string(i + 1), verdict);
  }
  return verdicts;
}

/// Three frames at 10 Hz: 2 degrees about and 3 mm along the long axis in each; the second one lost.
Trajectory three_frames(int verdicts = 3) {
  const TrackState begin = sequences::begin({{"frame_rate_hz", 10.0}});
  const auto poses = sequences::way(begin, sequences::six(0, 0, 20, 0, 0, 30), 3);
  List<TrackState> states;
  for (int i = 0; i < 3; ++i) {
    TrackState state = begin;
    state.frame = i;
    state.now.world_from_model = poses[std::size_t(i)];
    state.now.covariance.setIdentity();
    state.now.covariance *= 0.01;
    if (i != 1) state.measured.emplace();
    if (i == 1) state.note = "no edges";
    states.add("000" + std::to_string(i + 1), state);
  }
  return output<Trajectory>(
      "track.trajectory", "trajectory",
      {{"states", shipped::list(states, "frame")}, {"verdicts", shipped::list(verdicts_of_frames(verdicts), "frame")}});
}

TEST(Trajectory, TableIsTheSameUnderAnyLocale) {
  const Trajectory trajectory = three_frames();
  const auto before = table_of(trajectory);
  MARROW_NEED_COMMA_LOCALE(german);
  EXPECT_EQ(table_of(trajectory), before);
}

TEST(Trajectory, TableOfTimeMotionAndDeviations) {
  const auto table = table_of(three_frames());
  ASSERT_EQ(table.size(), 4u);
  const auto cell = [&](std::size_t row, const std::string& title) {
    const auto at = std::find(table[0].begin(), table[0].end(), title);
    EXPECT_NE(at, table[0].end()) << title;
    return at == table[0].end() ? std::string() : table[row].at(std::size_t(at - table[0].begin()));
  };
  EXPECT_EQ(cell(3, "name"), "0003");
  EXPECT_NEAR(std::stod(cell(3, "time_s")), 0.2, 1e-9);
  EXPECT_EQ(cell(1, "found") + cell(2, "found") + cell(3, "found"), "101");
  EXPECT_EQ(cell(2, "note"), "no edges");
  EXPECT_NEAR(std::stod(cell(3, "axial_deg")), 4, 1e-6);
  EXPECT_NEAR(std::stod(cell(3, "along_mm")), 6, 1e-6);
  EXPECT_NEAR(std::stod(cell(3, "frontal_mm")), 0, 1e-6);
  EXPECT_NEAR(std::stod(cell(1, "axial_deg")), 0, 1e-9) << "motion from the first frame";
  EXPECT_NEAR(std::stod(cell(2, "deviation_axial_deg")), degrees(0.1), 1e-6);
  EXPECT_NEAR(std::stod(cell(2, "deviation_along_mm")), 0.1, 1e-9);
  EXPECT_NEAR(std::stod(cell(1, "m14_mm")), 10, 1e-9);
  EXPECT_EQ(cell(1, "verdict") + " " + cell(2, "verdict"), "trusted doubtful");
  EXPECT_NEAR(std::stod(cell(2, "failure_probability")), 0.25, 1e-9);
}

TEST(Trajectory, VerdictsOfOtherFramesAreRefused) {
  EXPECT_EQ(message_of([&] { three_frames(2); }),
            "the verdicts are of other frames than the states: 2 and 3; wire both to the same repetition");
}

}  // namespace marrow::test::trajectory_test
