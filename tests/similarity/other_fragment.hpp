// SPDX-License-Identifier: Apache-2.0
#pragma once
// Another fragment in the same images: a square.
#include <marrow/domain/case.hpp>
#include <marrow/domain/features.hpp>
#include <marrow/domain/functions.hpp>
#include <memory>
#include <vector>

#include "shipped.hpp"

namespace other_fragment {

using marrow::List;
using marrow::Pose;
using marrow::Projector;

/// Lists of fragments: the one in question, and another at a place of its own.
struct Fragments {
  std::shared_ptr<const Projector> own, other;
  shipped::Inputs with(shipped::Inputs inputs) const {
    List<Projector> projectors;
    List<Pose> poses;
    projectors.add_shared("own", own);
    projectors.add_shared("other", other);
    poses.add("other", Pose());  // of its own pose there is none yet
    inputs["projector"] = marrow::Value::of<Projector>(own);
    inputs["other_projectors"] = shipped::list(projectors, "fragment");
    inputs["others"] = shipped::list(poses, "fragment");
    return inputs;
  }
};

/// A square of shadow, wherever the pose is.
class SquareProjector : public Projector {
 public:
  std::vector<float> radiograph(const marrow::Camera&, const marrow::RigidTransform&,
                                const marrow::PixelGrid& grid) const override {
    std::vector<float> values;
    for (int row = 0; row < grid.rows; ++row)
      for (int column = 0; column < grid.columns; ++column) {
        const Eigen::Vector2d p = grid.pixel(column, row);
        values.push_back(p.x() >= 100 && p.x() < 130 && p.y() >= 60 && p.y() < 90 ? 10.0f : 0.0f);
      }
    return values;
  }
  marrow::PixelGrid region(const marrow::Camera&, const marrow::RigidTransform&) const override {
    return {95, 55, 1, 40, 40};
  }
};

/// The same square as an outline, open below.
class SquareOutline : public Projector {
 public:
  std::vector<marrow::OutlinePoint> outline(const marrow::Camera&, const marrow::RigidTransform&,
                                            double spacing_px) const override {
    std::vector<marrow::OutlinePoint> points;
    for (double at = 0; at < 30; at += spacing_px) {
      points.push_back({100, float(60 + at), -1, 0});
      points.push_back({129, float(60 + at), 1, 0});
      points.push_back({float(100 + at), 60, 0, -1});
    }
    return points;
  }
};

}  // namespace other_fragment
