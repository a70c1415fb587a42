// SPDX-License-Identifier: Apache-2.0
#include "poisson_surface.hpp"

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/surface/poisson.h>

#include <algorithm>
#include <mutex>
#include <unordered_set>

namespace marrow::surface {
namespace {

/// Cuts polygons into triangles so that no edge belongs to more than two triangles. A polygon becomes a fan from a
/// corner whose diagonals are not edges elsewhere. If there is no such corner, the fan starts from the polygon's
/// middle.
class Triangulation {
 public:
  Triangulation(const std::vector<pcl::Vertices>& polygons, Surface& surface) : surface_(surface) {
    for (const pcl::Vertices& polygon : polygons)
      for (std::size_t k = 0; k < polygon.vertices.size(); ++k) joined_.insert(edge(polygon.vertices, k, k + 1));
    for (const pcl::Vertices& polygon : polygons) add(polygon.vertices);
  }

 private:
  static std::uint32_t corner(const pcl::Indices& corners, std::size_t k) {
    return std::uint32_t(corners[k % corners.size()]);
  }
  static std::uint64_t edge(const pcl::Indices& corners, std::size_t k, std::size_t other) {
    const std::uint64_t a = corner(corners, k), b = corner(corners, other);
    return std::min(a, b) << 32 | std::max(a, b);
  }

  void add(const pcl::Indices& corners) {
    const std::size_t size = corners.size();
    for (std::size_t from = 0; from < size; ++from) {
      bool free = true;
      for (std::size_t k = 2; k + 1 < size; ++k) free &= !joined_.count(edge(corners, from, from + k));
      if (!free) continue;
      for (std::size_t k = 2; k + 1 < size; ++k) joined_.insert(edge(corners, from, from + k));
      for (std::size_t k = 1; k + 1 < size; ++k)
        surface_.triangles.push_back({corner(corners, from), corner(corners, from + k), corner(corners, from + k + 1)});
      return;
    }
    std::array<float, 3> middle{};
    for (std::size_t k = 0; k < size; ++k)
      for (std::size_t axis = 0; axis < 3; ++axis)
        middle[axis] += surface_.vertices[corner(corners, k)][axis] / float(size);
    const auto centre = std::uint32_t(surface_.vertices.size());
    surface_.vertices.push_back(middle);
    for (std::size_t k = 0; k < size; ++k)
      surface_.triangles.push_back({centre, corner(corners, k), corner(corners, k + 1)});
  }

  Surface& surface_;
  std::unordered_set<std::uint64_t> joined_;
};

}  // namespace

Surface reconstruct(const std::vector<OrientedPoint>& points, const Settings& settings) {
  auto cloud = pcl::make_shared<pcl::PointCloud<pcl::PointNormal>>();
  cloud->reserve(points.size());
  for (const OrientedPoint& point : points) {
    pcl::PointNormal one;
    std::copy(point.place.begin(), point.place.end(), one.data);
    std::copy(point.normal.begin(), point.normal.end(), one.normal);
    cloud->push_back(one);
  }
  pcl::Poisson<pcl::PointNormal> poisson;
  poisson.setInputCloud(cloud);
  poisson.setDepth(settings.depth);
  poisson.setMinDepth(std::clamp(settings.depth - 2, 1, 5));
  poisson.setScale(settings.scale);
  poisson.setPointWeight(settings.point_weight);
  poisson.setOutputPolygons(true);  // PCL's own triangulation does not terminate if a vertex is not finite
  poisson.setThreads(1);            // with more threads the order of summation differs from run to run
  pcl::PointCloud<pcl::PointNormal> vertices;
  std::vector<pcl::Vertices> polygons;
  {
    static std::mutex mutex;
    const std::lock_guard lock(mutex);
    poisson.performReconstruction(vertices, polygons);
  }
  Surface surface;
  for (const pcl::PointNormal& vertex : vertices) surface.vertices.push_back({vertex.x, vertex.y, vertex.z});
  const Triangulation triangulation(polygons, surface);
  return surface;
}

}  // namespace marrow::surface
