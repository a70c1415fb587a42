// SPDX-License-Identifier: Apache-2.0
#include <tbb/parallel_for.h>

#include <cstdio>
#include <marrow/plugin.hpp>

#include "front.hpp"
#include "interior.hpp"
#include "seed_points.hpp"

namespace {

using level_set::EdgeProfile;
using level_set::Force;
using level_set::Front;
using marrow::Context;
using marrow::List;
using marrow::Seeds;
using marrow::SignedField;
using marrow::Volume;

struct Options {
  double band_voxels = 5;
  double curvature_mm = 0.1;
  double edge_hu = 150;
  double floor_hu = 150;
  double expand_sigma_mm = 0.8;
  double edge_sigma_mm = 0.4;
  double blur_mm = 0.7;
  double refine_curvature_mm = 0.1;
  double stop_speed = 0.05;
  int max_steps = 3000;
  int refine_steps = 20;
};

constexpr double kStepVoxels = 0.4;  // advection and curvature together stay stable (Courant, Friedrichs and Lewy)
constexpr int kStepsPerCycle = 3, kCyclesPerRest = 3;

void keep_all_apart(std::vector<Front>& fronts) {
  for (std::size_t a = 0; a < fronts.size(); ++a)
    for (std::size_t b = a + 1; b < fronts.size(); ++b) Front::keep_apart(fronts[a], fronts[b]);
}

void log_fronts(const std::vector<Front>& fronts, const List<Seeds>& seeds, const char* phase, int step,
                Context& context) {
  for (std::size_t f = 0; f < fronts.size(); ++f) {
    char line[200];
    std::snprintf(line, sizeof line, "%s, step %d, %s: moved %.4f mm a step, %zu voxels in the moving band", phase,
                  step, seeds.name(f).c_str(), fronts[f].mean_motion_mm() / (kStepsPerCycle * kCyclesPerRest),
                  fronts[f].band_voxels());
    context.info(line);
  }
}

/// Some time steps, then distances again.
void cycle(const Volume& volume, const EdgeProfile& profile, const Force& force, std::vector<Front>& fronts) {
  const double step_mm = kStepVoxels * volume.grid.spacing_mm.minCoeff();
  for (int step = 0; step < kStepsPerCycle; ++step) {
    for (Front& front : fronts) {
      front.evaluate(volume, profile, force);
      front.advance(step_mm);
    }
    keep_all_apart(fronts);
  }
  for (Front& front : fronts) front.redistance();
}

/// Expands all fronts together until each of them rests on the walls of its bone.
void expand(const Volume& volume, const List<Seeds>& seeds, const Options& options, std::vector<Front>& fronts,
            Context& context) {
  const EdgeProfile profile(options.expand_sigma_mm, options.blur_mm);
  const Force force{1, options.curvature_mm, options.edge_hu, options.floor_hu};
  constexpr int kSteps = kStepsPerCycle * kCyclesPerRest;
  const double least_motion_mm = options.stop_speed * kSteps * kStepVoxels * volume.grid.spacing_mm.minCoeff();
  for (int step = 0; step < options.max_steps; step += kSteps) {
    context.check_cancelled();
    context.progress(0.6 * step / options.max_steps, "expanding");
    for (int k = 0; k < kCyclesPerRest; ++k) cycle(volume, profile, force, fronts);
    bool at_rest = true;
    for (Front& front : fronts) at_rest &= front.rest(least_motion_mm);
    if (at_rest || step / kSteps % 10 == 9) log_fronts(fronts, seeds, "expanding", step, context);
    if (at_rest) return;
  }
  context.warn("the fronts still moved after " + std::to_string(options.max_steps) +
               " steps; they may leak, or max_steps is too small for this bone");
}

/// Leaves only the outer surface of each front, with nothing inside.
void fill(const marrow::Grid& grid, std::vector<Front>& fronts) {
  for (std::size_t f = 0; f < fronts.size(); ++f) {
    std::vector<float>& values = fronts[f].values_mm();
    std::vector<std::uint8_t> is_bone(grid.count()), is_other(grid.count(), 0);
    for (std::size_t at = 0; at < is_bone.size(); ++at) {
      is_bone[at] = values[at] < 0;
      for (std::size_t other = 0; other < fronts.size(); ++other)
        if (other != f) is_other[at] |= fronts[other].values_mm()[at] < 0;
    }
    segment::fill_interior(grid, is_bone, is_other);
    const float half_voxel = float(grid.spacing_mm[0] / 2);
    for (std::size_t at = 0; at < is_bone.size(); ++at)
      if (is_bone[at] && values[at] >= 0) values[at] = -half_voxel;
    fronts[f].wake_all();
    for (int k = 0; k < 3; ++k) fronts[f].redistance();
  }
}

/// Draws the surfaces to the steepest descent of the CT along their normals; where there is none (the mouth of a
/// canal), they stay.
void refine(const Volume& volume, const Options& options, std::vector<Front>& fronts, Context& context) {
  const EdgeProfile profile(options.edge_sigma_mm, options.blur_mm);
  const Force force{0, options.refine_curvature_mm, options.edge_hu, options.floor_hu};
  for (int step = 0; step < options.refine_steps; step += kStepsPerCycle) {
    context.check_cancelled();
    context.progress(0.7 + 0.3 * step / options.refine_steps, "refining");
    cycle(volume, profile, force, fronts);
  }
}

void check(const Volume& volume) {
  marrow::check_volume(volume, "volume");
  for (int size : volume.grid.size)
    if (size < 4)
      throw marrow::Error("volume: at least 4 voxels along each axis expected, got " +
                          std::to_string(volume.grid.size[0]) + " x " + std::to_string(volume.grid.size[1]) + " x " +
                          std::to_string(volume.grid.size[2]));
}

List<SignedField> level_set_fields(const Volume& volume, const List<Seeds>& seeds, const Options& options,
                                   Context& context) {
  check(volume);
  const auto indices = segment::seed_indices(volume, seeds, options.floor_hu);
  const double in_plane_mm = volume.grid.spacing_mm[0], band_mm = options.band_voxels * in_plane_mm;
  std::vector<Front> fronts;
  for (const auto& points : indices) {
    Front& front = fronts.emplace_back(volume.grid, band_mm);
    for (const auto& point : points) front.add_ball(point, 2 * in_plane_mm);
    front.wake_all();
  }
  keep_all_apart(fronts);
  expand(volume, seeds, options, fronts, context);
  for (std::size_t f = 0; f < fronts.size(); ++f) {
    const auto& values = fronts[f].values_mm();
    if (std::none_of(values.begin(), values.end(), [](float v) { return v < 0; }))
      throw marrow::Error("fragment '" + seeds.name(f) +
                          "': the front vanished, as its seeds lie too close to the edge of "
                          "the bone; move them towards the middle of the cortical or spongy bone");
  }
  fill(volume.grid, fronts);
  refine(volume, options, fronts, context);
  tbb::parallel_for(std::size_t(0), fronts.size(), [&](std::size_t f) {
    if (seeds[f].wanted) segment::march_distances(volume.grid, fronts[f].values_mm(), band_mm);
  });
  List<SignedField> fields;
  for (std::size_t f = 0; f < fronts.size(); ++f) {
    if (!seeds[f].wanted) continue;
    fields.add(seeds.name(f), SignedField{volume.grid, std::move(fronts[f].values_mm())});
  }
  if (fields.empty()) throw marrow::Error("seeds: no fragment is wanted; set wanted: true for at least one");
  return fields;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("segment.level_set", level_set_fields)
      .summary("3D narrow-band level set with an image force along the normal")
      .in("volume", "CT in Hounsfield units")
      .in("seeds", "points inside each fragment", marrow::over("fragment"))
      .out("field", "signed distance to the outer surface of each wanted fragment", marrow::over("fragment"))
      .option("band_voxels", &Options::band_voxels, "half width of the narrow band, in in-plane voxels",
              marrow::at_least(3), marrow::at_most(20), marrow::unit("voxels"))
      .option("curvature_mm", &Options::curvature_mm, "weight of the curvature while the fronts expand",
              marrow::at_least(0), marrow::at_most(0.5))
      .option("edge_hu", &Options::edge_hu, "drop of the CT that halves the speed", marrow::at_least(1),
              marrow::unit("HU"))
      .option("floor_hu", &Options::floor_hu, "no front advances into what is darker; nor may a seed be",
              marrow::unit("HU"))
      .option("expand_sigma_mm", &Options::expand_sigma_mm, "Gaussian derivative while the fronts expand",
              marrow::at_least(0.1), marrow::at_most(5))
      .option("edge_sigma_mm", &Options::edge_sigma_mm, "Gaussian derivative that the final surface rests on",
              marrow::at_least(0.1), marrow::at_most(5))
      .option("blur_mm", &Options::blur_mm, "standard deviation of the CT's own blur", marrow::at_least(0),
              marrow::at_most(5))
      .option("refine_curvature_mm", &Options::refine_curvature_mm, "weight of the curvature in the final surface",
              marrow::at_least(0), marrow::at_most(0.5))
      .option("stop_speed", &Options::stop_speed, "a part of a front that is slower (F0 is 1) comes to rest",
              marrow::at_least(0.001), marrow::at_most(0.5))
      .option("max_steps", &Options::max_steps, "most time steps of the expansion", marrow::at_least(1))
      .option("refine_steps", &Options::refine_steps, "time steps of the final refinement", marrow::at_least(0));
}
