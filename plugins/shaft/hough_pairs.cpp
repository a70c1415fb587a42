// SPDX-License-Identifier: Apache-2.0
// The chapter's extraction of the shaft (3.2): lines by the classical Hough transform (rho = u cos t + v sin t), paired
// and accepted by the outer diameter of femora (Noble et al., CORR 1988). The chapter accepts widths within one
// standard deviation, which turns away a third of all femora in each view; here widths have a likelihood and a limit of
// three. The canal's borders lie inside and are turned away by which of their sides is brighter.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <marrow/plugin.hpp>

#include "border.hpp"

namespace {

using namespace marrow::shaft;
using marrow::EdgeMap, marrow::EdgePixel, marrow::ShaftLines, marrow::View;

struct Options {
  std::vector<double> width_mm{28.5,
                               30.3};  // outer diameter of the middle third of femora, side to side and front to back
  std::vector<double> width_deviation_mm{3.3, 3.1};
  double magnification_tolerance = 0.05;
  double min_length_mm = 25;
  double max_angle_deg = 15;
  double tolerance_mm = 1.0;
  double gap_mm = 8;
  int lines = 60;
};

constexpr int kAngles = 360;    // directed lines: the normal turns once around
constexpr int kVoteSpread = 6;  // degrees by which noise turns a gradient
constexpr double kRhoStep_px = 2;
constexpr double kTaper_deg = 6;         // standard deviation of the angle between the borders: a distal femur flares
constexpr double kEvidencePer_mm = 0.1;  // log-likelihood of a millimetre supported on both sides

struct Scale {
  double pixel_mm = 1;  // at the isocentre
  double min_length_px, gap_px;
  Support support;
};

Scale scale_of(const View& view, const Options& options) {
  Scale scale;
  scale.pixel_mm = marrow::pixel_size_at_mm(view.camera, Eigen::Vector3d::Zero());
  if (!(scale.pixel_mm > 0))
    throw marrow::Error("view '" + view.name +
                        "': the world's origin, the isocentre, does not lie in front of the X-ray source");
  scale.min_length_px = options.min_length_mm / scale.pixel_mm;
  scale.gap_px = options.gap_mm / scale.pixel_mm;
  scale.support = {options.tolerance_mm / scale.pixel_mm, std::cos(marrow::radians(15))};
  return scale;
}

/// Votes of the edge pixels for directed lines: each votes for normals near its own gradient only.
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

  /// True where no cell of the neighbourhood has more votes; of equals, the first.
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

/// The lines of most votes, refined on their edge pixels and cut to the longest run of these.
std::vector<Border> hough_lines(const EdgeMap& edges, const Scale& scale, int most) {
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

  std::vector<Border> borders;
  for (const Peak& peak : peaks) {
    if (int(borders.size()) == most) break;
    Border border;
    border.normal = Accumulator::normal(peak.angle);
    border.rho = border.normal.dot(accumulator.centre) + (peak.rho - accumulator.rhos / 2) * kRhoStep_px;
    for (int round = 0; round < 2 && (round == 0 || border.pixels > 0); ++round) {
      Stretch run;
      run.along = along(border);
      std::tie(run.from, run.to) =
          longest_run(supported_positions(edges, border, scale.support, run.along), scale.gap_px);
      border = run.length() < 0.5 * scale.min_length_px ? Border{} : refit(edges, border, scale.support, run, 2);
    }
    const auto same = [&](const Border& other) {
      return other.normal.dot(border.normal) > std::cos(marrow::radians(1)) &&
             (point_at(other, along(border), along(border).dot(accumulator.centre)) -
              point_at(border, along(border), along(border).dot(accumulator.centre)))
                     .norm() < 0.3 * scale.support.tolerance_px;
    };
    if (border.pixels > 0 && std::none_of(borders.begin(), borders.end(), same)) borders.push_back(border);
  }
  return borders;
}

/// Two nearly parallel lines of opposite gradient.
struct Pair {
  Border left, right;  // as seen along the stretch
  Stretch stretch;
  double width_mm = 0, supported_mm = 0;
  double score = 0;    // log-likelihood of width, taper and evidence
  std::string reason;  // why it is not the shaft; empty for a candidate
};

std::string text(const char* format, double a, double b = 0, double c = 0) {
  char buffer[300];
  std::snprintf(buffer, sizeof buffer, format, a, b, c);
  return buffer;
}

/// Where the two lines run to: downwards, or to the right when they lie flat.
Eigen::Vector2d direction_of(const Border& one, const Border& other) {
  const Eigen::Vector2d normal = (one.normal - other.normal).normalized();
  const Eigen::Vector2d direction(-normal.y(), normal.x());
  const bool turn = std::abs(direction.y()) > 0.1 ? direction.y() < 0 : direction.x() < 0;
  return turn ? Eigen::Vector2d(-direction) : direction;
}

/// Distance of the two lines, across the middle of their stretch, at the depth of the isocentre.
double width_of(const Pair& pair, double pixel_mm) {
  const double s = 0.5 * (pair.stretch.from + pair.stretch.to);
  return (point_at(pair.left, pair.stretch.along, s) - point_at(pair.right, pair.stretch.along, s)).norm() * pixel_mm;
}

/// How many standard deviations an outer diameter is from the mean, for the nearer of the directions from which a femur
/// may be seen. That the depth may differ from the isocentre's widens the deviation.
double deviations_of(double width_mm, const Options& options) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < options.width_mm.size(); ++i)
    least = std::min(
        least, std::abs(width_mm - options.width_mm[i]) /
                   std::hypot(options.width_deviation_mm[i], options.magnification_tolerance * options.width_mm[i]));
  return least;
}

