// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/calibration/board.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "marrow/base/number_text.hpp"
#include "marrow/domain/decompositions.hpp"
#include "marrow/domain/quantile.hpp"
#include "marrow/toolbox/files/yaml_values.hpp"

namespace marrow::calibration {
namespace {

using files::YamlFile, files::YamlMap;

constexpr double kFlat_mm = 1;             ///< largest distance of a bead from its side's plane
constexpr double kLeastThickness_mm = 10;  ///< between the sides: without depth the focal length is not determined
constexpr double kLandmarkRatio = 1.3;     ///< least ratio of the diameters of landmarks and other beads
constexpr std::size_t kMostBeads = 1000;

std::string millimetres(double length) { return formatted("{:.3g} mm", length); }

struct Flat {
  Eigen::Vector3d centre, normal, first;
};

Flat flat_of(const Board& board, int side) {
  const std::vector<int> indices = board.of_side(side);
  Flat plane{Eigen::Vector3d::Zero(), {}, {}};
  for (int i : indices) plane.centre += board.beads[std::size_t(i)].centre_mm / double(indices.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (int i : indices) {
    const Eigen::Vector3d offset = board.beads[std::size_t(i)].centre_mm - plane.centre;
    spread += offset * offset.transpose();
  }
  const SymmetricEigen<3> eigen = eigen_of_symmetric(spread);
  plane.normal = eigen.vectors.col(0);
  plane.first = eigen.vectors.col(2);
  return plane;
}

void add_beads(const YamlMap& side, const std::string& key, int index, Board& board) {
  const auto node = side.required(key);
  if (!node) return;
  const YamlMap group(side.file(), *node, side.what() + ": " + key, {"diameter_mm", "at_mm"});
  const auto diameter = group.number("diameter_mm");
  if (diameter && !(*diameter > 0 && *diameter < 100))
    group.fault("diameter_mm",
                formatted("diameter_mm: expected a length above 0 and below 100 mm, got {:f}", *diameter));
  for (const Eigen::Vector3d& point : group.points("at_mm"))
    board.beads.push_back({point, diameter.value_or(0), index, key == "landmarks"});
}

void check_side(const Board& board, int side, const std::string& what) {
  const std::vector<int> all = board.of_side(side), landmarks = board.of_side(side, true);
  if (landmarks.size() < 4)
    throw Error(
        formatted("{}: has {} landmarks; a side is found in an image by at least 4, so make 4 of its beads larger than "
                  "the others",
                  what, landmarks.size()));
  if (landmarks.size() > 8)
    throw Error(formatted("{}: has {} landmarks; 4 to 8 are enough, list the rest as beads", what, landmarks.size()));
  if (all.size() < 8) throw Error(formatted("{}: has {} beads; at least 8 are needed", what, all.size()));
  const Flat plane = flat_of(board, side);
  for (int i : all) {
    const double height = std::abs(plane.normal.dot(board.beads[std::size_t(i)].centre_mm - plane.centre));
    if (height > kFlat_mm)
      throw Error(formatted("{}: bead {} lies {} out of the side's plane, at most {} expected; check its coordinates",
                            what, i + 1, millimetres(height), millimetres(kFlat_mm)));
  }
}

void check_sizes_and_places(const Board& board, const std::string& what) {
  double smallest_landmark = 1e9, largest_bead = 0;
  for (const Bead& bead : board.beads)
    (bead.landmark ? smallest_landmark = std::min(smallest_landmark, bead.diameter_mm)
                   : largest_bead = std::max(largest_bead, bead.diameter_mm));
  if (smallest_landmark < kLandmarkRatio * largest_bead)
    throw Error(
        formatted("{}: landmarks of {:.3g} mm are not told apart from beads of {:.3g} mm; expected at least 1.3 times "
                  "their diameter",
                  what, smallest_landmark, largest_bead));
  for (std::size_t i = 0; i < board.beads.size(); ++i)
    for (std::size_t k = 0; k < i; ++k)
      if ((board.beads[i].centre_mm - board.beads[k].centre_mm).norm() <
          0.5 * (board.beads[i].diameter_mm + board.beads[k].diameter_mm))
        throw Error(formatted("{}: beads {} and {} (counted as the file lists them) overlap; a bead is given twice?",
                              what, k + 1, i + 1));
}

void check_sides(const Board& board, const std::string& what) {
  const Flat first = flat_of(board, 0), second = flat_of(board, 1);
  const double thickness = std::abs(first.normal.dot(second.centre - first.centre));
  const double tilt = std::acos(std::min(1.0, std::abs(first.normal.dot(second.normal))));
  if (tilt > 0.1) throw Error(what + ": the two sides are not parallel; check their coordinates");
  if (thickness < kLeastThickness_mm)
    throw Error(
        formatted("{}: the two sides are {:.3g} mm apart; at least {:.3g} mm are needed to tell the focal length from "
                  "the distance",
                  what, thickness, kLeastThickness_mm));
  for (int side : {0, 1})
    if (can_be_mistaken(board, side, side))
      throw Error(what + ": side '" + board.sides[std::size_t(side)] +
                  "' looks the same when it is turned or mirrored, so its beads cannot be told apart; move one of its "
                  "landmarks");
  if (can_be_mistaken(board, 0, 1) || can_be_mistaken(board, 1, 0))
    throw Error(what +
                ": the two sides look the same, so they cannot be told apart; place the landmarks of one differently");
}

constexpr double kNoiseFactor = 6;       ///< a bead is darker by at least this many standard deviations of the noise
constexpr double kLeastRoundness = 0.8;  ///< shorter axis divided by longer axis
constexpr double kLeastArea_px = 12;

/// The morphological closing of the image minus the image itself: how much darker a pixel is than its surroundings. The
/// closing is wider than a bead.
cv::Mat1f darkness_of(const cv::Mat1f& image, double largest_px) {
  const int width = 2 * int(std::ceil(0.7 * largest_px)) + 1;
  cv::Mat1f smooth, background;
  cv::GaussianBlur(image, smooth, {0, 0}, 1.0, 1.0, cv::BORDER_REPLICATE);
  cv::morphologyEx(smooth, background, cv::MORPH_CLOSE, cv::getStructuringElement(cv::MORPH_RECT, {width, width}));
  return background - smooth;
}

/// The least darkness of a pixel that may belong to a bead.
double threshold_of(const cv::Mat1f& darkness, double min_contrast) {
  std::vector<float> values(darkness.begin(), darkness.end());
  const double middle = quantile_in_place(values, 0.5), darkest = quantile_in_place(values, 0.9995);
  for (float& value : values) value = std::abs(value - float(middle));
  const double noise = 1.4826 * quantile_in_place(values, 0.5);
  return middle + std::max(kNoiseFactor * noise, min_contrast * (darkest - middle));
}

/// Area, centre and second moments of the pixels of a component that are darker than half its peak.
struct Blob {
  double area = 0, peak = 0;
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
};

Blob blob_at_half_peak(const cv::Mat1f& darkness, const cv::Mat1i& labels, int label, const cv::Rect& box) {
  Blob blob;
  for (int v = box.y; v < box.br().y; ++v)
    for (int u = box.x; u < box.br().x; ++u)
      if (labels(v, u) == label) blob.peak = std::max(blob.peak, double(darkness(v, u)));
  for (int v = box.y; v < box.br().y; ++v)
    for (int u = box.x; u < box.br().x; ++u) {
      if (labels(v, u) != label || darkness(v, u) < 0.5 * blob.peak) continue;
      const Eigen::Vector2d at(u, v);
      ++blob.area;
      blob.centre += at;
      blob.spread += at * at.transpose();
    }
  blob.centre /= blob.area;
  blob.spread = blob.spread / blob.area - blob.centre * blob.centre.transpose() + Eigen::Matrix2d::Identity() / 12;
  return blob;
}

/// A filled ellipse has the area 4 pi sqrt(det of its second moments). Two merged beads, a ring or a corner have a
/// smaller one.
bool is_round(const Blob& blob) {
  const Eigen::Vector2d axes = eigen_of_symmetric(blob.spread).values;
  const double filled = blob.area / (4 * 3.14159265358979 * std::sqrt(axes[0] * axes[1]));
  return axes[0] > kLeastRoundness * kLeastRoundness * axes[1] && filled > 0.9 && filled < 1.1;
}

/// A plane fitted to the grey values of a ring around a bead. Pixels that another bead darkens are left out.
class Background {
 public:
  Background(const cv::Mat1f& image, const Eigen::Vector2d& centre, double inner, double outer) {
    std::vector<Eigen::Vector3d> samples;
    for (int v = std::max(0, int(centre.y() - outer)); v <= std::min(image.rows - 1, int(centre.y() + outer) + 1); ++v)
      for (int u = std::max(0, int(centre.x() - outer)); u <= std::min(image.cols - 1, int(centre.x() + outer) + 1);
           ++u) {
        const double distance = std::hypot(u - centre.x(), v - centre.y());
        if (distance > inner && distance < outer) samples.emplace_back(u - centre.x(), v - centre.y(), image(v, u));
      }
    centre_ = centre;
    for (int round = 0; round < 4; ++round) fit(samples);
  }
  double at(double u, double v) const {
    return plane_[0] + plane_[1] * (u - centre_.x()) + plane_[2] * (v - centre_.y());
  }

 private:
  void fit(std::vector<Eigen::Vector3d>& samples) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& sample : samples) {
      const Eigen::Vector3d row(1, sample.x(), sample.y());
      normal += row * row.transpose();
      right += row * sample.z();
    }
    plane_ = solve_symmetric(normal, right);
    double squares = 0;
    const auto off = [&](const Eigen::Vector3d& s) { return s.z() - plane_.dot(Eigen::Vector3d(1, s.x(), s.y())); };
    for (const Eigen::Vector3d& sample : samples) squares += off(sample) * off(sample);
    const double deviation = std::sqrt(squares / double(std::max<std::size_t>(1, samples.size())));
    std::vector<Eigen::Vector3d> kept;
    for (const Eigen::Vector3d& sample : samples)
      if (off(sample) > -2 * deviation) kept.push_back(sample);
    if (kept.size() >= 12) samples.swap(kept);
  }

