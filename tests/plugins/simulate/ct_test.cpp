// SPDX-License-Identifier: Apache-2.0
#include "marrow/simulate/solid.hpp"
#include "tests/plugins/simulate/phantoms.hpp"

namespace marrow::test::ct_test {

using namespace simulated;
using namespace marrow::phantom;

Phantom tube() {
  Phantom phantom = whole(upright_cylinder(14, 0, 60), upright_cylinder(7, 5, 55), 24, 5);
  phantom.bone.fill_z_mm = {0, 20, 30, 60};
  phantom.bone.fill_fraction = {0.25, 0.25, 0, 0};
  return phantom;
}

TEST(SimulateCt, MaterialsHaveTheirHounsfieldUnits) {
  const Volume volume = ct(tube(), {{"noise_hu", 0.0}});
  for (const auto& [point_mm, hu] : std::vector<std::pair<Vector3d, double>>{{{10.5, 0, 30}, 1450},
                                                                             {{0, -10.5, 30}, 1450},
                                                                             {{0, 0, 45}, -20},
                                                                             {{0, 0, 12}, 0.25 * 1450 - 0.75 * 20},
                                                                             {{16.5, 0, 30}, 50},
                                                                             {{0, 21.5, 30}, -100},
                                                                             {{20, 20, 30}, -1000}})
    EXPECT_NEAR(value_at(volume, point_mm), hu, 1) << point_mm.transpose();
  EXPECT_EQ(volume.grid.spacing_mm, Vector3d(0.8, 0.8, 1.0));
  EXPECT_EQ(volume.grid.frame, "ct");
}

TEST(SimulateCt, EdgesAreAGaussianStepAlongEachAxis) {
  // The faces of a cube lie at 0; a Gaussian point-spread function turns a step into its cumulative distribution. Along
  // x lengths are exact; along y and z a face lies halfway between the last ray outside and the first one inside, at
  // most 0.15 mm off.
  const Volume volume =
      ct(whole(box_between({0, 0, 0}, {30, 30, 30})), {{"noise_hu", 0.0}, {"blur_mm", 0.9}, {"margin_mm", 6.3}});
  for (int axis = 0; axis < 3; ++axis) {
    // The rays through the voxels' centres and, at most 0.3 mm apart, between them.
    const double low = volume.grid.origin_mm[axis], spacing = volume.grid.spacing_mm[axis];
    const double fine = spacing / std::ceil(spacing / 0.3);
    const double face = axis == 0 ? 0 : low + (std::ceil(-low / fine) - 0.5) * fine;
    EXPECT_LE(std::abs(face), 0.15);
    for (int i = 0; i < 20; ++i) {
      Vector3d index = volume.grid.index_from_point({15, 15, 15}).array().round();
      index[axis] = i;
      const double distance = volume.grid.point_from_index(index)[axis];
      const double expected = -1000 + 2450 * 0.5 * std::erfc(-(distance - face) / (0.9 * std::sqrt(2.0)));
      EXPECT_NEAR(volume.at(int(index[0]), int(index[1]), int(index[2])), expected, 6)
          << "axis " << axis << " at " << distance;
    }
  }
}

TEST(SimulateCt, NoiseHasItsSpreadAndDependsOnTheSeedAlone) {
  const auto scanned = [](std::uint64_t seed, std::size_t threads, const Options& options = {}) {
    return with_threads(threads, [&] { return ct(tube(), options, seed).values; });
  };
  const auto one = scanned(5, 1), clean = scanned(5, 4, {{"noise_hu", 0.0}});
  EXPECT_EQ(one, scanned(5, 4));
  EXPECT_NE(one, scanned(6, 4));
  double sum = 0, squares = 0;
  for (std::size_t i = 0; i < one.size(); ++i) {
    sum += one[i] - clean[i];
    squares += std::pow(one[i] - clean[i], 2);
  }
  EXPECT_NEAR(sum / double(one.size()), 0, 0.5);
  EXPECT_NEAR(std::sqrt(squares / double(one.size())), 30, 0.5);
}

TEST(SimulateCt, RangeCoversOnlyPartOfTheBone) {
  const auto scanned = [](double from_mm, double to_mm) {
    return ct(tube(), {{"range_mm", Numbers{from_mm, to_mm}}, {"noise_hu", 0.0}});
  };
  const Volume part = scanned(20, 45);
  EXPECT_NEAR(part.grid.origin_mm.z(), 20, 1e-9);
  EXPECT_EQ(part.grid.size[2], 26);
  EXPECT_EQ(part.at(20, 20, 10), scanned(0, 0).at(20, 20, 10 + 32));  // the whole CT begins 12 mm below the bone
}

TEST(SimulateCt, FragmentsLieWhereTheCtHasThem) {
  Phantom phantom = whole(box_between({0, 0, 0}, {10, 10, 10}));
  phantom.fragments[0].ct_from_bone.translation_mm = {100, 0, 0};
  const Volume volume = ct(phantom, {{"noise_hu", 0.0}});
  EXPECT_NEAR(value_at(volume, {105, 5, 5}), 1450, 1);
  EXPECT_LT(volume.grid.point_from_index({0, 0, 0}).x(), 100);
  EXPECT_GT(volume.grid.point_from_index({0, 0, 0}).x(), 80);
}

TEST(SimulateCt, BadInputIsExplained) {
  const auto refused = [](const Phantom& phantom, const Options& options = {}) {
    return refusal("simulate.ct", {{"phantom", item(phantom)}}, options);
  };
  Phantom open = tube();
  open.bone.outer = opened(open.bone.outer);
  EXPECT_EQ(refused(open),
            "simulate.ct, outer surface: the surface is open or not consistently oriented, so it has no inside; close "
            "its holes (each edge must be shared by exactly two triangles)");
  EXPECT_EQ(refused(tube(), {{"range_mm", Numbers{100, 200}}}),
            "simulate.ct: range_mm 100.000000 to 200.000000 (from the distal end) holds no part of the bone");
  EXPECT_EQ(refused(tube(), {{"spacing_mm", Numbers{0.8, 0, 1.0}}}),
            "simulate.ct: spacing_mm must be positive, got 0.000000");
  EXPECT_EQ(refused({tube().bone, {}, {}}), "simulate.ct: the phantom has no fragments; break the bone first");
}

// Rays through closed surfaces compared with chords that are known exactly, and the polygoniser that makes the
// surfaces.

/// Length of bone on the ray of each pixel: {cortical, inner}.
std::vector<std::array<double, 2>> lengths(const Phantom& phantom, const Camera& camera) {
  const SolidRays rays(phantom, camera.width_px, camera.height_px, [&](const Fragment& fragment) {
    return [&camera, camera_from_bone = camera.camera_from_world * fragment.world_from_bone()](const Vector3d& p) {
      const Vector3d x = camera_from_bone * p;
      const Vector3d pixel = camera.intrinsics * x / x.z();
      return RayVertex{pixel.x(), pixel.y(), -1 / x.z()};
    };
  });
  std::vector<std::array<double, 2>> result(std::size_t(camera.width_px) * std::size_t(camera.height_px), {0, 0});
  const auto crossings = rays.bundle().crossings(0, camera.height_px);
  for_each_ray(crossings, [&](std::span<const Crossing> ray) {
    EXPECT_EQ(ray.size() % 2, 0u);
    std::vector<Interval> intervals;
    rays.intervals(ray, intervals);
    const Vector3d along = camera.intrinsics.inverse() * Vector3d(ray[0].column, ray[0].row, 1);
    for (const Interval& i : intervals)
      result[ray[0].row * std::size_t(camera.width_px) + ray[0].column][i.cortical ? 0 : 1] +=
          (1 / i.from - 1 / i.to) * along.norm();
  });
  return result;
}

/// Chord of a ray through a turned box, computed from its slabs and not from triangles.
double box_chord(const Vector3d& source, const Vector3d& direction, const Vector3d& low, const Vector3d& high) {
  double from = -1e300, to = 1e300;
  for (int k = 0; k < 3; ++k) {
    const double a = (low[k] - source[k]) / direction[k], b = (high[k] - source[k]) / direction[k];
    from = std::max(from, std::min(a, b));
    to = std::min(to, std::max(a, b));
  }
  return std::max(0.0, to - from) * direction.norm();
}

TEST(Rays, TurnedBoxHasItsChordsToAMillionth) {
  const Vector3d low(-20, -10, -30), high(15, 25, 40);
  Phantom phantom = simulated::whole(box_between(low, high));
  phantom.fragments[0].world_from_ct = placed({4, -3, 2}, {0.3, -0.5, 0.7});
  const Camera camera = simulated::camera(20, 200);
  const auto measured = lengths(phantom, camera);
  const RigidTransform bone_from_world = inverse(phantom.fragments[0].world_from_bone());
  int off = 0, inside = 0;
  for (int v = 0; v < 200; ++v)
    for (int u = 0; u < 200; ++u) {
      const double expected =
          box_chord(bone_from_world * source_position_mm(camera),
                    bone_from_world.rotation * ray_direction(camera, {double(u), double(v)}), low, high);
      const double got = measured[std::size_t(v) * 200 + std::size_t(u)][0];
      inside += expected > 0;
      // A ray that meets the silhouette within 1/4096 of a pixel may fall to either side of it.
      off += std::abs(got - expected) > 1e-6 && expected > 0.02;
      EXPECT_NEAR(got, expected, expected > 0.02 ? 0.05 : 0.03);
    }
  EXPECT_GT(inside, 3000);
  EXPECT_EQ(off, 0);
}

TEST(Rays, SphereAndHollowCylinderHaveTheirChords) {
  const Camera camera = simulated::camera(0, 128);
  const auto ball = lengths(simulated::whole(simulated::sphere({5, 3, -8}, 30, 0.7)), camera);
  const auto tube = lengths(simulated::whole(upright_cylinder(20, -300, 300), upright_cylinder(8, -290, 290)), camera);
  for (int v = 4; v < 128; v += 9)
    for (int u = 3; u < 128; u += 7) {
      const Vector3d source = source_position_mm(camera), direction = ray_direction(camera, {double(u), double(v)});
      const double miss = (Vector3d(5, 3, -8) - source).cross(direction).norm();
      if (std::abs(miss - 30) > 1) {
        EXPECT_NEAR(ball[std::size_t(v) * 128 + std::size_t(u)][0], miss < 30 ? 2 * std::sqrt(900 - miss * miss) : 0.0,
                    0.08);
      }
      const auto chord = [&](double radius) {
        const auto [from, to] = through_cylinder({0, 0}, radius, source, direction);
        return to - from;
      };
      const double off_axis = std::abs(direction.x() * 600 / direction.head<2>().norm());
      if (std::abs(off_axis - 20) < 0.5 || std::abs(off_axis - 8) < 0.5) continue;
      EXPECT_NEAR(tube[std::size_t(v) * 128 + std::size_t(u)][0], chord(20) - chord(8), 0.01);
      EXPECT_NEAR(tube[std::size_t(v) * 128 + std::size_t(u)][1], chord(8), 0.01);
    }
}

TEST(Rays, CylinderFormulaAgreesWithAChordByHand) {
  // At 12 mm from the axis of a cylinder of radius 20 a perpendicular ray runs 2 sqrt(400 - 144) = 32 mm.
  const auto [from, to] = through_cylinder({0, 5}, 20, {12, -595, 7}, {0, 1, 0});
  EXPECT_NEAR(to - from, 32, 1e-9);
  EXPECT_NEAR(from, 584, 1e-9);
}

TEST(Rays, RaysThroughEdgesAndCornersMeetEachSurfaceTwice) {
  // A box whose corners, edges and diagonals lie exactly on rays.
  RayBundle rays(12, 12);
  const Mesh box = box_between({2, 3, 1}, {9, 8, 5});
  std::vector<RayVertex> vertices;
  for (const auto& p : box.vertices_mm) vertices.push_back({p.x(), p.y(), p.z()});
  rays.add(vertices, box.triangles);
  const auto crossings = rays.crossings(0, 12);
  std::size_t hit = 0;
  for_each_ray(crossings, [&](std::span<const Crossing> ray) {
    ++hit;
    ASSERT_EQ(ray.size(), 2u);
    EXPECT_EQ(ray[0].sense, 1);
    EXPECT_EQ(ray[1].sense, -1);
    EXPECT_EQ(ray[0].depth, 1);
    EXPECT_EQ(ray[1].depth, 5);
  });
  EXPECT_EQ(hit, 7u * 5u);  // half-open: one of two opposite sides belongs to it
}

TEST(Polygonise, SphereIsClosedOutwardAndHasItsVolume) {
  const Mesh ball = simulated::sphere({1, 2, 3}, 20, 0.9);
  EXPECT_TRUE(is_closed(ball));
  EXPECT_NEAR(enclosed_volume_mm3(ball) / (4.0 / 3 * kPi * 8000), 1, 2e-3);
  for (const auto& vertex : ball.vertices_mm) EXPECT_NEAR((vertex - Vector3d(1, 2, 3)).norm(), 20, 0.02);
}

TEST(Fill, MeanOverALineIsExact) {
  Bone bone;
  bone.fill_z_mm = {0, 10, 30};
  bone.fill_fraction = {0.4, 0.2, 0};
  const Fill fill(bone);
  EXPECT_NEAR(fill.at(5), 0.3, 1e-12);
  EXPECT_NEAR(fill.mean(0, 10), 0.3, 1e-12);
  EXPECT_NEAR(fill.mean(0, 30), (3.0 + 2.0) / 30, 1e-12);
  EXPECT_NEAR(fill.mean(30, 0), (3.0 + 2.0) / 30, 1e-12);
  EXPECT_NEAR(fill.mean(-10, 10), 0.35, 1e-12);
  EXPECT_NEAR(fill.mean(4, 4 + 1e-6), 0.32, 1e-6);
}

// What each pixel of an image shows, for boxes whose shadows are known.

/// A box of bone, 40 x 2 x 60 mm, thin along the beam of the frontal view.
ClutteredPhantom box_of_bone() { return {whole(box_between({-20, -1, -30}, {20, 1, 30})), {}, {}}; }

Inputs in_beam(const ClutteredPhantom& phantom, int size_px = 256) {
  return {{"phantom", item(phantom)}, {"cameras", per_view("frontal", simulated::camera(0, size_px))}};
}
cv::Mat classes(const ClutteredPhantom& phantom, const Options& options = {}, int size_px = 256) {
  return output_list<Image>("simulate.labels", "classes", in_beam(phantom, size_px), options)[0].pixels;
}

int at(const cv::Mat& image, double x_mm, double z_mm) {
  const Vector2d pixel = project(simulated::camera(0, image.cols), Vector3d(x_mm, 0, z_mm));
  return image.at<std::uint8_t>(int(std::lround(pixel.y())), int(std::lround(pixel.x())));
}

TEST(SimulateLabels, BoneIsSeenWhereTheBoxIs) {
  const cv::Mat image = classes(box_of_bone());
  ASSERT_EQ(image.type(), CV_8UC1);
  for (const double side : {-1.0, 1.0}) {
    EXPECT_EQ(at(image, side * 18.5, 0), 80);
    EXPECT_EQ(at(image, side * 21.5, 0), 0);
    EXPECT_EQ(at(image, 0, side * 28.5), 80);
    EXPECT_EQ(at(image, 0, side * 31.5), 0);
  }
}

TEST(SimulateLabels, MetalCountsBeforeAndBehindBoneAndOtherBonesAreBone) {
  ClutteredPhantom phantom = box_of_bone();
  phantom.bodies.push_back(body("steel", box_between({-5, 20, -5}, {5, 22, 5})));              // behind the bone
  phantom.bodies.push_back(body("plastic", box_between({-40, -22, -10}, {-30, -20, 10})));     // background
  phantom.bodies.push_back(body("cancellous bone", box_between({30, -1, -10}, {40, 1, 10})));  // another bone
  phantom.bodies.push_back(body("copper", box_between({30, -1, -60}, {40, 1, -50})));
  phantom.tissues.push_back(body("fat", box_between({-60, -60, -60}, {60, 60, 60})));
  const cv::Mat image = classes(phantom);
  EXPECT_EQ(at(image, 0, 0), 160);
  EXPECT_EQ(at(image, 0, 10), 80);
  EXPECT_EQ(at(image, -35, 0), 0);
  EXPECT_EQ(at(image, 35, 0), 80);
  EXPECT_EQ(at(image, 35, -55), 160);
}

TEST(SimulateLabels, OutsideIsWhereTheCollimatorDarkensTheExportedImage) {
  const int size_px = 128;
  const View view =
      view_of("frontal", simulated::camera(0, size_px), cv::Mat(size_px, size_px, CV_16U, cv::Scalar(10000)));
  for (const char* level : {"mild", "usual", "bad"}) {
    const Options options{{"collimator", std::string(level)}, {"collimator_seed", 7}};
    const View exported = output_list<View>("simulate.export", "views", {{"views", each_view(view)}}, options)[0];
    const cv::Mat image = classes(box_of_bone(), options, size_px);
    int outside = 0;
    for (int v = 0; v < size_px; ++v)
      for (int u = 0; u < size_px; ++u) {
        const bool is_outside = image.at<std::uint8_t>(v, u) == 240;
        outside += is_outside;
        // Behind a blade 2 % pass, so half of the beam is 0.02 + 0.98 * 0.5 of the grey value.
        ASSERT_EQ(is_outside, grey(exported, u, v) < 5100) << level << ": " << u << ", " << v;
      }
    EXPECT_GT(outside, size_px) << level;
    EXPECT_LT(outside, size_px * size_px / 2) << level;
  }
}

TEST(SimulateLabels, SaysWhatReachesToTheSource) {
  ClutteredPhantom phantom = box_of_bone();
  phantom.bodies.push_back(body("steel", box_between({-5, -700, -5}, {5, -500, 5})));
  const std::string message = refusal("simulate.labels", in_beam(phantom));
  EXPECT_HAS(message, "simulate.labels: something in the beam reaches to ");
  EXPECT_HAS(message, "it must lie in front of the source");
}

}  // namespace marrow::test::ct_test
