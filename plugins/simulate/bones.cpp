// SPDX-License-Identifier: Apache-2.0
// Exact poses and seeds of the bones in a phantom: its fragments, and the bodies that are bones.
#include <marrow/plugin.hpp>
#include <sstream>

#include "marrow/base/names.hpp"
#include "marrow/simulate/posture.hpp"

namespace {

using namespace marrow;
using phantom::Body, phantom::ClutteredPhantom, phantom::Fragment;

struct Options {
  std::vector<std::string> bodies;
};

struct Bones {
  List<Truth> truths;
  List<Seeds> seeds;
  List<Pose> starts;
};

/// Points just below the surface, spread over the body, in its CT coordinates.
std::vector<Eigen::Vector3d> seeds_of(const Body& body) {
  constexpr std::size_t kSeeds = 40;
  constexpr double kDepth_mm = 1;
  std::vector<Eigen::Vector3d> normals(body.surface.vertices_mm.size(), Eigen::Vector3d::Zero());
  for (const auto& triangle : body.surface.triangles) {
    const auto at = [&](int k) { return body.surface.vertices_mm[std::size_t(triangle[std::size_t(k)])]; };
    const Eigen::Vector3d normal = (at(1) - at(0)).cross(at(2) - at(0));
    for (const auto vertex : triangle) normals[std::size_t(vertex)] += normal;
  }
  std::vector<Eigen::Vector3d> seeds;
  const std::size_t step = std::max<std::size_t>(1, normals.size() / kSeeds);
  for (std::size_t i = 0; i < normals.size(); i += step)
    seeds.push_back(body.ct_from_world *
                    Eigen::Vector3d(body.surface.vertices_mm[i] - kDepth_mm * normals[i].normalized()));
  return seeds;
}

/// The names in 'tibia+fibula': tibia and fibula.
std::vector<std::string> parts_of(const std::string& together) {
  std::vector<std::string> parts;
  std::stringstream stream(together);
  for (std::string part; std::getline(stream, part, '+');) parts.push_back(part);
  return parts;
}

const Body& body_named(const ClutteredPhantom& phantom, const std::string& name) {
  std::vector<std::string> known;
  for (const Body& body : phantom.bodies) {
    if (body.name == name) return body;
    known.push_back(body.name);
  }
  throw Error("simulate.bones: the phantom has no body '" + name + "'; " + suggestion(name, known));
}

Bones bones(const ClutteredPhantom& given, const phantom::Posture* posture, const Volume* ct, const Options& options) {
  phantom::check_phantom(given, "simulate.bones");
  const ClutteredPhantom phantom = phantom::in_posture(given, posture);
  Bones bones;
  const auto add = [&](const std::string& name, const RigidTransform& world_from_ct,
                       std::vector<Eigen::Vector3d> seeds_mm) {
    bones.truths.add(name, Truth{world_from_ct});
    if (ct) seeds_mm = phantom::points_within(ct->grid, seeds_mm);
    bones.seeds.add(name, Seeds{name, std::move(seeds_mm), true});
    Pose start;
    start.world_from_model = world_from_ct;
    bones.starts.add(name, start);
  };
  for (const Fragment& fragment : phantom.phantom.fragments)
    add(fragment.name, fragment.world_from_ct, fragment.seeds_mm);
  for (const std::string& together : options.bodies) {
    std::string first;
    RigidTransform world_from_ct;
    std::vector<Eigen::Vector3d> seeds_mm;
    for (const std::string& name : parts_of(together)) {
      const Body& body = body_named(phantom, name);
      if (first.empty()) first = name, world_from_ct = inverse(body.ct_from_world);
      const auto more = seeds_of(body);
      seeds_mm.insert(seeds_mm.end(), more.begin(), more.end());
    }
    add(first, world_from_ct, seeds_mm);
  }
  return bones;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("simulate.bones", bones)
      .summary("Gives exact poses and seeds of the fragments of a phantom, and of further bones among its bodies")
      .in("phantom", "phantom with tissues and bodies")
      .in("posture", "posture of the phantom; if not given, its own")
      .in("volume", "CT of the phantom; if given, seeds outside it are left out")
      .out("truths", &Bones::truths, "exact pose of each bone", over("fragment"))
      .out("seeds", &Bones::seeds, "points inside each bone, in the CT", over("fragment"))
      .out("starts", &Bones::starts, "the same poses, as starts for experiments that displace them", over("fragment"))
      .option("bodies", &Options::bodies,
              "names of the bodies that are bones, such as tibia; those that move together are joined by +, such as "
              "tibia+fibula, and named after the first");
}
