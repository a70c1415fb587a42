// SPDX-License-Identifier: Apache-2.0
#pragma once
// Projectors and costs that are formulas.
#include <functional>
#include <marrow/domain/functions.hpp>
#include <memory>
#include <utility>
#include <vector>

namespace marrow::test {

/// An outline that a formula draws.
class DrawnOutline : public OutlineProjector {
 public:
  using Formula = std::function<std::vector<OutlinePoint>(const Camera&, const RigidTransform&, double spacing_px)>;
  explicit DrawnOutline(Formula formula) : formula_(std::move(formula)) {}
  std::vector<OutlinePoint> outline(const Camera& camera, const RigidTransform& world_from_model,
                                    double spacing_px) const override {
    return formula_(camera, world_from_model, spacing_px);
  }

 private:
  Formula formula_;
};
inline std::shared_ptr<const OutlineProjector> outline_of(DrawnOutline::Formula formula) {
  return std::make_shared<const DrawnOutline>(std::move(formula));
}

/// Line integrals by a formula of the pixel and the pose, in a region that may depend on the pose.
class DrawnRadiograph : public RadiographProjector {
 public:
  using Formula = std::function<double(const Eigen::Vector2d& pixel, const RigidTransform&)>;
  using Region = std::function<PixelGrid(const RigidTransform&)>;
  DrawnRadiograph(Region region, Formula formula) : region_(std::move(region)), formula_(std::move(formula)) {}
  DrawnRadiograph(const PixelGrid& region, Formula formula)
      : DrawnRadiograph([region](const RigidTransform&) { return region; }, std::move(formula)) {}
  std::vector<float> radiograph(const Camera&, const RigidTransform& pose, const PixelGrid& grid) const override {
    std::vector<float> values;
    for (int row = 0; row < grid.rows; ++row)
      for (int column = 0; column < grid.columns; ++column)
        values.push_back(float(formula_(grid.pixel(column, row), pose)));
    return values;
  }
  std::vector<float> radiograph(const Camera&, const RigidTransform& pose,
                                const std::vector<Eigen::Vector2f>& pixels) const override {
    std::vector<float> values;
    for (const Eigen::Vector2f& pixel : pixels) values.push_back(float(formula_(pixel.cast<double>(), pose)));
    return values;
  }
  PixelGrid region(const Camera&, const RigidTransform& pose) const override { return region_(pose); }

 protected:
  double integral(const Eigen::Vector2d& pixel, const RigidTransform& pose) const { return formula_(pixel, pose); }

 private:
  Region region_;
  Formula formula_;
};

/// A cost by a formula of the pose. It is the same at each level.
class FormulaCost : public Cost {
 public:
  using Formula = std::function<double(const RigidTransform&)>;
  explicit FormulaCost(Formula formula) : formula_(std::move(formula)) {}
  double value(const RigidTransform& world_from_model) const override { return formula_(world_from_model); }
  std::shared_ptr<const Cost> at_level(const CostLevel&) const override { return std::make_shared<FormulaCost>(*this); }

 private:
  Formula formula_;
};
inline std::shared_ptr<const Cost> cost_of(FormulaCost::Formula formula) {
  return std::make_shared<const FormulaCost>(std::move(formula));
}

}  // namespace marrow::test
