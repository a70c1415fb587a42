// SPDX-License-Identifier: Apache-2.0
// Landmarks of a phantom's fragments as a person or a tracking system would find them. They have noise, so no method
// sees the truth.
#include <marrow/plugin.hpp>

#include "marrow/simulate/vectors.hpp"
#include "marrow/toolbox/phantom/phantom.hpp"

namespace {

using namespace marrow;
using phantom::Fragment;

struct Options {
  int count = 6;
  double noise_px = 1, noise_mm = 0.3;
};

bool is_seen(const Camera& camera, const Eigen::Vector3d& world_mm) {
  const Eigen::Vector2d pixel = project(camera, world_mm);
  return pixel.allFinite() && pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() <= camera.width_px - 1 &&
         pixel.y() <= camera.height_px - 1;
}

/// Points of the surface that all views show. The first is the farthest from the centroid, and each other one is the
/// farthest from those before it. Empty if the views show too few points.
std::vector<Eigen::Vector3d> spread_points(const Fragment& fragment, const List<Camera>& cameras, int count) {
  constexpr std::size_t kCandidates = 4000;
  std::vector<Eigen::Vector3d> candidates;
  for (const Eigen::Vector3d& point : sample_surface(fragment.outer, kCandidates)) {
    bool seen = true;
    for (const Camera& camera : cameras) seen = seen && is_seen(camera, fragment.world_from_ct * point);
    if (seen) candidates.push_back(point);
  }
  if (int(candidates.size()) < count) return {};
  std::vector<double> distances;
  for (const Eigen::Vector3d& candidate : candidates)
    distances.push_back((candidate - fragment.frame.origin_mm).norm());
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < count; ++i) {
    const std::size_t farthest = std::size_t(std::max_element(distances.begin(), distances.end()) - distances.begin());
    points.push_back(candidates[farthest]);
    for (std::size_t c = 0; c < candidates.size(); ++c) {
      const double apart = (candidates[c] - points.back()).norm();
      distances[c] = i == 0 ? apart : std::min(distances[c], apart);
    }
  }
  return points;
}

List<Landmarks> landmarks(const phantom::Phantom& phantom, const List<Camera>* cameras, const Options& options,
                          Context& context) {
  phantom::check_phantom(phantom, "simulate.landmarks");
  const List<Camera> views = cameras ? *cameras : List<Camera>();
  List<Landmarks> all;
  for (std::size_t f = 0; f < phantom.fragments.size(); ++f) {
    const Fragment& fragment = phantom.fragments[f];
    if (fragment.outer.triangles.empty())
      throw Error("simulate.landmarks: fragment '" + fragment.name +
                  "' has no surface of its own; make it with simulate.fracture");
    const std::vector<Eigen::Vector3d> points = spread_points(fragment, views, options.count);
    if (points.empty()) {
      context.warn(
          formatted("fragment '{}' is left out: the views show too little of it for {} landmarks in all of them",
                    fragment.name, options.count));
      continue;
    }
    marrow::Random random(context.seed(), f);
    Landmarks found;
    for (const Eigen::Vector3d& point : points) {
      const std::string name = formatted("p{}", found.points.size() + 1);
      const Eigen::Vector3d world = fragment.world_from_ct * point;
      const auto off = [&](double deviation) { return deviation * random.normal(); };
      found.points.push_back({name, point});
      for (std::size_t v = 0; v < views.size(); ++v) {
        const Eigen::Vector2d pixel = project(views[v], world);
        const double right = off(options.noise_px), down = off(options.noise_px);
        found.seen.push_back({name, views.name(v), pixel + Eigen::Vector2d(right, down)});
      }
      found.tracked.push_back({name, world + options.noise_mm * phantom::normal_vector(random)});
    }
    all.add(fragment.name, std::move(found));
  }
  if (all.empty())
    throw Error(
        formatted("simulate.landmarks: all views together show too little of every fragment for {} landmarks; choose "
                  "fewer, or turn the cameras to a fragment",
                  options.count));
  return all;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("simulate.landmarks", landmarks)
      .summary("Simulates landmarks on each fragment of a phantom, marked in views and tracked, with noise")
      .in("phantom", "fragments with their surfaces and exact poses")
      .in("cameras", "cameras of the views; only points that all of them show are used", over("view"))
      .out("landmarks", "points in CT coordinates (mm), in pixels of the views, and in world coordinates (mm)",
           over("fragment"))
      .random()
      .option("count", &Options::count, "number of landmarks of each fragment, spread over its outer surface",
              at_least(1), at_most(200))
      .option("noise_px", &Options::noise_px, "standard deviation of each coordinate in the views", at_least(0))
      .option("noise_mm", &Options::noise_mm, "standard deviation of each tracked coordinate", at_least(0));
}