std::string allowed_widths(const Options& options) {
  std::string list;
  for (std::size_t i = 0; i < options.width_mm.size(); ++i)
    list += (i ? ", " : "") + text("%.1f +- %.1f", options.width_mm[i], options.width_deviation_mm[i]);
  return list;
}

/// Mean brightness of the image inside the pair, and of strips of 3 mm beyond 1 mm outside its borders.
struct Brightness {
  double inside = 0, outside_left = 0, outside_right = 0;
};
Brightness brightness_of(const cv::Mat& image, const Pair& pair, double pixel_mm) {
  const auto mean_between = [&](auto from_at, auto to_at) {
    constexpr int kAlong = 24, kAcross = 12;
    double sum = 0;
    int count = 0;
    for (int i = 0; i < kAlong; ++i) {
      const double s = pair.stretch.from + (i + 0.5) / kAlong * pair.stretch.length();
      const Eigen::Vector2d from = from_at(s), to = to_at(s);
      for (int k = 0; k < kAcross; ++k) {
        const Eigen::Vector2d at = from + (k + 0.5) / kAcross * (to - from);
        const cv::Point pixel(int(std::lround(at.x())), int(std::lround(at.y())));
        if (pixel.x < 0 || pixel.y < 0 || pixel.x >= image.cols || pixel.y >= image.rows) continue;
        sum += image.depth() == CV_8U    ? image.at<uchar>(pixel)
               : image.depth() == CV_16U ? image.at<std::uint16_t>(pixel)
                                         : image.at<float>(pixel);
        ++count;
      }
    }
    return count ? sum / count : std::numeric_limits<double>::infinity();  // outside the image nothing contradicts
  };
  const auto beside = [&](const Border& border, double distance_mm) {
    return [&pair, &border, shift = distance_mm / pixel_mm](double s) -> Eigen::Vector2d {
      return point_at(border, pair.stretch.along, s) + shift * border.normal;
    };
  };
  return {mean_between(beside(pair.left, 0), beside(pair.right, 0)),
          mean_between(beside(pair.left, 1), beside(pair.left, 4)),
          mean_between(beside(pair.right, 1), beside(pair.right, 4))};
}

/// Fills stretch, width, score, or the reason why the pair is not the shaft.
void judge(const EdgeMap& edges, const cv::Mat& image, const Scale& scale, const Options& options, Pair& pair) {
  const Eigen::Vector2d direction = direction_of(pair.left, pair.right);
  int supported = 0;
  pair.stretch = common_stretch(edges, pair.left, pair.right, scale.support, direction, scale.gap_px, supported);
  pair.supported_mm = supported * scale.pixel_mm;
  const double middle = 0.5 * (pair.stretch.from + pair.stretch.to);
  const Eigen::Vector2d to_left(direction.y(), -direction.x());  // v runs down
  if (to_left.dot(point_at(pair.left, direction, middle) - point_at(pair.right, direction, middle)) < 0)
    std::swap(pair.left, pair.right);
  pair.width_mm = width_of(pair, scale.pixel_mm);
  const double deviations = deviations_of(pair.width_mm, options);
  const double taper =
      marrow::degrees(std::acos(std::clamp(-pair.left.normal.dot(pair.right.normal), 0.0, 1.0))) / kTaper_deg;
  pair.score = kEvidencePer_mm * pair.supported_mm - 0.5 * deviations * deviations - 0.5 * taper * taper;
  const double length_mm = pair.stretch.length() * scale.pixel_mm;
  if (length_mm < options.min_length_mm)
    pair.reason =
        text("its borders run side by side for %.0f mm only, of %.0f mm wanted", length_mm, options.min_length_mm);
  else if (pair.left.normal.dot(to_left) < 0)
    pair.reason =
        text("it is darker outside than inside, as a canal or a gap between bones is (%.1f mm wide)", pair.width_mm);
  else if (deviations > 3)
    pair.reason = text("its width of %.1f mm is not that of a shaft (", pair.width_mm) + allowed_widths(options) +
                  " mm, at most 3 deviations)";
  if (!pair.reason.empty()) return;
  const Brightness mean = brightness_of(image, pair, scale.pixel_mm);
  if (mean.inside >= std::min(mean.outside_left, mean.outside_right))
    pair.reason = text("it is not darker than what lies beside it (mean grey value %.0f inside, %.0f and %.0f outside)",
                       mean.inside, mean.outside_left, mean.outside_right);
}

