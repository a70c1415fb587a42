// SPDX-License-Identifier: Apache-2.0
// What counts as a bead, at each limit. Where beads are found: beside others, on slopes and at borders.
// Which disc is which bead: with beads missing, with discs that are not beads, and with too few beads.
#include <algorithm>
#include <cmath>

#include "tests/plugins/camera/boards.hpp"
#include "tests/plugins/read/files.hpp"

namespace board_test {

using namespace marrow;
using calibration::BeadImage, calibration::find_beads;
using namespace marrow::test;
using Eigen::Vector2d;

/// An ellipse, darker than the rest by `dark`, with an edge a pixel wide.
struct Ellipse {
  double u, v, across_px, down_px, dark = 400;
};

cv::Mat1f image_of(const std::vector<Ellipse>& ellipses, int width = 300, int height = 260, double noise = 0,
                   double slope = 0) {
  cv::Mat1f grey(height, width);
  std::mt19937 random(5);
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u) {
      double value = 1000 + slope * u + 0.5 * slope * v;
      for (const Ellipse& e : ellipses) {
        const double across = 2 * (u - e.u) / e.across_px, down = 2 * (v - e.v) / e.down_px,
                     radius = std::hypot(across, down);
        const double edge = radius > 0 ? (1 - radius) * std::hypot(across, down) /
                                             std::hypot(2 * across / e.across_px, 2 * down / e.down_px)
                                       : 10;
        value -= e.dark * std::clamp(edge + 0.5, 0.0, 1.0);
      }
      grey(v, u) = float(value + noise * (double(random()) / 2147483648.0 - 1));
    }
  return grey;
}

std::size_t count(const std::vector<Ellipse>& ellipses, double largest_px = 24, double least_contrast = 0.2) {
  return find_beads({image_of(ellipses)}, {largest_px, least_contrast}).size();
}

TEST(FindBeads, RoundMeansFourFifths) {
  for (const auto& [across, found] : {std::pair(16.0, 1u), {14.0, 1u}, {13.4, 1u}, {11.4, 0u}, {10.0, 0u}}) {
    EXPECT_EQ(count({{150, 120, across, 16}}), found) << across;
    EXPECT_EQ(count({{150, 120, 16, across}}), found) << across;
  }
}

TEST(FindBeads, OfAtLeastTwelvePixelsAndAtMostTheLargest) {
  // A disc of 12 pixels has a diameter of 3.9; smoothing makes small ones a little larger. The large one sets the scale
  // of the contrasts.
  const Ellipse large{60, 60, 16, 16};
  EXPECT_EQ(count({large, {150, 120, 4.8, 4.8}}), 2u);
  EXPECT_EQ(count({large, {150, 120, 2.2, 2.2}}), 1u);
  EXPECT_EQ(count({{150, 120, 29, 29}}, 24), 1u) << "a third more than the largest may be";
  EXPECT_EQ(count({{150, 120, 33, 33}}, 24), 0u);
  EXPECT_EQ(count({{150, 120, 22, 22}}, 0), 1u) << "a sixteenth of 300 px is 18.75";
  EXPECT_EQ(count({{150, 120, 28, 28}}, 0), 0u);
}

TEST(FindBeads, OfAtLeastTheContrastThatIsToldAndSixDeviationsOfTheNoise) {
  const std::vector<Ellipse> faint{{60, 60, 12, 12, 500}, {150, 120, 12, 12, 140}, {230, 200, 12, 12, 45}};
  EXPECT_EQ(count(faint, 24, 0.05), 3u);
  EXPECT_EQ(count(faint, 24, 0.2), 2u);
  EXPECT_EQ(count(faint, 24, 0.35), 1u);
  const auto noisy = find_beads({image_of(faint, 300, 260, 60)}, {24, 0.01});
  ASSERT_EQ(noisy.size(), 2u);
  EXPECT_NEAR(noisy[0].centre_px.x() + noisy[1].centre_px.x(), 210, 1);
}

TEST(FindBeads, NotWhatTouchesABorderAllFourOfWhichAreAlike) {
  // Discs of 12 px, whose dark pixels begin 6 px from their middle, and half a pixel of edge.
  for (const auto& [away, found] : {std::pair(10.0, 1u), {5.0, 0u}}) {
    EXPECT_EQ(count({{away, 120, 12, 12}}), found) << away;
    EXPECT_EQ(count({{150, away, 12, 12}}), found) << away;
    EXPECT_EQ(count({{299 - away, 120, 12, 12}}), found) << away;
    EXPECT_EQ(count({{150, 259 - away, 12, 12}}), found) << away;
  }
  std::size_t first = 0, last = 0;
  for (double away = 5; away < 10; away += 0.2) {
    const std::size_t left = count({{away, 120, 12, 12}});
    EXPECT_EQ(count({{150, away, 12, 12}}), left) << away;
    EXPECT_EQ(count({{299 - away, 120, 12, 12}}), left) << away;
    EXPECT_EQ(count({{150, 259 - away, 12, 12}}), left) << away;
    (away < 5.1 ? first : last) = left;
  }
  EXPECT_EQ(first, 0u);
  EXPECT_EQ(last, 1u);
}

TEST(FindBeads, CentresOnSlopesAndBesideOthers) {
  // Largest first. The neighbour's darkness would pull a centre by tenths of a pixel.
  const std::vector<Ellipse> beads{{60.3, 70.8, 16, 16},
                                   {84.1, 70.2, 12, 12},
                                   {150.5, 120.25, 9, 9, 250},
                                   {166.2, 131.7, 8.6, 8.6, 300},
                                   {240.4, 200.6, 14, 14, 350}};
  for (const double slope : {0.0, 1.5}) {
    auto found = find_beads({image_of(beads, 300, 260, 0, slope)}, {24, 0.2});
    ASSERT_EQ(found.size(), beads.size());
    for (std::size_t i = 0; i + 1 < found.size(); ++i) EXPECT_GE(found[i].diameter_px, found[i + 1].diameter_px);
    for (const Ellipse& bead : beads) {
      const auto nearest = std::min_element(found.begin(), found.end(), [&](const BeadImage& a, const BeadImage& b) {
        return std::hypot(a.centre_px.x() - bead.u, a.centre_px.y() - bead.v) <
               std::hypot(b.centre_px.x() - bead.u, b.centre_px.y() - bead.v);
      });
      EXPECT_NEAR(nearest->centre_px.x(), bead.u, 0.04) << slope;
      EXPECT_NEAR(nearest->centre_px.y(), bead.v, 0.04) << slope;
      EXPECT_NEAR(nearest->diameter_px, bead.across_px, 0.9) << slope;
      EXPECT_NEAR(nearest->contrast, bead.dark, 0.15 * bead.dark) << slope;
    }
  }
}

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
    EXPECT_HAS(message, std::string("side '") + (lower ? "lower" : "upper") + "' of the board is not found");
  }
}

}  // namespace board_test
