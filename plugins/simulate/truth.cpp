// SPDX-License-Identifier: Apache-2.0
// The exact surfaces and poses of a phantom's fragments, for studies whose images are not those of a case.
#include <marrow/plugin.hpp>

#include "marrow/simulate/posture.hpp"

namespace {

using namespace marrow;

struct Known {
  List<Mesh> models;
  List<Truth> truths;
  List<Seeds> seeds;
  List<Pose> starts;
};

Known truth(const phantom::Phantom& given, const phantom::Posture* posture, const Volume* volume) {
  phantom::check_phantom(given, "simulate.truth");
  const phantom::Phantom phantom = phantom::in_posture({given, {}, {}}, posture).phantom;
  Known known;
  for (const phantom::Fragment& fragment : phantom.fragments) {
    if (fragment.outer.triangles.empty())
      throw Error("simulate.truth: fragment '" + fragment.name +
                  "' has no surface of its own; make it with simulate.fracture");
    known.models.add(fragment.name, fragment.outer);
    known.truths.add(fragment.name, Truth{fragment.world_from_ct});
    Pose start;
    start.world_from_model = fragment.world_from_ct;
    known.starts.add(fragment.name, start);
    if (volume)
      known.seeds.add(fragment.name, {fragment.name, phantom::points_within(volume->grid, fragment.seeds_mm), true});
  }
  return known;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("simulate.truth", truth)
      .summary("Gives the exact surface and pose of each fragment of a phantom")
      .in("phantom", "fragments with their surfaces and exact poses")
      .in("posture", "posture of the phantom; if not given, its own")
      .in("volume", "CT of the phantom, for the seeds")
      .out("models", &Known::models, "outer surface in CT coordinates, open at the fracture", over("fragment"))
      .out("truths", &Known::truths, "exact pose in the images", over("fragment"))
      .out("seeds", &Known::seeds, "points inside each fragment, if its CT is given", over("fragment"))
      .out("starts", &Known::starts, "the same poses, as starts for experiments that displace them", over("fragment"));
}
