// SPDX-License-Identifier: Apache-2.0
#pragma once
// A flat square across the beam, 1000 mm from the source: how each error of the image moves it is known by hand.
#include "tests/harness/node_test.hpp"

namespace marrow::test::square_across_beam {

/// The borders of a square of about 40 mm, a little uneven so that they determine all six axes.
class Square : public OutlineProjector {
 public:
  std::vector<OutlinePoint> outline(const Camera& camera, const RigidTransform& pose, double) const override {
    std::vector<OutlinePoint> points;
    for (int side = 0; side < 4; ++side)
      for (int i = -5; i <= 5; ++i) {
        const double along = 4.0 * i, out = 20 + side;
        const Vector2d normal = side == 0   ? Vector2d(1, 0)
                                : side == 1 ? Vector2d(0, 1)
                                : side == 2 ? Vector2d(-1, 0)
                                            : Vector2d(0, -1);
        const Vector3d at(out * normal.x() - along * normal.y(), out * normal.y() + along * normal.x(),
                          3 * std::sin(7.0 * side + i));
        const Vector3d seen = camera.camera_from_world * (pose * at);
        OutlinePoint point;
        const Vector2d pixel = (camera.intrinsics * seen).hnormalized();
        point.u_px = float(pixel.x()), point.v_px = float(pixel.y());
        point.normal_u = float(normal.x()), point.normal_v = float(normal.y());
        point.model_mm = at.cast<float>();
        points.push_back(point);
      }
    return points;
  }
};

inline List<View> views() {
  Camera camera;
  camera.width_px = camera.height_px = 512;
  camera.intrinsics << 3000, 0, 255.5, 0, 3000, 255.5, 0, 0, 1;
  List<View> views;
  views.add("only", View{"only", {cv::Mat(512, 512, CV_8U, cv::Scalar(9))}, camera, {}});
  return views;
}

inline Pose pose() {
  Pose pose;
  pose.world_from_model.translation_mm = {0, 0, 1000};
  pose.covariance = Matrix6d::Zero();
  return pose;
}

/// A list with this pose alone.
inline List<Pose> stages() {
  List<Pose> stages;
  stages.add("final", pose());
  return stages;
}

inline Value projector() { return Value::of<OutlineProjector>(std::make_shared<const Square>()); }

}  // namespace marrow::test::square_across_beam
