// SPDX-License-Identifier: Apache-2.0
// Combines a simulated CT and images with the seeds and the exact truth into a case.
#include <marrow/plugin.hpp>

#include "marrow/toolbox/phantom/phantom.hpp"

namespace {

using namespace marrow;
using phantom::Fragment, phantom::Phantom;

struct CaseOptions {
  std::vector<std::string> wanted{"distal"};
  std::string start = "none";
};

Case assemble(const Volume& ct, const List<View>& views, const Phantom& phantom, const CaseOptions& options) {
  phantom::check_phantom(phantom, "simulate.case");
  check_volume(ct, "simulate.case: CT");
  Case result;
  result.ct = ct;
  result.views = views;
  for (const std::string& name : options.wanted)
    phantom::fragment_named(phantom, name, "simulate.case: the option 'register'");
  for (const Fragment& fragment : phantom.fragments) {
    Seeds seeds{fragment.name, phantom::points_within(ct.grid, fragment.seeds_mm),
                std::find(options.wanted.begin(), options.wanted.end(), fragment.name) != options.wanted.end()};
    if (seeds.wanted) result.truth.add(fragment.name, Truth{fragment.world_from_ct});
    if (seeds.wanted && options.start == "exact") {
      Pose start;
      start.world_from_model = fragment.world_from_ct;
      result.start.add(fragment.name, start);
    }
    if (!seeds.points_mm.empty()) {
      result.seeds.add(fragment.name, std::move(seeds));
    } else if (seeds.wanted) {
      throw Error("simulate.case: fragment '" + fragment.name +
                  "' has no seed within the CT; let simulate.ct cover more of it (range_mm)");
    }
  }
  return result;
}

/// Lets a pipeline use a simulated case in the same way as one that read.case has read.
Case parts_of(const Case& whole) { return whole; }

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("simulate.case", assemble)
      .summary("Makes the case of a simulated patient: CT, views, seeds and the exact truth")
      .in("volume", "CT of the phantom")
      .in("views", "X-ray images of the phantom", over("view"))
      .in("phantom", "bone and fragments, with their seeds and exact poses")
      .out("case", "CT, views, seeds and truth")
      .option("register", &CaseOptions::wanted,
              "fragments whose pose is wanted; other fragments are only segmented, to keep them apart in the CT")
      .option("start", &CaseOptions::start,
              "none: the case has no start; exact: the start is the true pose, for experiments that displace it",
              one_of({"none", "exact"}));
  plugin.node("simulate.case_parts", parts_of)
      .summary("Gives the parts of a simulated case, under the names that read.case uses")
      .in("case", "case of simulate.case")
      .out("ct", &Case::ct, "CT in Hounsfield units")
      .out("seeds", &Case::seeds, "points inside each fragment", over("fragment"))
      .out("views", &Case::views, "X-ray views with cameras", over("view"))
      .out("start", &Case::start, "pose to start from, if the case has one", over("fragment"))
      .out("truth", &Case::truth, "exact pose of each fragment that is registered", over("fragment"));
}
