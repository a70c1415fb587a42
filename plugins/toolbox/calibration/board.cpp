// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/calibration/board.hpp"

#include <Eigen/Geometry>
#include <cmath>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/domain/decompositions.hpp"
#include "marrow/toolbox/calibration/correspondence.hpp"
#include "marrow/toolbox/files/yaml_values.hpp"

namespace marrow::calibration {
namespace {

using files::YamlFile;
using files::YamlMap;

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

}  // namespace marrow::calibration
