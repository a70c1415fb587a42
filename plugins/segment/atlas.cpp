// SPDX-License-Identifier: Apache-2.0
// Segmentation by an atlas: the surface of a whole bone (the template) is fitted to the bone in the CT, by a similarity
// or an affine map. The moved template is the segmentation. (Closest points: Besl and McKay, IEEE Trans. Pattern Anal.
// Mach. Intell. 14, 1992; similarity: Umeyama, same journal 13, 1991.) The template is one unbroken bone. So for
// displaced fragments the result can be right for one fragment at most, as the chapter says and a test shows. A point
// belongs to the fragment of the nearest seed.
#include <Eigen/Geometry>
#include <cmath>
#include <marrow/domain/decompositions.hpp>
#include <marrow/plugin.hpp>
#include "marrow/segment/expansion.hpp"
#include "marrow/segment/fragments.hpp"
#include "marrow/toolbox/field/interior.hpp"

namespace {

using namespace marrow;

using Eigen::Vector3d;
using Map = Eigen::Affine3d;

struct Options {
  double floor_hu = 150;
  bool affine = false;
  int iterations = 60;
  double keep_fraction = 0.9;
  double band_mm = 4;
};

constexpr double kReach_mm = 40;  // largest distance to the bone for which closest points are found

/// Distances to the bone, without regard to fragments. The bone is what the fronts from all seeds reach
/// (expansion.hpp).
class Target {
 public:
  Target(const Volume& volume, const std::vector<std::vector<Vector3d>>& seeds, double floor_hu) : volume_(volume) {
    auto owner = segment::race(volume, seeds, {.floor_hu = floor_hu});
    for (auto& one : owner)
      if (one != segment::kNobody) one = 0;
    const segment::Mask mask = segment::solid(volume.grid, owner, 0, 4);
    field_.grid = segment::grid_of(volume.grid, mask);
    const float half_voxel_mm = float(volume.grid.spacing_mm.minCoeff() / 2);
    for (const std::uint8_t inside : mask.is_inside)
      field_.values_mm.push_back(inside ? -half_voxel_mm : half_voxel_mm);
    for (int z = 0; z < mask.size[2]; ++z)
      for (int y = 0; y < mask.size[1]; ++y)
        for (int x = 0; x < mask.size[0]; ++x)
          if (mask.is_inside[field_.grid.offset(x, y, z)])
            points_mm_.push_back(field_.grid.point_from_index(Vector3d(x, y, z)));
    field::march_distances(field_.grid, field_.values_mm, kReach_mm);
  }
  /// The closest point of the bone's surface, within kReach_mm. `at_edge`: the point is moved to the steepest descent
  /// of the CT, because the fronts end a little outside the bone.
  Vector3d closest(const Vector3d& point, bool at_edge) const {
    const Grid& grid = field_.grid;
    Vector3d index = grid.index_from_point(point), slope;
    for (int k = 0; k < 3; ++k) index[k] = std::clamp(index[k], 0.0, double(grid.size[k] - 1));
    for (int k = 0; k < 3; ++k) {
      const Vector3d step = Vector3d::Unit(k);
      slope[k] = (sample_trilinear(grid, field_.values_mm, index + step) -
                  sample_trilinear(grid, field_.values_mm, index - step)) /
                 (2 * grid.spacing_mm[k]);
    }
    const double distance = sample_trilinear(grid, field_.values_mm, index);
    const Vector3d outward = grid.direction * slope.normalized(),
                   closest = grid.point_from_index(index) - distance * outward;
    return at_edge ? steepest(closest, outward) : closest;
  }
  const std::vector<Vector3d>& points_mm() const { return points_mm_; }

 private:
  Vector3d steepest(const Vector3d& point, const Vector3d& outward) const {
    constexpr double kStep_mm = 0.25;
    const auto hu = [&](int step) {
      Vector3d index = volume_.grid.index_from_point(point + step * kStep_mm * outward);
      for (int k = 0; k < 3; ++k) index[k] = std::clamp(index[k], 0.0, double(volume_.grid.size[k] - 1));
      return sample_trilinear(volume_.grid, volume_.values, index);
    };
    double most = 0;
    int where = 0;
    for (int step = -10; step <= 4; ++step) {
      const double drop = hu(step - 2) - hu(step + 2);
      if (drop > most) most = drop, where = step;
    }
    return point + where * kStep_mm * outward;
  }

