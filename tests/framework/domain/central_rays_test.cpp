// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <marrow/domain/camera.hpp>

namespace central_rays_test {

using Eigen::Vector3d;
using marrow::List, marrow::View;

/// A view from `source`, whose central ray goes through `aim`.
View aimed(const Vector3d& source, const Vector3d& aim) {
  View view;
  view.camera.width_px = view.camera.height_px = 100;
  view.camera.intrinsics << 1000, 0, 20, 0, 1000, 70, 0, 0, 1;
  const Vector3d z = (aim - source).normalized(), x = z.unitOrthogonal();
  view.camera.camera_from_world.rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
  view.camera.camera_from_world.translation_mm = -(view.camera.camera_from_world.rotation * source);
  return view;
}
List<View> both(const View& one, const View& other) {
  List<View> views;
  views.add("one", one);
  views.add("other", other);
  return views;
}

TEST(CentralRays, MeetWhereTheyAreAimed) {
  const Vector3d aim(120, -340, 55);
  const auto met = marrow::meeting_point_mm(both(aimed({700, 0, 0}, aim), aimed({0, 300, 200}, aim)));
  ASSERT_TRUE(met);
  EXPECT_LT((*met - aim).norm(), 1e-9);
}

TEST(CentralRays, ThatMissEachOtherMeetHalfWay) {
  // One runs along x at z = 0, the other along y at z = 10.
  const auto met = marrow::meeting_point_mm(both(aimed({-600, 0, 0}, {0, 0, 0}), aimed({7, -600, 10}, {7, 0, 10})));
  ASSERT_TRUE(met);
  EXPECT_LT((*met - Vector3d(7, 0, 5)).norm(), 1e-9);
}

TEST(CentralRays, DoNotAlwaysTellWhereTheBoneIs) {
  List<View> single;
  single.add("one", aimed({0, -600, 0}, {0, 0, 0}));
  EXPECT_FALSE(marrow::meeting_point_mm(single));
  EXPECT_FALSE(marrow::meeting_point_mm({}));
  EXPECT_FALSE(marrow::meeting_point_mm(both(aimed({0, -600, 0}, {0, 0, 0}), aimed({20, -600, 0}, {0, 0, 0}))))
      << "1.9 degrees apart";
  EXPECT_TRUE(marrow::meeting_point_mm(both(aimed({0, -600, 0}, {0, 0, 0}), aimed({40, -600, 0}, {0, 0, 0}))))
      << "3.8 degrees apart";
  EXPECT_FALSE(marrow::meeting_point_mm(both(aimed({0, -600, 0}, {0, -900, 0}), aimed({600, 0, 0}, {900, 0, 0}))))
      << "they meet behind the sources";
}

}  // namespace central_rays_test
