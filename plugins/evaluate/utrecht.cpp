// SPDX-License-Identifier: Apache-2.0
// Whether all signs of data in the manner of Utrecht's gold standard fit: the voxels of each object, projected from the
// gold standard's place, must lie where the masks of the projections show the object.
#include <algorithm>
#include <array>
#include <marrow/plugin.hpp>

#include "marrow/toolbox/exchange/utrecht_file.hpp"

namespace {

using namespace marrow;

constexpr std::size_t kMostPoints = 20000;

struct Options {
  std::filesystem::path path;
  double least_share = 0.9;
};

/// Some voxels of a region, spread over it, in the volume's coordinates.
std::vector<Eigen::Vector3d> points_in(const Grid& grid, const std::vector<std::uint8_t>& inside) {
  const auto count = std::size_t(std::count(inside.begin(), inside.end(), 1));
  const std::size_t step = std::max<std::size_t>(1, count / kMostPoints);
  std::vector<Eigen::Vector3d> points;
  std::size_t seen = 0;
  for (int z = 0; z < grid.size[2]; ++z)
    for (int y = 0; y < grid.size[1]; ++y)
      for (int x = 0; x < grid.size[0]; ++x)
        if (inside[grid.offset(x, y, z)] && seen++ % step == 0)
          points.push_back(grid.point_from_index(Eigen::Vector3d(x, y, z)));
  return points;
}

/// A change of a sign, and what it is in words.
struct Change {
  const char* words;
  std::array<bool, 3> axes{};  ///< of the volume that run the other way
  bool inverse_pose = false, mirror_columns = false, mirror_rows = false;
};

const std::vector<Change>& changes() {
  static const std::vector<Change> all{
      {""},
      {"'world_from_volume' is inverted", {}, true},
      {"the volume's first axis runs the other way", {true, false, false}},
      {"the volume's second axis runs the other way", {false, true, false}},
      {"the volume's slices run the other way", {false, false, true}},
      {"'columns' runs the other way, or the image is mirrored", {}, false, true},
      {"'rows' runs the other way, or the image is upside down", {}, false, false, true},
      {"'columns' and 'rows' run the other way, or the image is turned by a half", {}, false, true, true}};
  return all;
}

/// The share of the points that a mask shows.
double share_shown(const exchange::UtrechtData& data, const std::vector<Eigen::Vector3d>& points,
                   const exchange::UtrechtView& seen, const Change& change) {
  const Grid& grid = data.volume.grid;
  RigidTransform pose = data.world_from_volume;
  if (change.inverse_pose) {
    pose.rotation.transposeInPlace();
    pose.translation_mm = -(pose.rotation * pose.translation_mm).eval();
  }
  std::size_t shown = 0;
  for (Eigen::Vector3d point : points) {
    for (int k = 0; k < 3; ++k)
      if (change.axes[std::size_t(k)]) point[k] = grid.spacing_mm[k] * (grid.size[std::size_t(k)] - 1) - point[k];
    Eigen::Vector2d pixel = project(seen.view.camera, pose * point);
    if (change.mirror_columns) pixel.x() = seen.object.cols - 1 - pixel.x();
    if (change.mirror_rows) pixel.y() = seen.object.rows - 1 - pixel.y();
    const bool is_in = pixel.x() > -0.5 && pixel.y() > -0.5 && pixel.x() < seen.object.cols - 0.5 &&
                       pixel.y() < seen.object.rows - 0.5;
    shown += is_in && seen.object(int(std::lround(pixel.y())), int(std::lround(pixel.x()))) ? 1 : 0;
  }
  return double(shown) / double(std::max<std::size_t>(1, points.size()));
}

Metrics utrecht(const Options& options, Context& context) {
  const exchange::UtrechtData data = exchange::read_utrecht(options.path);
  Metrics metrics;
  std::string faults;
  std::size_t checked = 0;
  for (std::size_t i = 0; i < data.objects.size(); ++i) {
    const std::string& name = data.objects.name(i);
    const std::vector<Eigen::Vector3d> points = points_in(data.volume.grid, data.objects[i].inside);
    const List<exchange::UtrechtView> views = exchange::read_utrecht_views(options.path, name);
    for (const exchange::UtrechtView& seen : views) {
      if (seen.object.empty() || points.empty()) continue;
      ++checked;
      const double share = share_shown(data, points, seen, changes().front());
      metrics.items.push_back({name + "." + seen.view.name + ".shown", 100 * share, "%"});
      const std::string found = formatted("object {}, projection {}: its mask shows {:.0f} % of the object's voxels",
                                          name, seen.view.name, 100 * share);
      if (share >= options.least_share) {
        context.info(found + ": all signs fit");
        continue;
      }
      std::string words = "no single change of a sign explains this";
      double best = options.least_share;
      for (const Change& change : changes())
        if (const double other = share_shown(data, points, seen, change); other >= best) {
          best = other;
          words = formatted("it shows {:.0f} % if {}", 100 * other, change.words);
        }
      faults += (faults.empty() ? "" : "\n") + found + "; " + words;
    }
  }
  if (checked == 0)
    throw Error(
        "no object has both a mask in 3D ('mask') and a mask in a projection ('masks'), so nothing can be checked");
  if (!faults.empty()) throw Error(faults);
  return metrics;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("evaluate.utrecht", utrecht)
      .summary(
          "Projects the objects of Utrecht's gold standard with its cameras, and says whether all signs fit: whether "
          "the masks of the projections show them; if not, what would make them fit")
      .out("metrics", "for each object and projection: the share of the object's voxels that the mask shows")
      .figures({"*.shown"})
      .option("path", &Options::path, "the description (YAML, docs/public-data.md)", required())
      .option("least_share", &Options::least_share, "smallest share that counts as a fit", at_least(0), at_most(1));
}
