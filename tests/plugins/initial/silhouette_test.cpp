// SPDX-License-Identifier: Apache-2.0
// A start from silhouettes: shapes of outlines that are known by hand, and bodies of ellipsoids, whose silhouettes are
// exact, in any orientation.
#include "marrow/initial/shape_library.hpp"
#include "marrow/toolbox/analytic/body.hpp"

namespace marrow::test::silhouette_test {

using analytic::Body, analytic::BodyProjector;
using initial::OutlineShape, initial::outline_shape;
using Polygon = std::vector<Vector2d>;

std::complex<double> term(const OutlineShape& shape, int order) {
  return shape.terms[std::size_t(order < 0 ? order + OutlineShape::kOrders : order + OutlineShape::kOrders - 1)];
}

TEST(OutlineShape, OfACircleHasOneTerm) {
  Polygon circle;
  for (int i = 0; i < 128; ++i)
    circle.emplace_back(7 + 5 * std::cos(2 * kPi * i / 128), -3 + 5 * std::sin(2 * kPi * i / 128));
  const OutlineShape shape = outline_shape(circle);
  EXPECT_NEAR(std::abs(shape.middle - std::complex<double>(7, -3)), 0, 1e-9);
  EXPECT_NEAR(shape.size, 5, 1e-9);
  for (int order = -24; order <= 24; ++order) {
    if (order == 0) continue;
    EXPECT_NEAR(std::abs(term(shape, order)), order == 1 ? 1 : 0, 1e-9) << order;
  }
}

TEST(OutlineShape, OfASquareFallsWithTheSquareOfTheOrder) {
  // By integration along the sides: only the orders 1 + 4 n, each 1 / order^2 of the first.
  const OutlineShape shape = outline_shape({{1, 1}, {-1, 1}, {-1, -1}, {1, -1}});
  const double first = std::abs(term(shape, 1));
  for (const int order : {-7, -3, 5, 9})
    EXPECT_NEAR(std::abs(term(shape, order)) / first, 1.0 / (order * order), 1e-3) << order;
  for (const int order : {-2, -1, 2, 3, 4}) EXPECT_NEAR(std::abs(term(shape, order)), 0, 1e-9) << order;
}

/// Two arms of different lengths.
Polygon angle() { return {{0, 0}, {10, 0}, {10, 2}, {2, 2}, {2, 5}, {0, 5}}; }

Polygon moved(const Polygon& polygon, double scale, double turn_rad, const Vector2d& shift, std::size_t start) {
  Polygon result;
  for (std::size_t i = 0; i < polygon.size(); ++i)
    result.push_back(scale * (Eigen::Rotation2Dd(turn_rad) * polygon[(i + start) % polygon.size()]) + shift);
  return result;
}

TEST(OutlineShape, IsAsLikeAsCanBeInItsTurn) {
  const OutlineShape drawn = outline_shape(angle());
  for (const double turn_rad : {0.0, 0.4, 1.9, 3.1, -2.2}) {
    const OutlineShape seen = outline_shape(moved(angle(), 3, turn_rad, {100, -40}, 1));
    const initial::Likeness alike = initial::likeness(seen, drawn);
    EXPECT_GT(alike.value, 0.999) << turn_rad;  // corners lie between two of the points
    EXPECT_NEAR(std::remainder(alike.turn_rad - turn_rad, 2 * kPi), 0, 0.02);
    EXPECT_NEAR(seen.size / drawn.size, 3, 0.01);
  }
}

TEST(OutlineShape, TellsAShapeFromItsMirrorImage) {
  Polygon mirrored = angle();
  for (Vector2d& corner : mirrored) corner.x() *= -1;
  std::reverse(mirrored.begin(), mirrored.end());  // traced in the same sense
  EXPECT_LT(initial::likeness(outline_shape(mirrored), outline_shape(angle())).value, 0.98);
}

TEST(OutlineShape, RefusesAPoint) { EXPECT_THROW(outline_shape({{1, 1}, {1, 1}}), Error); }

/// 160 x 120 pixels with a rectangle of 100 x 36 pixels, and a speck.
View rectangle_view() {
  const Camera camera = pinhole(400, 160, 120);
  View view = view_of("front", camera, cv::Mat(120, 160, CV_16U, cv::Scalar(1000)), mask_of(camera, {30, 37, 100, 36}));
  view.mask(cv::Rect(5, 5, 3, 3)).setTo(255);
  return view;
}

TEST(SeenSilhouette, IsCutOutAndMadeSmallerWithItsCamera) {
  const initial::SeenSilhouette seen = initial::seen_silhouette(rectangle_view(), 30, "node");
  EXPECT_TRUE(seen.is_whole);
  EXPECT_EQ(cv::countNonZero(seen.mask), 50 * 18) << "half as large, without the speck";
  // The rectangle's middle, (79.5, 54.5), is where its camera sees the same ray.
  Vector3d middle(0, 0, 1);
  for (int v = 0; v < seen.mask.rows; ++v)
    for (int u = 0; u < seen.mask.cols; ++u)
      if (seen.mask(v, u)) middle.head<2>() += Vector2d(u, v) / (50 * 18);
  const Vector3d ray = seen.camera.intrinsics.inverse() * middle;
  EXPECT_NEAR(ray.x(), 0, 1e-9);
  EXPECT_NEAR(ray.y(), -5.0 / 400, 1e-9);
  EXPECT_LT(seen.distance(seen.mask.rows / 2, seen.mask.cols / 2), -6);
}

TEST(SeenSilhouette, SaysIfItIsCutOff) {
  View view = rectangle_view();
  view.mask(cv::Rect(100, 45, 60, 10)).setTo(255);
  EXPECT_FALSE(initial::seen_silhouette(view, 30, "node").is_whole);
}

/// Without any symmetry; its pieces overlap.
Body body() { return {{{0, 0, 0}, {16, 12, 30}}, {{18, 4, 18}, {12, 8, 11}}, {{-14, -12, -14}, {12, 6, 7}}}; }

constexpr int kSize_px = 340;

View seen_at(const Body& body, const RigidTransform& world_from_ct, double angle_deg) {
  View view = even_view("at " + std::to_string(int(angle_deg)), analytic::c_arm(angle_deg, kSize_px, kSize_px, 0.8));
  std::vector<float> lengths_mm =
      BodyProjector(body).radiograph(view.camera, world_from_ct, PixelGrid{0, 0, 1, kSize_px, kSize_px});
  view.mask = cv::Mat(kSize_px, kSize_px, CV_32F, lengths_mm.data()) > 0;
  return view;
}
Inputs inputs_of(const Value& views, const Body& model = body()) {
  return {{"model", item(analytic::mesh_of(model))}, {"silhouettes", views}};
}

RigidTransform found(const Inputs& inputs, const std::string& port = "pose") {
  return output<Pose>("initial.silhouette", port, inputs).world_from_model;
}

TEST(Silhouette, OfOneOrTwoViewsGivesThePose) {
  for (const Vector3d& turn :
       {Vector3d(0, 0, 0), Vector3d(3.1, 0, 0), Vector3d(0.4, -1.9, 0.8), Vector3d(-1.2, 1.3, -2)}) {
    SCOPED_TRACE(turn.transpose());
    const RigidTransform truth = placed({18, -25, 22}, turn);
    const View first = seen_at(body(), truth, 0);
    const RigidTransform two = found(inputs_of(each_view(first, seen_at(body(), truth, 80)))),
                         one = found(inputs_of(each_view(first)));
    EXPECT_LT(turn_between_deg(two, truth), 3);
    EXPECT_LT(shift_between_mm(two, truth), 0.7);
    // One view gives all but the depth.
    EXPECT_LT(turn_between_deg(one, truth), 6);
    const Vector3d off_mm = first.camera.camera_from_world.rotation * (one.translation_mm - truth.translation_mm);
    EXPECT_LT(off_mm.head<2>().norm(), 1);
    EXPECT_LT(std::abs(off_mm.z()), 12);
  }
}

TEST(Silhouette, OfASymmetricPartHasASecondPose) {
  // Both halves of x are the same. Seen along y, a turn about x looks like the opposite turn of the mirror image.
  const Body symmetric{{{0, 0, 0}, {24, 8, 12}}, {{0, 8, 18}, {7, 6, 14}}};
  const RigidTransform truth = placed({0, 0, 0}, {0.1, 0.2, 0.5});
  const Inputs inputs = inputs_of(each_view(seen_at(symmetric, truth, 0)), symmetric);
  const RigidTransform pose = found(inputs), other = found(inputs, "other");
  EXPECT_GT(turn_between_deg(pose, other), 15);
  EXPECT_LT(std::min(turn_between_deg(pose, truth), turn_between_deg(other, truth)), 6);
}

TEST(Silhouette, ThatIsCutOffIsLeftOutIfThereAreOthers) {
  const RigidTransform truth = placed({0, 0, 0}, {0.4, -1.9, 0.8});
  View cut = seen_at(body(), truth, 80);
  cut.mask.rowRange(0, kSize_px / 2).setTo(255);
  EXPECT_LT(turn_between_deg(found(inputs_of(each_view(seen_at(body(), truth, 0), cut))), truth), 6);
}

TEST(Silhouette, OfAnotherPartIsDoubted) {
  const View other = seen_at({{{0, 0, 0}, {6, 6, 60}}}, placed({0, 0, 0}), 0);
  const Pose pose = output<Pose>("initial.silhouette", "pose", inputs_of(each_view(other)));
  ASSERT_EQ(pose.warnings.size(), 1U);
  EXPECT_NE(pose.warnings[0].find("does the mask show this part, and all of it?"), std::string::npos);
}

TEST(Silhouette, FaultsAreSaid) {
  View view = seen_at(body(), placed({0, 0, 0}), 0);
  const auto said = [&](const cv::Mat& mask) {
    view.mask = mask;
    return refusal("initial.silhouette", inputs_of(each_view(view)));
  };
  EXPECT_EQ(said({}),
            "initial.silhouette: view 'at 0': it has no mask, so no silhouette; wire a node of the kind mask, such as "
            "mask.network with leave_out: [background]");
  EXPECT_EQ(said(nothing_shown(view.camera)),
            "initial.silhouette: view 'at 0': its mask is empty, so the part is not seen; look at the mask's node");
  EXPECT_EQ(
      said(mask_of(view.camera, {0, 0, kSize_px, kSize_px})),
      "initial.silhouette: view 'at 0': its mask is the whole image, which is no silhouette; look at the mask's node");
  EXPECT_EQ(said(mask_of(view.camera, {0, 0, kSize_px, 100})),
            "initial.silhouette: the image's border cuts off the silhouette in view 'at 0', so its shape is not known; "
            "take images that show the whole part, or another start");
}

}  // namespace marrow::test::silhouette_test