  const Volume& volume_;
  SignedField field_;
  std::vector<Vector3d> points_mm_;  // centres of the bone's voxels
};

struct Moments {
  Vector3d centre = Vector3d::Zero();
  Eigen::Matrix3d axes;  // columns; the longest axis is last
  double size = 0;
};

Moments moments_of(double volume, const Vector3d& first, const Eigen::Matrix3d& second) {
  Moments moments;
  moments.centre = first / volume;
  const Eigen::Matrix3d spread = second / volume - moments.centre * moments.centre.transpose();
  const SymmetricEigen<3> eigen = eigen_of_symmetric(spread);
  moments.axes = eigen.vectors;
  if (moments.axes.determinant() < 0) moments.axes.col(0) *= -1;
  moments.size = std::sqrt(spread.trace());
  return moments;
}

/// Moments of points.
Moments moments_of(const std::vector<Vector3d>& points) {
  Vector3d first = Vector3d::Zero();
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
  for (const auto& p : points) {
    first += p;
    second += p * p.transpose();
  }
  return moments_of(double(points.size()), first, second);
}

/// Moments of the volume inside a closed surface: a sum over the tetrahedra between its triangles and the origin.
Moments moments_of(const Mesh& mesh) {
  double volume = 0;
  Vector3d first = Vector3d::Zero();
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
  for (const auto& corners : mesh.triangles) {
    const Vector3d &a = mesh.vertices_mm[corners[0]], &b = mesh.vertices_mm[corners[1]],
                   &c = mesh.vertices_mm[corners[2]], sum = a + b + c;
    const double part = a.dot(b.cross(c)) / 6;
    volume += part;
    first += part / 4 * sum;
    second += part / 20 * (sum * sum.transpose() + a * a.transpose() + b * b.transpose() + c * c.transpose());
  }
  return moments_of(volume, first, second);
}

/// Five start maps: the template as it is, and four that align its centre and axes with the bone's. The four differ in
/// the directions of the axes; mirrored ones are left out.
std::vector<Map> starts(const Mesh& whole, const std::vector<Vector3d>& bone) {
  std::vector<Map> maps{Map::Identity()};
  const Moments from = moments_of(whole), to = moments_of(bone);
  for (const Vector3d& signs : {Vector3d(1, 1, 1), Vector3d(-1, -1, 1), Vector3d(-1, 1, -1), Vector3d(1, -1, -1)}) {
    Map map = Map::Identity();
    map.linear() = to.size / from.size * to.axes * signs.asDiagonal() * from.axes.transpose();
    map.translation() = to.centre - map.linear() * from.centre;
    maps.push_back(map);
  }
  return maps;
}

/// Pairs of template vertices and closest points of the bone, without the pairs of largest distance. Returns their mean
/// distance.
double pair_up(const Target& target, const std::vector<Vector3d>& vertices, const Map& map, double keep_fraction,
               bool at_edge, Eigen::Matrix3Xd& from, Eigen::Matrix3Xd& to) {
  std::vector<std::pair<double, std::size_t>> order;
  std::vector<Vector3d> closest;
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const Vector3d moved = map * vertices[i];
    closest.push_back(target.closest(moved, at_edge));
    order.emplace_back((closest[i] - moved).norm(), i);
  }
  std::sort(order.begin(), order.end());
  order.resize(std::max<std::size_t>(20, std::size_t(keep_fraction * double(order.size()))));
  from.resize(3, Eigen::Index(order.size()));
  to.resize(3, Eigen::Index(order.size()));
  double sum = 0;
  for (std::size_t i = 0; i < order.size(); ++i) {
    from.col(Eigen::Index(i)) = vertices[order[i].second];
    to.col(Eigen::Index(i)) = closest[order[i].second];
    sum += order[i].first;
  }
  return sum / double(order.size());
}

/// Fits the map to the bone. Returns the mean distance of the pairs before the last step.
double fit(const Target& target, const std::vector<Vector3d>& vertices, double keep_fraction, bool at_edge, bool affine,
           int iterations, Map& map) {
  double distance = 0;
  Eigen::Matrix3Xd from, to;
  for (int i = 0; i < iterations; ++i) {
    distance = pair_up(target, vertices, map, keep_fraction, at_edge, from, to);
    if (affine) {
      Eigen::MatrixXd equations(from.cols(), 4);
      equations << from.transpose(), Eigen::VectorXd::Ones(from.cols());
      const Eigen::Matrix<double, 4, 3> solution = equations.colPivHouseholderQr().solve(to.transpose());
      map.linear() = solution.topRows<3>().transpose();
      map.translation() = solution.row(3).transpose();
    } else {
      map.matrix() = Eigen::umeyama(from, to, true);
    }
  }
  return distance;
}

