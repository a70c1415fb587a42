// SPDX-License-Identifier: Apache-2.0
#pragma once
// Edge maps as a perfect detector would give them: the outline of a model at the true pose, and the ways in which a
// real detector falls short of that.
#include "tests/plugins/project/shapes.hpp"

namespace marrow::test::ideal_edges {

struct Faults {
  double noise_px = 0;   ///< independent, along the gradient
  double missing = 0;    ///< share of the outline that is missing, in gaps
  int outliers = 0;      ///< edge pixels of anything else
  double offset_px = 0;  ///< all edges lie this far outside the outline
  bool canal = false;    ///< the inner border of the cortex, 20 px inside, where it gets brighter inwards
  unsigned seed = 1;
};

inline EdgeMap edges_of(const OutlineProjector& projector, const Camera& camera, const RigidTransform& world_from_model,
                        const Faults& faults) {
  std::mt19937 random(faults.seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  EdgeMap map{camera.width_px, camera.height_px, {}};
  const auto add = [&](double u, double v, double du, double dv) {
    if (u < 0 || v < 0 || u > camera.width_px - 1 || v > camera.height_px - 1) return;
    map.pixels.push_back({float(u), float(v), float(du), float(dv), 1});
  };
  Numbers gaps;
  for (int i = 0; i < 64; ++i) gaps.push_back(uniform(random));
  for (const auto& p : projector.outline(camera, world_from_model, 1)) {
    // A gap is a cell of 64 x 64 pixels without edges.
    const int cell = int(p.u_px / 64) + 8 * int(p.v_px / 64);
    if (gaps[std::size_t(cell % 64)] < faults.missing) continue;
    const double shift = faults.offset_px + faults.noise_px * normal(random);
    add(p.u_px + shift * p.normal_u, p.v_px + shift * p.normal_v, p.normal_u, p.normal_v);
    if (faults.canal) add(p.u_px - 20 * p.normal_u, p.v_px - 20 * p.normal_v, -p.normal_u, -p.normal_v);
  }
  for (int i = 0; i < faults.outliers; ++i) {
    const double angle = 2 * kPi * uniform(random);
    add(uniform(random) * camera.width_px, uniform(random) * camera.height_px, std::cos(angle), std::sin(angle));
  }
  const auto place = [](const EdgePixel& e) { return std::pair(std::lround(e.v_px), std::lround(e.u_px)); };
  std::stable_sort(map.pixels.begin(), map.pixels.end(),
                   [&](const auto& a, const auto& b) { return place(a) < place(b); });
  return map;
}

struct Scene {
  List<View> views;
  List<EdgeMap> edges;
};

inline Scene scene_of(const OutlineProjector& projector, const RigidTransform& world_from_model,
                      const Numbers& angles_deg, const Faults& faults = {}) {
  Scene scene;
  for (const double angle : angles_deg) {
    const std::string name = "at_" + std::to_string(int(angle));
    View view{name, {}, shapes::c_arm(angle), {}};
    Faults own = faults;
    own.seed = faults.seed * 1000 + unsigned(angle);
    scene.edges.add(name, edges_of(projector, view.camera, world_from_model, own));
    scene.views.add(name, std::move(view));
  }
  return scene;
}

}  // namespace marrow::test::ideal_edges