  Eigen::Vector2d centre_;
  Eigen::Vector3d plane_ = Eigen::Vector3d::Zero();
};

/// Centre of mass of the darkness in a window. The window is centred on the result, repeatedly.
Eigen::Vector2d refined_centre(const cv::Mat1f& image, Eigen::Vector2d centre, double diameter) {
  const double window = 0.5 * diameter + 2;
  for (int round = 0; round < 5; ++round) {
    const Background background(image, centre, window, window + 4);
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int v = std::max(0, int(centre.y() - window)); v <= std::min(image.rows - 1, int(centre.y() + window) + 1);
         ++v)
      for (int u = std::max(0, int(centre.x() - window)); u <= std::min(image.cols - 1, int(centre.x() + window) + 1);
           ++u) {
        // Weights fall to 0 over the last pixel, so that the result changes smoothly when the window moves.
        const double weight = std::clamp(window - std::hypot(u - centre.x(), v - centre.y()), 0.0, 1.0);
        if (weight > 0) sum += weight * (background.at(u, v) - image(v, u)) * Eigen::Vector3d(u, v, 1);
      }
    if (!(sum.z() > 0)) return centre;
    const Eigen::Vector2d next = sum.head<2>() / sum.z();
    if ((next - centre).norm() > window) return centre;
    const bool done = (next - centre).norm() < 1e-3;
    centre = next;
    if (done) break;
  }
  return centre;
}

}  // namespace