/// The part of the template that is nearer to the fragment's seeds than to the seeds of any other fragment.
SignedField part_of(const SignedField& whole, const List<Seeds>& seeds, std::size_t fragment) {
  SignedField part = whole;
  const auto nearest = [&](std::size_t f, const Vector3d& p) {
    const auto& points = seeds[f].points_mm;
    return *std::min_element(points.begin(), points.end(), [&](const auto& a, const auto& b) {
      return (a - p).squaredNorm() < (b - p).squaredNorm();
    });
  };
  for (int z = 0; z < whole.grid.size[2]; ++z)
    for (int y = 0; y < whole.grid.size[1]; ++y)
      for (int x = 0; x < whole.grid.size[0]; ++x) {
        float& value = part.values_mm[whole.grid.offset(x, y, z)];
        const Vector3d p = whole.grid.point_from_index(Vector3d(x, y, z)), own = nearest(fragment, p);
        for (std::size_t f = 0; f < seeds.size(); ++f) {
          if (f == fragment) continue;
          const Vector3d other = nearest(f, p);  // the border is halfway between both seeds
          const double beyond =
              ((p - own).squaredNorm() - (p - other).squaredNorm()) / (2 * std::max((own - other).norm(), 1e-6));
          value = std::max(value, float(std::min(beyond, double(std::abs(whole.grid.spacing_mm.maxCoeff()) * 100))));
        }
      }
  return part;
}

List<SignedField> atlas(const Volume& volume, const List<Seeds>& seeds, const Mesh& whole, const Options& options,
                        Context& context) {
  check_volume(volume, "volume");
  check_mesh(whole, "template");
  if (!is_closed(whole))
    throw Error("template: a closed surface expected, got one with holes; its inside is not defined");
  if (std::abs(enclosed_volume_mm3(whole)) < 1) throw Error("template: it encloses less than 1 mm^3; is it in mm?");
  const Target target(volume, segment::seed_indices(volume, seeds, options.floor_hu), options.floor_hu);
  std::vector<Vector3d> vertices;
  const std::size_t step = std::max<std::size_t>(1, whole.vertices_mm.size() / 4000);
  for (std::size_t i = 0; i < whole.vertices_mm.size(); i += step) vertices.push_back(whole.vertices_mm[i]);
  Map best = Map::Identity();
  double least_mm = 1e30;
  for (Map map : starts(whole, target.points_mm())) {
    context.check_cancelled();
    const double distance_mm = fit(target, vertices, options.keep_fraction, false, false, options.iterations, map);
    if (distance_mm < least_mm) least_mm = distance_mm, best = map;
  }
  least_mm = fit(target, vertices, options.keep_fraction, true, options.affine, options.iterations, best);
  const std::string line = formatted("the template lies {:.2f} mm from the bone on average, scaled by {:.3f}", least_mm,
                                     std::cbrt(best.linear().determinant()));
  context.debug(line);
  Mesh moved = whole;
  for (Vector3d& vertex : moved.vertices_mm) vertex = best * vertex;
  const SignedField field = field::field_of_mesh(volume.grid, moved, options.band_mm);
  std::vector<SignedField> fields;
  for (std::size_t f = 0; f < seeds.size(); ++f) {
    if (!seeds[f].wanted) continue;
    fields.push_back(part_of(field, seeds, f));
    for (float& value : fields.back().values_mm)
      value = std::clamp(value, -float(options.band_mm), float(options.band_mm));
    if (std::none_of(fields.back().values_mm.begin(), fields.back().values_mm.end(),
                     [](float value) { return value < 0; }))
      throw Error("fragment '" + seeds.name(f) +
                  "': the template does not reach it; give a template of this bone, or place it closer");
  }
  return segment::list_of(seeds, std::move(fields));
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("segment.atlas", atlas)
      .summary("Fits the surface of a whole bone to the bone in the CT; it cannot represent a fracture")
      .in("volume", "CT in Hounsfield units")
      .in("seeds", "points inside each fragment", over("fragment"))
      .in("template", "closed surface of a whole bone of this kind, in mm; it may lie anywhere")
      .out("field", "signed distance to the moved template, cut halfway between the fragments' seeds", over("fragment"))
      .option("floor_hu", &Options::floor_hu,
              "voxels below this value are not bone; the mean of the voxels around a seed must not be below it",
              unit("HU"))
      .option("affine", &Options::affine, "end with an affine map instead of a similarity")
      .option("iterations", &Options::iterations, "iterations of closest points from each of the five starts",
              at_least(1))
      .option("keep_fraction", &Options::keep_fraction,
              "fraction of the template's points to use, those with the smallest distances", at_least(0.3), at_most(1))
      .option("band_mm", &Options::band_mm, "larger distances are clamped to this", at_least(1), at_most(50));
}
