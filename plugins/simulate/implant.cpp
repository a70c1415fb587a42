// SPDX-License-Identifier: Apache-2.0
// Puts an implant of metal into a phantom, in an exactly known pose.
#include <marrow/plugin.hpp>

#include "marrow/simulate/vectors.hpp"
#include "marrow/toolbox/phantom/phantom.hpp"

namespace {

using namespace marrow;
using phantom::ClutteredPhantom;

struct Options {
  std::string body = "implant";
  std::string material = "steel";
  std::array<double, 3> rotation_deg{0, 0, 0}, translation_mm{0, 0, 0};
  double spread_deg = 0, spread_mm = 0;
  int pose_seed = 1;
};

struct Result {
  ClutteredPhantom phantom;
  Truth truth;
  Pose start;
};

/// The pose in which the middle of the surface's box lies at the isocentre, moved by the options.
RigidTransform pose_of(const Mesh& mesh, const Options& options) {
  const Eigen::Vector3d middle = phantom::bounds_of(mesh.vertices_mm).center();
  RigidTransform pose{"world", mesh.frame};
  Eigen::Vector3d turn_rad, shift_mm;
  for (int k = 0; k < 3; ++k) {
    turn_rad[k] = radians(options.rotation_deg[std::size_t(k)]);
    shift_mm[k] = options.translation_mm[std::size_t(k)];
  }
  Random random(std::uint64_t(options.pose_seed), 31);
  const Eigen::Vector3d more_rad = radians(options.spread_deg) * phantom::normal_vector(random);
  shift_mm += options.spread_mm * phantom::normal_vector(random);
  pose.rotation = rotation_from_vector(more_rad) * rotation_from_vector(turn_rad);
  pose.translation_mm = shift_mm - pose.rotation * middle;
  return pose;
}

Result implant(const ClutteredPhantom& given, const Mesh& mesh, const Options& options) {
  check_mesh(mesh, "simulate.implant: the surface");
  if (!is_closed(mesh)) throw Error("simulate.implant: the surface is open, so it has no inside; close its holes");
  phantom::material(options.material);
  Result result{given, {}, {}};
  result.truth.world_from_model = pose_of(mesh, options);
  result.start.world_from_model = result.truth.world_from_model;
  result.start.frame = fragment_frame(mesh);
  phantom::Body body;
  body.name = options.body;
  body.material = options.material;
  body.surface = mesh;
  body.surface.frame = "world";
  for (Eigen::Vector3d& vertex : body.surface.vertices_mm) vertex = result.truth.world_from_model * vertex;
  result.phantom.bodies.push_back(body);
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("simulate.implant", implant)
      .summary("Puts an implant of metal into a phantom, in an exactly known pose; it replaces bone and tissue")
      .in("phantom", "bone, tissue and whatever else is in the beam")
      .in("mesh", "closed surface of the implant")
      .out("phantom", &Result::phantom, "the same with the implant")
      .out("truth", &Result::truth, "exact pose in the images")
      .out("start", &Result::start, "the same pose, as a start for experiments that displace it")
      .option("body", &Options::body, "name of the body in the phantom")
      .option("material", &Options::material, "what it is made of: titanium, steel, copper, plastic, ...")
      .option("rotation_deg", &Options::rotation_deg, "rotation vector about x, y and z of the world")
      .option("translation_mm", &Options::translation_mm, "where the middle of its box lies, from the isocentre")
      .option("spread_deg", &Options::spread_deg, "standard deviation of a further random rotation about each axis",
              at_least(0))
      .option("spread_mm", &Options::spread_mm, "standard deviation of a further random shift along each axis",
              at_least(0))
      .option("pose_seed", &Options::pose_seed, "seed of the random rotation and shift", at_least(0));
}