std::vector<int> Board::of_side(int side, bool landmarks_only) const {
  std::vector<int> indices;
  for (std::size_t i = 0; i < beads.size(); ++i)
    if (beads[i].side == side && (beads[i].landmark || !landmarks_only)) indices.push_back(int(i));
  return indices;
}

std::vector<Eigen::Vector2d> Board::flat_mm(int side, const std::vector<int>& indices) const {
  const Flat plane = flat_of(*this, side);
  const Eigen::Vector3d second = plane.normal.cross(plane.first);
  std::vector<Eigen::Vector2d> points;
  for (int i : indices) {
    const Eigen::Vector3d offset = beads[std::size_t(i)].centre_mm - plane.centre;
    points.emplace_back(plane.first.dot(offset), second.dot(offset));
  }
  return points;
}

Board read_board_file(const std::filesystem::path& path) {
  YamlFile file(path);
  const YamlMap map(file, file.root(), "board", {"marrow-bead-board", "sides"});
  files::check_version(map, "marrow-bead-board");
  Board board;
  const auto sides = map.required("sides");
  if (sides && (!sides->IsMap() || sides->size() != 2))
    map.fault("sides", "sides: expected the board's two sides by name, each with landmarks and beads");
  else if (sides) {
    const YamlMap by_name(file, *sides, "sides", files::FreeKeys{});
    for (const std::string& name : by_name.keys()) {
      board.sides.push_back(name);
      const YamlMap side(file, by_name.node(name), "side '" + name + "'", {"landmarks", "beads"});
      for (const char* key : {"landmarks", "beads"}) add_beads(side, key, int(board.sides.size()) - 1, board);
    }
  }
  file.finish();
  if (board.beads.size() > kMostBeads)
    throw Error(formatted("{}: has {} beads; at most 1000 can be told apart", path.string(), board.beads.size()));
  for (int side : {0, 1}) check_side(board, side, path.string() + ": side '" + board.sides[std::size_t(side)] + "'");
  check_sizes_and_places(board, path.string());
  check_sides(board, path.string());
  return board;
}

