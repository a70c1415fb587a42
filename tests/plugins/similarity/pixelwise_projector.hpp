// SPDX-License-Identifier: Apache-2.0
#pragma once
// Radiographs that are formulas.
#include <marrow/domain/functions.hpp>
#include <vector>

namespace pixelwise_projector {

/// Asks for each pixel by itself.
class PixelwiseProjector : public marrow::RadiographProjector {
 public:
  std::vector<float> radiograph(const marrow::Camera&, const marrow::RigidTransform& pose,
                                const marrow::PixelGrid& grid) const override {
    std::vector<float> values;
    for (int row = 0; row < grid.rows; ++row)
      for (int column = 0; column < grid.columns; ++column)
        values.push_back(float(integral(grid.pixel(column, row), pose)));
    return values;
  }
  std::vector<float> radiograph(const marrow::Camera&, const marrow::RigidTransform& pose,
                                const std::vector<Eigen::Vector2f>& pixels) const override {
    std::vector<float> values;
    for (const Eigen::Vector2f& pixel : pixels) values.push_back(float(integral(pixel.cast<double>(), pose)));
    return values;
  }

 protected:
  virtual double integral(const Eigen::Vector2d& pixel, const marrow::RigidTransform& pose) const = 0;
};

}  // namespace pixelwise_projector
