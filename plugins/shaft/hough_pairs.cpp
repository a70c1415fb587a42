// SPDX-License-Identifier: Apache-2.0
// The chapter's extraction of the shaft (3.2): lines by the classical Hough transform (rho = u cos t + v sin t). They
// are paired and accepted by the outer diameter of femora (Noble et al., CORR 1988). The chapter accepts widths within
// one standard deviation, but this rejects a third of all femora in each view. Here widths have a likelihood, and a
// limit of three standard deviations. The borders of the canal are rejected because their bright sides are on the wrong
// side.

#include "marrow/shaft/pairs.hpp"

namespace {

using namespace marrow::shaft;
using marrow::EdgeMap, marrow::EdgePixel;

constexpr int kAngles = 360;    // lines have a direction, so normals go through 360 degrees
constexpr int kVoteSpread = 6;  // degrees; noise rotates a gradient by about this
constexpr double kRhoStep_px = 2;

/// Votes of the edge pixels for directed lines. Each pixel votes only for normals near its own gradient.
struct Accumulator {
  int rhos = 0;
  Eigen::Vector2d centre;
  std::vector<int> votes;  // [angle][rho]
  int& at(int angle, int rho) { return votes[std::size_t(angle) * rhos + rho]; }

  explicit Accumulator(const EdgeMap& edges) : centre(0.5 * edges.width_px, 0.5 * edges.height_px) {
    rhos = int(std::ceil(2 * centre.norm() / kRhoStep_px)) + 3;
    votes.assign(std::size_t(kAngles) * rhos, 0);
    for (const EdgePixel& edge : edges.pixels) {
      const int middle = int(std::lround(marrow::degrees(std::atan2(edge.direction_v, edge.direction_u))));
      for (int angle = middle - kVoteSpread; angle <= middle + kVoteSpread; ++angle) {
        const double rho = normal(angle).dot(Eigen::Vector2d(edge.u_px, edge.v_px) - centre);
        ++at((angle + 2 * kAngles) % kAngles, std::clamp(int(std::lround(rho / kRhoStep_px)) + rhos / 2, 0, rhos - 1));
      }
    }
  }
  static Eigen::Vector2d normal(int angle) {
    return {std::cos(marrow::radians(angle)), std::sin(marrow::radians(angle))};
  }

  /// True if no cell of the neighbourhood has more votes. Of equal cells, only the first is a peak.
  bool is_peak(int angle, int rho) {
    const int votes_here = at(angle, rho);
    for (int a = -3; a <= 3; ++a)
      for (int r = std::max(0, rho - 3); r <= std::min(rhos - 1, rho + 3); ++r) {
        const int other = at((angle + a + kAngles) % kAngles, r);
        if (other > votes_here || (other == votes_here && (a < 0 || (a == 0 && r < rho)))) return false;
      }
    return true;
  }
};

/// The lines with many votes, sorted by votes.
std::vector<Border> hough_lines(const EdgeMap& edges, const Scale& scale) {
  Accumulator accumulator(edges);
  struct Peak {
    int votes, angle, rho;
  };
  std::vector<Peak> peaks;
  const int least = std::max(10, int(0.3 * scale.min_length_px));
  for (int angle = 0; angle < kAngles; ++angle)
    for (int rho = 0; rho < accumulator.rhos; ++rho)
      if (const int votes = accumulator.at(angle, rho); votes >= least && accumulator.is_peak(angle, rho))
        peaks.push_back({votes, angle, rho});
  std::stable_sort(peaks.begin(), peaks.end(), [](const Peak& a, const Peak& b) { return a.votes > b.votes; });
  std::vector<Border> lines;
  for (const Peak& peak : peaks) {
    Border line;
    line.normal = Accumulator::normal(peak.angle);
    line.rho = line.normal.dot(accumulator.centre) + (peak.rho - accumulator.rhos / 2) * kRhoStep_px;
    lines.push_back(line);
  }
  return lines;
}

marrow::ShaftLines hough_pairs(const EdgeMap& edges, const marrow::View& view, const marrow::List<marrow::View>* views,
                               const LineOptions& options, marrow::Context& context) {
  const Scale scale = checked_scale(edges, view, views, options, context);
  return best_pair(edges, view, supported_lines(edges, hough_lines(edges, scale), scale, options), scale, options);
}

}  // namespace

MARROW_PLUGIN(plugin) {
  declare_line_options(plugin.node("shaft.hough_pairs", hough_pairs)
                           .summary("Borders of the shaft: lines from a Hough transform, paired by the likelihood of "
                                    "the outer diameter (section 3.2 of the chapter)"));
}
