// SPDX-License-Identifier: Apache-2.0
// The exact surfaces and poses of a phantom's fragments, for studies of steps that need no CT.
#include <marrow/plugin.hpp>

#include "marrow/toolbox/phantom/phantom.hpp"

namespace {

using namespace marrow;

struct Known {
  List<Mesh> models;
  List<Truth> truths;
};

Known truth(const phantom::Phantom& phantom) {
  phantom::check_phantom(phantom, "simulate.truth");
  Known known;
  for (const phantom::Fragment& fragment : phantom.fragments) {
    if (fragment.outer.triangles.empty())
      throw Error("simulate.truth: fragment '" + fragment.name +
                  "' has no surface of its own; make it with simulate.fracture");
    known.models.add(fragment.name, fragment.outer);
    known.truths.add(fragment.name, Truth{fragment.world_from_ct});
  }
  return known;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("simulate.truth", truth)
      .summary("Gives the exact surface and pose of each fragment of a phantom")
      .in("phantom", "fragments with their surfaces and exact poses")
      .out("models", &Known::models, "outer surface in CT coordinates, open at the fracture", over("fragment"))
      .out("truths", &Known::truths, "exact pose in the images", over("fragment"));
}