/// All near-parallel pairs of opposite gradient, judged; candidates first, the most likely first.
std::vector<Pair> pairs_of(const EdgeMap& edges, const cv::Mat& image, const std::vector<Border>& borders,
                           const Scale& scale, const Options& options) {
  std::vector<Pair> pairs;
  const double cosine = std::cos(marrow::radians(options.max_angle_deg));
  for (std::size_t i = 0; i < borders.size(); ++i)
    for (std::size_t j = i + 1; j < borders.size(); ++j) {
      if (-borders[i].normal.dot(borders[j].normal) < cosine) continue;
      Pair pair;
      pair.left = borders[i];
      pair.right = borders[j];
      judge(edges, image, scale, options, pair);
      if (pair.supported_mm > 0.2 * options.min_length_mm) pairs.push_back(std::move(pair));
    }
  std::stable_sort(pairs.begin(), pairs.end(), [](const Pair& a, const Pair& b) {
    return a.reason.empty() != b.reason.empty() ? a.reason.empty() : a.score > b.score;
  });
  return pairs;
}

/// Both borders fitted again over the stretch that they share, until that stretch settles, so that both tell of the
/// same piece of the bone.
Pair settled(const EdgeMap& edges, const cv::Mat& image, Pair pair, const Scale& scale, const Options& options) {
  for (int round = 0; round < 3 && pair.reason.empty(); ++round) {
    pair.left = refit(edges, pair.left, scale.support, pair.stretch, 0);
    pair.right = refit(edges, pair.right, scale.support, pair.stretch, 0);
    if (pair.left.pixels == 0 || pair.right.pixels == 0)
      pair.reason = "a border loses its edge pixels when it is fitted again";
    else
      judge(edges, image, scale, options, pair);
  }
  return pair;
}

/// Whether both pairs show the same piece of shaft: their middles run close to each other over most of the shorter one.
/// A curved border has many lines, whose pairs would crowd out the shaft of another fragment.
bool same_shaft(const Pair& a, const Pair& b) {
  const auto middle = [](const Pair& pair, const Eigen::Vector2d& along, double s) -> Eigen::Vector2d {
    return 0.5 * (point_at(pair.left, along, s) + point_at(pair.right, along, s));
  };
  const Eigen::Vector2d& along = a.stretch.along;
  const double one = along.dot(middle(b, b.stretch.along, b.stretch.from)),
               other = along.dot(middle(b, b.stretch.along, b.stretch.to));
  const double from = std::max(a.stretch.from, std::min(one, other)), to = std::min(a.stretch.to, std::max(one, other));
  if (to - from < 0.5 * std::min(a.stretch.length(), std::abs(other - one))) return false;
  const double s = 0.5 * (from + to);
  const double width = (point_at(a.left, along, s) - point_at(a.right, along, s)).norm();
  return (middle(a, along, s) - middle(b, along, s)).norm() < 0.05 * width;
}

marrow::LineSegment segment_of(const Border& border, const Stretch& stretch) {
  return {point_at(border, stretch.along, stretch.from), point_at(border, stretch.along, stretch.to)};
}

void check_inputs(const EdgeMap& edges, const View& view, const Options& options) {
  marrow::check_view(view);
  const std::string what = "view '" + view.name + "': ";
  const int type = view.image.pixels.type();
  if (type != CV_8UC1 && type != CV_16UC1 && type != CV_32FC1)
    throw marrow::Error(what + "the image must have one channel of 8 or 16 bit whole numbers or 32 bit floats");
  if (edges.width_px != view.camera.width_px || edges.height_px != view.camera.height_px)
    throw marrow::Error(what + "the edge map is for " + std::to_string(edges.width_px) + " x " +
                        std::to_string(edges.height_px) + " pixels, the view has " +
                        std::to_string(view.camera.width_px) + " x " + std::to_string(view.camera.height_px) +
                        "; wire the edges of this view");
  if (edges.pixels.empty())
    throw marrow::Error(what +
                        "the edge map is empty, so there is no shaft in it; look at the image, and lower the "
                        "thresholds of the edge detector");
  if (options.width_mm.empty() || options.width_mm.size() != options.width_deviation_mm.size())
    throw marrow::Error("width_mm has " + std::to_string(options.width_mm.size()) + " numbers and width_deviation_mm " +
                        std::to_string(options.width_deviation_mm.size()) + "; give one deviation for each width");
  for (std::size_t i = 0; i < options.width_mm.size(); ++i)
    if (!(options.width_mm[i] > 0) || !(options.width_deviation_mm[i] > 0))
      throw marrow::Error("width_mm and width_deviation_mm must be positive");
}

