// SPDX-License-Identifier: Apache-2.0
#include "closest_points.hpp"

#include <pcl/console/print.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/registration/icp.h>

#include <cmath>

namespace marrow::closest_points {
namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;

Cloud::Ptr cloud_of(const std::vector<Eigen::Vector3d>& points) {
  auto cloud = pcl::make_shared<Cloud>();
  cloud->reserve(points.size());
  for (const Eigen::Vector3d& point : points)
    cloud->push_back(pcl::PointXYZ(float(point.x()), float(point.y()), float(point.z())));
  return cloud;
}

}  // namespace

Result align(const std::vector<Eigen::Vector3d>& points, const std::vector<Eigen::Vector3d>& target,
             const Settings& settings) {
  pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);  // no messages: the result says the same
  pcl::IterativeClosestPoint<pcl::PointXYZ, pcl::PointXYZ, double> icp;
  icp.setInputSource(cloud_of(points));
  icp.setInputTarget(cloud_of(target));
  icp.setMaximumIterations(settings.max_iterations);
  icp.setMaxCorrespondenceDistance(settings.reach);
  icp.setTransformationEpsilon(1e-10);  // squared length of a step in mm
  Cloud moved;
  icp.align(moved);
  using Criteria = pcl::registration::DefaultConvergenceCriteria<double>;
  Result result;
  result.motion = icp.getFinalTransformation();
  result.converged = icp.hasConverged() &&
                     icp.getConvergeCriteria()->getConvergenceState() != Criteria::CONVERGENCE_CRITERIA_ITERATIONS;
  pcl::Indices nearest(1);
  std::vector<float> squared(1);
  double sum = 0;
  for (const Eigen::Vector3d& point : points) {
    const Eigen::Vector3d there = (result.motion * point.homogeneous()).head<3>();
    icp.getSearchMethodTarget()->nearestKSearch(pcl::PointXYZ(float(there.x()), float(there.y()), float(there.z())), 1,
                                                nearest, squared);
    if (squared[0] > settings.reach * settings.reach) continue;
    ++result.paired;
    sum += squared[0];
  }
  if (result.paired) result.rms = std::sqrt(sum / double(result.paired));
  return result;
}

}  // namespace marrow::closest_points
