// SPDX-License-Identifier: Apache-2.0
// Which disc is which bead: with beads missing, with discs that are not beads, and with too few beads.

#include <algorithm>

#include "marrow/toolbox/calibration/correspondence.hpp"
#include "tests/plugins/camera/boards.hpp"
#include "tests/plugins/read/files.hpp"

namespace match_board_test {

using namespace marrow;
using namespace marrow::test;
using Eigen::Vector2d;

struct Seen {
  std::vector<calibration::BeadImage> discs;
  std::vector<int> beads;  ///< of the disc
};

/// The discs of a view, landmarks first. Some of the other beads of each side are missing, and `others` discs are not
/// beads.
Seen see(std::uint64_t seed, std::size_t without_lower, std::size_t without_upper, int others,
         double pincushion_percent, double noise_px = 0.1) {
  phantom::DeviceOptions options;
  options.pincushion_percent = pincushion_percent;
  const Calibration device = phantom::make_device(options);
  phantom::BoardPoses drawn;
  drawn.views = 1;
  std::mt19937_64 random(seed);
  const auto part = [&] { return double(random() >> 11) / 9007199254740992.0; };
  const RigidTransform pose = phantom::draw_board_poses(board(), drawn, seed)[0];
  Seen seen;
  std::size_t left[] = {without_lower, without_upper};
  for (const bool landmark : {true, false})
    for (std::size_t i = 0; i < board().beads.size(); ++i) {
      const calibration::Bead& bead = board().beads[i];
      if (bead.landmark != landmark) continue;
      if (!landmark && left[bead.side] > 0 && i % 2 == seed % 2) {
        --left[bead.side];
        continue;
      }
      const Vector2d at =
          phantom::image_of(device, pose, bead.centre_mm) + noise_px * Vector2d(2 * part() - 1, 2 * part() - 1);
      if (at.x() < 5 || at.y() < 5 || at.x() > 1018 || at.y() > 1018) continue;
      seen.discs.push_back({at, landmark ? 17.0 : 8.5, 100});
      seen.beads.push_back(int(i));
    }
  for (int i = 0; i < others; ++i) {
    seen.discs.push_back({Vector2d(1023 * part(), 1023 * part()), 8, 100});
    seen.beads.push_back(-1);
  }
  return seen;
}

struct Matched {
  int right = 0, wrong = 0;
};

Matched match(const Seen& seen) {
  Matched matched;
  const calibration::ViewPoints points = calibration::match_board(board(), seen.discs, 1024, 1024, "view");
  for (std::size_t i = 0; i < points.beads.size(); ++i) {
    const auto disc = std::find_if(seen.discs.begin(), seen.discs.end(), [&](const calibration::BeadImage& one) {
      return one.centre_px == points.pixels[i];
    });
    const bool is_right = seen.beads[std::size_t(disc - seen.discs.begin())] == points.beads[i];
    (is_right ? matched.right : matched.wrong) += 1;
    EXPECT_EQ(points.board_mm[i], board().beads[std::size_t(points.beads[i])].centre_mm);
  }
  return matched;
}

TEST(MatchBoard, AllThatAreSeenAndNoOthers) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed)
    for (const double pincushion : {0.0, 7.0}) {
      const Seen all = see(seed, 0, 0, 0, pincushion);
      Matched matched = match(all);
      EXPECT_EQ(matched.wrong, 0);
      EXPECT_EQ(matched.right, int(all.discs.size())) << seed << ", " << pincushion << " %";
      const Seen some = see(seed, 4, 6, 12, pincushion);
      matched = match(some);
      EXPECT_EQ(matched.wrong, 0);
      EXPECT_EQ(matched.right, int(some.discs.size()) - 12) << seed << ", " << pincushion << " %";
    }
}

TEST(MatchBoard, ASideIsFoundBySixTenthsOfItsBeads) {
  // 30 beads a side: beside the four that make the map, 16 of the other 26.
  for (const bool lower : {true, false}) {
    const auto of = [&](std::size_t missing) { return see(2, lower ? missing : 0, lower ? 0 : missing, 0, 0, 0); };
    EXPECT_EQ(match(of(9)).wrong, 0);
    const std::string message = test::message_of([&] { match(of(12)); });
    EXPECT_NE(message.find(std::string("side '") + (lower ? "lower" : "upper") + "' of the board is not found"),
              std::string::npos)
        << message;
  }
}

}  // namespace match_board_test
