// SPDX-License-Identifier: Apache-2.0
#pragma once
// Costs of a body that is known analytically. They are fast, have several minima as costs of real images do, and are
// least exactly where the body was when its views were made. Suites try registrations, starts and verdicts with them.
#include <memory>
#include <vector>

#include "marrow/toolbox/analytic/body.hpp"

namespace marrow::analytic {

/// What a view shows of a body: pixels of its outline, and its radiograph on a grid.
struct SeenBody {
  Camera camera;
  std::vector<Eigen::Vector2d> outline_px;
  PixelGrid grid;
  std::vector<float> radiograph;
};
/// The body as the camera sees it: the outline every `spacing_px`, the whole image's radiograph every `step_px`.
SeenBody seen(const Body& body, const Camera& camera, const RigidTransform& world_from_model, double spacing_px,
              double step_px);

/// Mean over the outlines' pixels of d^2 / (d^2 + reach^2), where d is the distance in mm between the ray through the
/// pixel and the surface (Lavallee and Szeliski, IEEE PAMI 17, 1995). A pixel is taken as 0.5 mm at the body. Each view
/// has eight blocks. At a level only the reach changes. Safe to call from several threads.
class OutlineCost : public Cost {
 public:
  OutlineCost(Body body, std::vector<SeenBody> views, double reach_px = 6);
  double value(const RigidTransform& world_from_model) const override;
  std::shared_ptr<const Cost> at_level(const CostLevel& level) const override;
  std::vector<double> without_each_block(const RigidTransform& world_from_model) const override;
  std::size_t view_count() const override { return views_.size(); }
  double value_in_view(std::size_t view, const RigidTransform& world_from_model) const override;

 private:
  struct Sum {
    double loss = 0, count = 0;
    double mean() const { return count > 0 ? loss / count : 1; }
  };
  std::vector<Sum> blocks_of(std::size_t view, const RigidTransform& world_from_model) const;

  Body body_;
  std::vector<SeenBody> views_;
  double reach_mm_;
};

/// 1 - the correlation of the views' radiographs with those at the pose, the mean over the views: 0 at the true pose, 1
/// where the body is out of view. At a level with a pixel_step, every so many-th pixel of the radiograph is compared.
/// Each view has four blocks. Safe to call from several threads.
class RadiographCost : public Cost {
 public:
  RadiographCost(Body body, std::vector<SeenBody> views, int pixel_step = 1);
  double value(const RigidTransform& world_from_model) const override;
  std::shared_ptr<const Cost> at_level(const CostLevel& level) const override;
  std::vector<double> without_each_block(const RigidTransform& world_from_model) const override;
  std::size_t view_count() const override { return views_.size(); }
  double value_in_view(std::size_t view, const RigidTransform& world_from_model) const override;

 private:
  /// Without the pixels of one block; -1: with all.
  double value_without(std::size_t view, const std::vector<float>& drawn, int block) const;
  std::vector<float> drawn(std::size_t view, const RigidTransform& world_from_model) const;

  Body body_;
  std::vector<SeenBody> whole_, views_;  ///< at full resolution, and at that of the level
};

/// The plainest optimizer, for suites that give one to other nodes: it goes along one coordinate after the other, and
/// halves its steps when no coordinate leads down. It ignores bounds. Safe to call from several threads.
class Compass : public Optimizer {
 public:
  MinimisationResult minimise(const MinimisationProblem& problem) const override;
};

}  // namespace marrow::analytic
