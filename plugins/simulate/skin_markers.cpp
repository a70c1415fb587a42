// SPDX-License-Identifier: Apache-2.0
// Markers on the skin around a limb, as a tracking system measures them. Skin slides over the bone: each marker moves
// alone, and all of them move together. The common part does not average out.
#include <marrow/plugin.hpp>

#include "marrow/simulate/vectors.hpp"
#include "marrow/toolbox/phantom/phantom.hpp"

namespace {

using namespace marrow;
using phantom::Fragment;

struct Options {
  int count = 4;
  double radius_mm = 85;
  double length_mm = 150;
  double noise_mm = 2;
  double common_rotation_deg = 5, common_shift_mm = 5;
  double false_rotation_deg = 0;
};

/// Markers around the fragment's long axis, in CT coordinates. Angles and heights are evenly spaced. The order of the
/// heights is shuffled, so the markers do not lie in one plane. Each place is a little off.
std::vector<Eigen::Vector3d> marker_places(const FragmentFrame& frame, const Options& options, Random& random) {
  constexpr double kUneven = 0.1;  // of the step from one marker to the next, and of the radius
  const auto uneven = [&] { return kUneven * (2 * random.uniform_above_0() - 1); };
  std::vector<int> heights;
  for (int i = 0; i < options.count; i += 2) heights.push_back(i);
  for (int i = 1; i < options.count; i += 2) heights.push_back(i);
  const double first_rad = 2 * kPi * random.uniform_above_0();
  std::vector<Eigen::Vector3d> places;
  for (int i = 0; i < options.count; ++i) {
    const double turn_rad = first_rad + 2 * kPi / options.count * (i + uneven()),
                 radius_mm = options.radius_mm * (1 + uneven()),
                 height = (heights[std::size_t(i)] + uneven()) / (options.count - 1) - 0.5;
    places.push_back(frame.origin_mm + frame.axes * Eigen::Vector3d(radius_mm * std::cos(turn_rad),
                                                                    radius_mm * std::sin(turn_rad),
                                                                    options.length_mm * height));
  }
  return places;
}

Landmarks markers_of(const Fragment& fragment, const Options& options, Random& random) {
  const std::vector<Eigen::Vector3d> places = marker_places(fragment.frame, options, random);
  Vector6d slide = Vector6d::Zero();
  slide[2] = radians(options.common_rotation_deg * random.normal() + options.false_rotation_deg);
  for (int axis = 3; axis < 6; ++axis) slide[axis] = options.common_shift_mm * random.normal();
  const RigidTransform world_from_skin = moved(fragment.world_from_ct, fragment.frame, slide);
  Landmarks markers;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const std::string name = formatted("m{}", i + 1);
    const Eigen::Vector3d off_mm = options.noise_mm * phantom::normal_vector(random);
    markers.points.push_back({name, places[i]});
    markers.tracked.push_back({name, world_from_skin * places[i] + off_mm});
  }
  return markers;
}

List<Landmarks> skin_markers(const phantom::Phantom& phantom, const Options& options, Context& context) {
  phantom::check_phantom(phantom, "simulate.skin_markers");
  List<Landmarks> all;
  for (std::size_t f = 0; f < phantom.fragments.size(); ++f) {
    marrow::Random random(context.seed(), f);
    all.add(phantom.fragments[f].name, markers_of(phantom.fragments[f], options, random));
  }
  return all;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("simulate.skin_markers", skin_markers)
      .summary(
          "Simulates tracked markers on the skin around each fragment of a phantom; the skin slides over the bone, "
          "each marker by itself, and all together")
      .in("phantom", "fragments with their axes and exact poses")
      .out("landmarks",
           "places of the markers when the CT was made (mm, CT coordinates), and as they are tracked now (mm, world)",
           over("fragment"))
      .random()
      .option("count", &Options::count, "number of markers around each fragment", at_least(3), at_most(100))
      .option("radius_mm", &Options::radius_mm, "distance of the markers from the fragment's long axis", at_least(1))
      .option("length_mm", &Options::length_mm,
              "part of the long axis along which the markers are spread, with the fragment's centroid in its middle",
              at_least(1))
      .option("noise_mm", &Options::noise_mm, "standard deviation of each tracked coordinate of each marker by itself",
              at_least(0))
      .option("common_rotation_deg", &Options::common_rotation_deg,
              "standard deviation of the rotation of all markers together about the long axis", at_least(0))
      .option("common_shift_mm", &Options::common_shift_mm,
              "standard deviation of the shift of all markers together, along each axis of the fragment", at_least(0))
      .option("false_rotation_deg", &Options::false_rotation_deg,
              "another such rotation that is always the same; for tests of methods that must notice it");
}
