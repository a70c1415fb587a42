// SPDX-License-Identifier: Apache-2.0
#include "pcl_poisson.hpp"

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/surface/poisson.h>

#include <algorithm>
#include <mutex>

namespace pcl_poisson {
namespace {

/// A triangle as it is; a larger one is divided from its middle, as a diagonal could be that of another polygon too.
void add_polygon(const pcl::Indices& corners, Surface& surface) {
  const std::size_t size = corners.size();
  const auto corner = [&](std::size_t k) { return std::uint32_t(corners[k % size]); };
  if (size == 3) {
    surface.triangles.push_back({corner(0), corner(1), corner(2)});
    return;
  }
  std::array<float, 3> middle{};
  for (std::size_t k = 0; k < size; ++k)
    for (std::size_t axis = 0; axis < 3; ++axis) middle[axis] += surface.vertices[corner(k)][axis] / float(size);
  const auto centre = std::uint32_t(surface.vertices.size());
  surface.vertices.push_back(middle);
  for (std::size_t k = 0; k < size; ++k) surface.triangles.push_back({centre, corner(k), corner(k + 1)});
}

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
  poisson.setOutputPolygons(true);  // its own triangulation never ends where a vertex is not finite
  poisson.setThreads(1);  // with more, sums are added up in an order that differs from run to run
  pcl::PointCloud<pcl::PointNormal> vertices;
  std::vector<pcl::Vertices> polygons;
  {
    static std::mutex mutex;
    const std::lock_guard lock(mutex);
    poisson.performReconstruction(vertices, polygons);
  }
  Surface surface;
  for (const pcl::PointNormal& vertex : vertices) surface.vertices.push_back({vertex.x, vertex.y, vertex.z});
  for (const pcl::Vertices& polygon : polygons) add_polygon(polygon.vertices, surface);
  return surface;
}

}  // namespace pcl_poisson
