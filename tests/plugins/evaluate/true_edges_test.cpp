// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>

#include "marrow/toolbox/analytic/body.hpp"
#include "shipped.hpp"
#include "tests/harness/message_of.hpp"

namespace true_edges_test {

using namespace marrow;

const analytic::Body kBall{analytic::Ellipsoid{Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(20)}};

/// Pixels of 0.6 mm in the world's origin.
Camera camera() { return analytic::c_arm(0, 200, 200, 1); }

Truth at(const Eigen::Vector3d& shift_mm) {
  Truth truth;
  truth.world_from_model = analytic::moved_by(Eigen::Vector3d::Zero(), shift_mm);
  return truth;
}

EdgeMap edges_of(const std::vector<std::pair<std::string, Truth>>& fragments, const std::vector<std::string>& drawn) {
  List<Truth> truths;
  for (const auto& [name, truth] : fragments) truths.add(name, truth);
  List<OutlineProjector> outlines;
  for (const std::string& name : drawn)
    outlines.add_shared(name, std::make_shared<const analytic::BodyProjector>(kBall));
  return shipped::call("evaluate.true_edges", {{"camera", shipped::item(camera())},
                                               {"truths", shipped::list(truths, "fragment")},
                                               {"projectors", shipped::list(outlines, "fragment")}})
      .at("edges")
      .as<EdgeMap>();
}

/// A ball's outline is the circle of the cone that touches it, seen from 600 mm, with a focal length of 1000 px.
double radius_px() { return 1000 * 20 / std::sqrt(600.0 * 600 - 20 * 20); }

TEST(TrueEdges, LieOnTheCircleThatABallThrows) {
  const EdgeMap edges = edges_of({{"ball", at({0, 0, 0})}}, {"ball"});
  EXPECT_EQ(edges.width_px, 200);
  ASSERT_GT(edges.pixels.size(), 150u);
  for (const EdgePixel& edge : edges.pixels) {
    const Eigen::Vector2d from(edge.u_px - 99.5, edge.v_px - 99.5);
    EXPECT_NEAR(from.norm(), radius_px(), 0.02);
    EXPECT_NEAR(from.normalized().dot(Eigen::Vector2d(edge.direction_u, edge.direction_v)), 1, 1e-3);
    EXPECT_EQ(edge.magnitude, 1);
  }
}

TEST(TrueEdges, AreOneForEachPixelInTheOrderOfPixelsAlsoWhereFragmentsOverlap) {
  const EdgeMap one = edges_of({{"a", at({0, 0, 0})}}, {"a"});
  const EdgeMap twice = edges_of({{"a", at({0, 0, 0})}, {"b", at({0, 0, 0})}}, {"b", "a"});
  EXPECT_EQ(twice.pixels.size(), one.pixels.size());
  const EdgeMap both = edges_of({{"a", at({0, 0, 0})}, {"b", at({10, 0, 0})}}, {"a", "b"});
  EXPECT_GT(both.pixels.size(), 3 * one.pixels.size() / 2);  // the part inside of the other ball, too
  long before = -1;
  for (const EdgePixel& edge : both.pixels) {
    const long pixel = std::lround(edge.v_px) * 200 + std::lround(edge.u_px);
    EXPECT_GT(pixel, before);
    before = pixel;
  }
}

TEST(TrueEdges, SayWhichOutlineIsMissing) {
  const std::string message = test::message_of([] { edges_of({{"distal", at({0, 0, 0})}}, {"proximal"}); });
  EXPECT_NE(message.find("there is no outline of fragment 'distal'; make outlines from the models"), std::string::npos)
      << message;
}

}  // namespace true_edges_test