ShaftLines hough_pairs(const EdgeMap& edges, const View& view, const Options& options) {
  check_inputs(edges, view, options);
  const Scale scale = scale_of(view, options);
  const std::vector<Border> borders = hough_lines(edges, scale, options.lines);
  std::vector<Pair> pairs = pairs_of(edges, view.image.pixels, borders, scale, options);
  for (std::size_t i = 0; i < std::min<std::size_t>(pairs.size(), 6); ++i)
    if (pairs[i].reason.empty()) pairs[i] = settled(edges, view.image.pixels, pairs[i], scale, options);
  std::stable_sort(pairs.begin(), pairs.end(), [](const Pair& a, const Pair& b) {
    return a.reason.empty() != b.reason.empty() ? a.reason.empty() : a.score > b.score;
  });

  if (pairs.empty() || !pairs[0].reason.empty()) {
    std::string message = "view '" + view.name + "': no shaft pair found: " + std::to_string(borders.size()) + " lines";
    if (pairs.empty()) message += ", none of which run side by side";
    for (std::size_t i = 0; i < std::min<std::size_t>(pairs.size(), 3); ++i)
      message += (i ? "; the next because " : ", best candidate rejected because ") + pairs[i].reason;
    throw marrow::Error(message +
                        "; look at the edges, and set the edge detector's thresholds or this bone's width_mm");
  }
  ShaftLines lines;
  lines.left = segment_of(pairs[0].left, pairs[0].stretch);
  lines.right = segment_of(pairs[0].right, pairs[0].stretch);
  lines.width_mm = pairs[0].width_mm;
  lines.log_likelihood = pairs[0].score;
  std::vector<const Pair*> shafts{&pairs[0]};
  for (std::size_t i = 1; i < pairs.size() && lines.rejected.size() < 20; ++i) {
    if (pairs[i].reason.empty()) {
      if (std::any_of(shafts.begin(), shafts.end(), [&](const Pair* better) { return same_shaft(*better, pairs[i]); }))
        continue;
      shafts.push_back(&pairs[i]);
      pairs[i].reason = text("its log-likelihood of %.1f is below the best one's %.1f (%.1f mm wide)", pairs[i].score,
                             pairs[0].score, pairs[i].width_mm);
    }
    lines.rejected.push_back(
        {segment_of(pairs[i].left, pairs[i].stretch), segment_of(pairs[i].right, pairs[i].stretch), pairs[i].reason});
  }
  return lines;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("shaft.hough_pairs", hough_pairs)
      .summary("Shaft borders: Hough lines, paired by the likelihood of their outer diameter (the chapter's 3.2)")
      .in("edges", "edge pixels of the view")
      .in("view", "X-ray view, for its camera and brightness")
      .out("lines", "the two outer borders of the shaft, and what was turned away")
      .option("width_mm", &Options::width_mm,
              "mean outer diameters, one for each direction from which the bone may be seen")
      .option("width_deviation_mm", &Options::width_deviation_mm, "their standard deviations")
      .option("magnification_tolerance", &Options::magnification_tolerance,
              "standard deviation of the magnification, as a fraction: the shaft need not lie at the isocentre",
              marrow::at_least(0), marrow::at_most(1))
      .option("min_length_mm", &Options::min_length_mm, "shortest stretch, at the isocentre, that both borders share",
              marrow::at_least(1))
      .option("max_angle_deg", &Options::max_angle_deg, "largest angle between the borders: shafts taper",
              marrow::at_least(0), marrow::at_most(45))
      .option("tolerance_mm", &Options::tolerance_mm,
              "largest distance, at the isocentre, of an edge pixel from its line", marrow::at_least(0.01))
      .option("gap_mm", &Options::gap_mm, "widest gap, at the isocentre, that a border may have", marrow::at_least(0))
      .option("lines", &Options::lines, "largest number of lines that are tried", marrow::at_least(2),
              marrow::at_most(1000));
}
