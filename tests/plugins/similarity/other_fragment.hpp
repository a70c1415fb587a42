// SPDX-License-Identifier: Apache-2.0
#pragma once
// Another fragment in the same images: a square.
#include <marrow/domain/case.hpp>
#include <marrow/domain/features.hpp>
#include <marrow/domain/functions.hpp>
#include <memory>
#include <vector>

#include "shipped.hpp"
#include "tests/plugins/similarity/pixelwise_projector.hpp"

namespace other_fragment {

using marrow::List;
using marrow::Pose;

/// Lists of two fragments: the own one, and another at a different place.
template <class Projector>
struct Fragments {
  std::shared_ptr<const Projector> own, other;
  shipped::Inputs with(shipped::Inputs inputs) const {
    List<Projector> projectors;
    List<Pose> poses;
    projectors.add_shared("own", own);
    projectors.add_shared("other", other);
    poses.add("other", Pose());  // the own pose is not known yet
    inputs["projector"] = marrow::Value::of<Projector>(own);
    inputs["other_projectors"] = shipped::list(projectors, "fragment");
    inputs["others"] = shipped::list(poses, "fragment");
    return inputs;
  }
};

/// Another fragment at a different place, known only as a surface.
inline shipped::Inputs with_outline(shipped::Inputs inputs, std::shared_ptr<const marrow::OutlineProjector> other) {
  List<marrow::OutlineProjector> outlines;
  List<Pose> poses;
  outlines.add_shared("other", std::move(other));
  poses.add("other", Pose());
  inputs["other_outlines"] = shipped::list(outlines, "fragment");
  inputs["others"] = shipped::list(poses, "fragment");
  return inputs;
}

/// A square of shadow, wherever the pose is.
class SquareProjector : public pixelwise_projector::PixelwiseProjector {
 public:
  marrow::PixelGrid region(const marrow::Camera&, const marrow::RigidTransform&) const override {
    return {95, 55, 1, 40, 40};
  }

 protected:
  double integral(const Eigen::Vector2d& p, const marrow::RigidTransform&) const override {
    return p.x() >= 100 && p.x() < 130 && p.y() >= 60 && p.y() < 90 ? 10 : 0;
  }
};

/// The same square as an outline that is open below. It moves by one pixel per millimetre.
class SquareOutline : public marrow::OutlineProjector {
 public:
  std::vector<marrow::OutlinePoint> outline(const marrow::Camera&, const marrow::RigidTransform& pose,
                                            double spacing_px) const override {
    const double left = 100 + pose.translation_mm.x();
    std::vector<marrow::OutlinePoint> points;
    for (double at = 0; at < 30; at += spacing_px) {
      points.push_back({float(left), float(60 + at), -1, 0});
      points.push_back({float(left + 29), float(60 + at), 1, 0});
      points.push_back({float(left + at), 60, 0, -1});
    }
    return points;
  }
};

}  // namespace other_fragment