std::vector<BeadImage> find_beads(const Image& image, const BeadSearch& search) {
  if (image.pixels.empty() || image.pixels.channels() != 1)
    throw Error("the image is empty or has colours; an X-ray has one channel");
  cv::Mat1f grey;
  image.pixels.convertTo(grey, CV_32F);
  const double largest = search.largest_px > 0 ? search.largest_px : image.width() / 16.0;
  const cv::Mat1f darkness = darkness_of(grey, largest);
  const double threshold = threshold_of(darkness, search.min_contrast);
  const cv::Mat dark = darkness > threshold;
  cv::Mat1i labels, boxes;
  cv::Mat centroids;
  const int count = cv::connectedComponentsWithStats(dark, labels, boxes, centroids, 8);
  std::vector<BeadImage> beads;
  for (int label = 1; label < count; ++label) {
    const cv::Rect box(boxes(label, cv::CC_STAT_LEFT), boxes(label, cv::CC_STAT_TOP), boxes(label, cv::CC_STAT_WIDTH),
                       boxes(label, cv::CC_STAT_HEIGHT));
    if (box.x <= 1 || box.y <= 1 || box.br().x >= grey.cols - 1 || box.br().y >= grey.rows - 1) continue;
    if (boxes(label, cv::CC_STAT_AREA) < kLeastArea_px || std::max(box.width, box.height) > 1.3 * largest) continue;
    const Blob blob = blob_at_half_peak(darkness, labels, label, box);
    if (blob.area < kLeastArea_px || !is_round(blob)) continue;
    const double diameter = 2 * std::sqrt(blob.area / 3.14159265358979);
    beads.push_back({refined_centre(grey, blob.centre, diameter), diameter, blob.peak});
  }
  std::stable_sort(beads.begin(), beads.end(),
                   [](const BeadImage& a, const BeadImage& b) { return a.diameter_px > b.diameter_px; });
  return beads;
}

}  // namespace marrow::calibration
