// SPDX-License-Identifier: Apache-2.0
// The chapter's narrow-band level set (Eq 5 and 6 as corrected, see front.hpp). There is one front for each fragment.
// All fronts move together and never into each other. They start where the fast expansion from the seeds ends
// (expansion.hpp), with everything inside filled. They come to rest on the edges in the CT.
#include <marrow/plugin.hpp>

#include "marrow/segment/expansion.hpp"
#include "marrow/segment/front.hpp"

namespace {

using namespace marrow;
using segment::EdgeProfile, segment::Force, segment::Front;

struct Options {
  double band_voxels = 5;
  double sigma_mm = 0.7;
  double cleft_mm = 3.2, cleft_fraction = 0.1;
  double floor_hu = 150;
  double propagation = 0;
  double edge_hu = 150, edge_sigma_mm = 0.4;
  double blur_mm = 0.7;
  double cortex_hu = 1200;
  double curvature_mm = 0.1;
  double stop_speed = 0.03;
  int max_iterations = 32;
};

constexpr double kStepVoxels = 0.4;  // advection and curvature together stay stable (Courant-Friedrichs-Lewy condition)
constexpr int kStepsPerCycle = 2;
constexpr double kNear_mm = 10;  // farther than the fronts of two fragments move towards each other

void keep_all_apart(std::vector<Front>& fronts) {
  for (std::size_t a = 0; a < fronts.size(); ++a)
    for (std::size_t b = a + 1; b < fronts.size(); ++b) Front::keep_apart(fronts[a], fronts[b]);
}

std::vector<Front> begin(const Volume& volume, const List<Seeds>& seeds, const Options& options, Context& context) {
  const auto indices = segment::seed_indices(volume, seeds, options.floor_hu);
  context.progress(0, "racing");
  const auto owner =
      segment::race(volume, indices, {options.sigma_mm, options.cleft_mm, options.cleft_fraction, options.floor_hu});
  std::vector<Front> fronts;
  for (std::size_t f = 0; f < seeds.size(); ++f) {
    context.check_cancelled();
    context.progress(0.3 + 0.2 * double(f) / double(seeds.size()), "filling");
    const segment::Mask mask = segment::solid_of(volume.grid, owner, seeds, f);
    fronts.emplace_back(volume.grid, options.band_voxels * volume.grid.spacing_mm[0], mask);
  }
  return fronts;
}

void log_fronts(const std::vector<Front>& fronts, const List<Seeds>& seeds, int step, double step_mm,
                Context& context) {
  for (std::size_t f = 0; f < fronts.size(); ++f) {
    const std::string line =
        formatted("step {}, {}: mean speed {:.3f} of F0, {} voxels in the moving band", step, seeds.name(f),
                  fronts[f].mean_motion_mm() / (kStepsPerCycle * step_mm), fronts[f].band_voxels());
    context.debug(line);
  }
}

/// A fragment that is not wanted matters only where it meets a wanted one, so elsewhere its front need not move.
void hold_unwanted(const List<Seeds>& seeds, std::vector<Front>& fronts) {
  std::vector<const Front*> wanted;
  for (std::size_t f = 0; f < fronts.size(); ++f)
    if (seeds[f].wanted) wanted.push_back(&fronts[f]);
  for (std::size_t f = 0; f < fronts.size(); ++f)
    if (!seeds[f].wanted) fronts[f].hold_far_from(wanted, kNear_mm);
}

/// Moves all fronts together until each of them rests on the wall of its bone. The wall is the steepest descent of the
/// CT along the normal. Where there is none (at the mouth of a canal), the front rests where it started.
void move(const Volume& volume, const List<Seeds>& seeds, const Options& options, std::vector<Front>& fronts,
          Context& context) {
  const EdgeProfile profile(options.edge_sigma_mm, options.blur_mm, options.cortex_hu);
  const Force force{options.propagation, options.curvature_mm, options.edge_hu, options.floor_hu};
  const double step_mm = kStepVoxels * volume.grid.spacing_mm.minCoeff();
  for (int step = 0; step < options.max_iterations; step += kStepsPerCycle) {
    context.check_cancelled();
    context.progress(0.5 + 0.5 * step / options.max_iterations, "moving");
    if (options.cortex_hu > 0 && step % (2 * kStepsPerCycle) == 0)
      for (Front& front : fronts) front.find_thin_cortex(volume, profile);
    for (int k = 0; k < kStepsPerCycle; ++k) {
      for (Front& front : fronts) {
        front.evaluate(volume, profile, force);
        front.advance(step_mm);
      }
      keep_all_apart(fronts);
    }
    bool at_rest = true;
    for (Front& front : fronts) {
      front.redistance();
      at_rest &= front.rest(options.stop_speed * kStepsPerCycle * step_mm);
    }
    log_fronts(fronts, seeds, step + kStepsPerCycle, step_mm, context);
    if (at_rest) return;
  }
}

void check(const Volume& volume) {
  check_volume(volume, "volume");
  for (int size : volume.grid.size)
    if (size < 4)
      throw Error(formatted("volume: at least 4 voxels along each axis expected, got {} x {} x {}", volume.grid.size[0],
                            volume.grid.size[1], volume.grid.size[2]));
}

List<SignedField> level_set_fields(const Volume& volume, const List<Seeds>& seeds, const Options& options,
                                   Context& context) {
  check(volume);
  std::vector<Front> fronts = begin(volume, seeds, options, context);
  hold_unwanted(seeds, fronts);
  move(volume, seeds, options, fronts, context);
  List<SignedField> fields;
  for (std::size_t f = 0; f < fronts.size(); ++f) {
    if (fronts[f].has_vanished())
      throw Error("fragment '" + seeds.name(f) +
                  "': the front vanished, as its seeds lie too close to the edge of the bone; move them towards the "
                  "middle of the cortical or spongy bone");
    if (!seeds[f].wanted) continue;
    fronts[f].finish();
    fields.add(seeds.name(f), SignedField{volume.grid, fronts[f].values_mm()});
  }
  if (fields.empty()) throw Error("seeds: no fragment is wanted; set wanted: true for at least one");
  return fields;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("segment.level_set", level_set_fields)
      .summary("3D narrow-band level set whose fronts are drawn to the CT's edges along their normals")
      .in("volume", "CT in Hounsfield units")
      .in("seeds", "points inside each fragment", over("fragment"))
      .out("field", "signed distance to the outer surface of each wanted fragment", over("fragment"))
      .option("band_voxels", &Options::band_voxels, "half the width of the narrow band, in in-plane voxels",
              at_least(3), at_most(20), unit("voxels"))
      .option("sigma_mm", &Options::sigma_mm,
              "standard deviation of the Gaussian that smooths the CT for the first expansion from the seeds",
              at_least(0.1), at_most(5))
      .option("cleft_mm", &Options::cleft_mm, "widest dark cleft that slows the first expansion", at_least(0.5),
              at_most(10))
      .option("cleft_fraction", &Options::cleft_fraction,
              "a cleft that is darker than its walls by this fraction of their value slows the first expansion e times",
              at_least(0.02), at_most(1))
      .option(
          "floor_hu", &Options::floor_hu,
          "no front advances into voxels below this value; the mean of the voxels around a seed must not be below it",
          unit("HU"))
      .option("propagation", &Options::propagation, "F0: speed at which a front expands if no edge stops it",
              at_least(0), at_most(1))
      .option("edge_hu", &Options::edge_hu, "K: drop of the CT's value at an edge that halves the speed", at_least(1),
              unit("HU"))
      .option("edge_sigma_mm", &Options::edge_sigma_mm,
              "standard deviation of the Gaussian derivative along the normal", at_least(0.1), at_most(5))
      .option("blur_mm", &Options::blur_mm, "standard deviation of the CT's own blur", at_least(0), at_most(5))
      .option("cortex_hu", &Options::cortex_hu,
              "CT value of dense cortical bone, used to correct the position of a thin cortex's edge; 0: no correction",
              at_least(0), unit("HU"))
      .option("curvature_mm", &Options::curvature_mm, "epsilon: weight of the curvature", at_least(0), at_most(0.5))
      .option("stop_speed", &Options::stop_speed,
              "a part of a front that is slower than this comes to rest; in units in which F0 is 1", at_least(0.001),
              at_most(0.5))
      .option("max_iterations", &Options::max_iterations, "largest number of time steps", at_least(0));
}
