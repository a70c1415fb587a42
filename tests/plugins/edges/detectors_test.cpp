// SPDX-License-Identifier: Apache-2.0
// What every edge detector must do, on images whose edges are known exactly.
#include <chrono>
#include <cstdio>
#include <numeric>
#include <opencv2/imgcodecs.hpp>

#include "tests/plugins/edges/radiograph.hpp"

namespace marrow::test::detectors_test {

using edges::drawn;

class Edges : public testing::TestWithParam<std::string> {
 protected:
  marrow::EdgeMap find_edges(const marrow::View& view) const { return edges::found(GetParam(), view); }
};

INSTANTIATE_TEST_SUITE_P(, Edges, testing::ValuesIn(edges::kDetectors),
                         [](const auto& detector) { return detector.param; });

TEST_P(Edges, LieOnAStraightStepAtAnyOrientation) {
  double largest = 0, sum = 0, largest_turn_deg = 0;
  int count = 0;
  for (double angle_deg = 0; angle_deg < 360; angle_deg += 15) {
    const double nu = std::cos(radians(angle_deg)), nv = std::sin(radians(angle_deg)), at = 0.013 * angle_deg;
    const auto side = [&](double u, double v) { return (u - 63.5) * nu + (v - 63.5) * nv - at; };
    const auto view = drawn(128, [&](double u, double v) { return side(u, v) > 0 ? 11000.0 : 10000.0; });
    const EdgeMap edges = find_edges(view);
    EXPECT_EQ(edges.width_px, 128);
    EXPECT_GT(edges.pixels.size(), 100u) << angle_deg;
    for (const EdgePixel& edge : edges.pixels) {
      const double error = side(edge.u_px, edge.v_px);
      largest = std::max(largest, std::abs(error));
      sum += error, ++count;
      largest_turn_deg =
          std::max(largest_turn_deg, degrees(std::acos(std::min(1.0, edge.direction_u * nu + edge.direction_v * nv))));
    }
  }
  std::printf("straight step: mean %.4f px, largest %.4f px, direction within %.2f deg\n", sum / count, largest,
              largest_turn_deg);
  EXPECT_LT(largest, 0.1);
  EXPECT_LT(std::abs(sum / count), 0.02);
  EXPECT_LT(largest_turn_deg, 1.0);
}

TEST_P(Edges, OfADarkDiscPointOutwardsAndComeInRowOrder) {
  const auto view =
      drawn(200, [](double u, double v) { return std::hypot(u - 101.3, v - 98.6) < 60.4 ? 28500.0 : 30000.0; });
  const EdgeMap edges = find_edges(view);
  EXPECT_GT(edges.pixels.size(), 300u);
  double sum = 0, largest = 0;
  int last = -1;
  for (const EdgePixel& edge : edges.pixels) {
    const double du = edge.u_px - 101.3, dv = edge.v_px - 98.6, radius = std::hypot(du, dv);
    EXPECT_GT((du * edge.direction_u + dv * edge.direction_v) / radius, 0.999);
    EXPECT_NEAR(std::hypot(edge.direction_u, edge.direction_v), 1, 1e-5);
    const double sharp = 1500 / (std::sqrt(2 * kPi) * 1.5);  // before the blur of pixel and mask
    EXPECT_NEAR(edge.magnitude, 0.93 * sharp, 0.08 * sharp);
    sum += radius - 60.4;
    largest = std::max(largest, std::abs(radius - 60.4));
    const int pixel = int(std::lround(edge.v_px)) * 200 + int(std::lround(edge.u_px));
    EXPECT_GT(pixel, last);
    last = pixel;
  }
  std::printf("disc: mean %.4f px, largest %.4f px, %zu edges\n", sum / double(edges.pixels.size()), largest,
              edges.pixels.size());
  EXPECT_LT(std::abs(sum / double(edges.pixels.size())), 0.05);
  EXPECT_LT(largest, 0.15);
}

TEST_P(Edges, AreScarceInPureNoise) {
  const auto view = drawn(
      256, [](double, double) { return 20000.0; }, 300);
  const double fraction = double(find_edges(view).pixels.size()) / (256 * 256);
  std::printf("pure noise: %.4f %% of the pixels\n", 100 * fraction);
  EXPECT_LT(fraction, 0.001);
}

TEST_P(Edges,
       AreFoundInTheDarkAsInTheLight) {  // the exposure falls tenfold from left to right, the bar takes 10 % everywhere
  const auto view = drawn(
      256, [](double u, double v) { return 50000 * std::pow(0.1, u / 255) * (std::abs(v - 128) < 20 ? 0.9 : 1.0); },
      30);
  std::vector<int> upper(256, 0), lower(256, 0);
  for (const EdgePixel& edge : find_edges(view).pixels) {
    if (std::abs(edge.v_px - 108) < 1) upper[std::size_t(edge.u_px)] = 1;
    if (std::abs(edge.v_px - 148) < 1) lower[std::size_t(edge.u_px)] = 1;
  }
  EXPECT_GT(std::accumulate(upper.begin(), upper.end(), 0), 224);
  EXPECT_GT(std::accumulate(lower.begin(), lower.end(), 0), 224);
}

/// The largest run of rows in which no edge lies within 2 px of a border of the shaft.
int largest_gap(const EdgeMap& edges, const View& view, const radiograph::Cylinder& bone) {
  const Vector3d source = source_position_mm(view.camera);
  std::vector<int> seen(edges.height_px, 0);
  for (const EdgePixel& edge : edges.pixels) {
    const Vector3d ray = ray_direction(view.camera, {edge.u_px, edge.v_px});
    const Vector3d normal = ray.cross(bone.direction).normalized();
    const double miss_mm = normal.dot(source - bone.point);  // signed distance of the ray from the shaft's axis
    const double off_px = (std::abs(miss_mm) - bone.radius_mm) / pixel_size_at_mm(view.camera, bone.point);
    if (std::abs(off_px) < 2.5) seen[std::size_t(std::lround(edge.v_px))] |= miss_mm > 0 ? 1 : 2;
  }
  int gap = 0, largest = 0;
  for (int v = 10; v < edges.height_px - 10; ++v) {
    gap = seen[v] == 3 ? 0 : gap + 1;
    largest = std::max(largest, gap);
  }
  return largest;
}

TEST_P(Edges, OfANoisyHollowBoneInAThighAreContinuous) {
  for (const double photons : {3000.0, 20000.0}) {
    const auto scene = radiograph::shaft({5, 3, 0}, {0.08, 0.05, 1});
    const auto view = radiograph::image("frontal", radiograph::camera(0), scene, photons, 7);
    const EdgeMap edges = find_edges(view);
    const int gap = largest_gap(edges, view, scene.cylinders[1]);
    std::printf("hollow bone, %.0f photons: largest gap %d rows, %zu edges\n", photons, gap, edges.pixels.size());
    EXPECT_LE(gap, 3);
  }
}

TEST_P(Edges, KeepAwayFromMaskCollimatorAndImageBorder) {
  const auto disc = [](double u, double v) { return std::hypot(u - 127.5, v - 127.5); };
  auto view = drawn(
      256, [&](double u, double v) { return disc(u, v) > 120  ? 100.0
                                            : disc(u, v) < 40 ? 10000.0
                                                              : 30000.0; }, 20);
  for (const EdgePixel& edge : find_edges(view).pixels) EXPECT_LT(disc(edge.u_px, edge.v_px), 100);
  const auto scattered = drawn(  // as behind a real collimator: not black, and blurred
      256,
      [&](double u, double v) {
        const double inside = 1 / (1 + std::exp(disc(u, v) - 120));
        return (1 - inside) * 2500 * (1 + std::sin(0.1 * u) * std::cos(0.08 * v)) +
               inside * (std::abs(u - 128) < 30 ? 8000 : 30000);
      },
      20);
  const EdgeMap in_scatter = find_edges(scattered);
  EXPECT_GT(in_scatter.pixels.size(), 350u);
  for (const EdgePixel& edge : in_scatter.pixels) EXPECT_LT(disc(edge.u_px, edge.v_px), 115);
  view.mask = cv::Mat(256, 256, CV_8U, cv::Scalar(0));
  view.mask.colRange(0, 128) = 255;
  const EdgeMap edges = find_edges(view);
  EXPECT_GT(edges.pixels.size(), 80u);
  for (const EdgePixel& edge : edges.pixels) EXPECT_LT(edge.u_px, 128 - 4);
}

// Real frames of a knee (Brown University, see the data folder's README): an intensifier's round field with scatter
// beyond it, in the first one cut by the collimator.
TEST_P(Edges, KeepInsideTheFieldOfRealFrames) {
  const std::string folder = MARROW_SOURCE_DIR "/../shared/data/knee/images/";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "the real knee is not here: " << folder;
  for (const auto& [name, u, v] : {std::tuple<std::string, double, double>{"L_Hop_Cam1_001_UND.0138.tif", 852, 868},
                                   {"L_Hop_Cam2_001_UND.0138.tif", 865, 898}}) {
    View view;
    view.name = name;
    view.image.pixels = cv::imread(folder + name, cv::IMREAD_GRAYSCALE);
    view.camera = radiograph::camera(0, view.image.width());
    const EdgeMap edges = find_edges(view);
    const auto near_rim = std::count_if(edges.pixels.begin(), edges.pixels.end(), [&](const EdgePixel& edge) {
      return std::hypot(edge.u_px - u, edge.v_px - v) > 883 - 16;
    });
    std::printf("%s: %zu edges, %td within 16 px of the rim or beyond\n", name.c_str(), edges.pixels.size(), near_rim);
    EXPECT_GT(edges.pixels.size(), 5000u);
    EXPECT_EQ(near_rim, 0);
  }
}

TEST_P(Edges, SayWhatIsWrongWithAnImage) {
  const View good = drawn(64, [](double u, double) { return u < 30 ? 500.0 : 900.0; });
  const auto said = [&](const std::function<void(View&)>& change) {
    View view = good;
    change(view);
    return MESSAGE_OF(find_edges(view));
  };
  EXPECT_EQ(said([](View& view) { view.image.pixels = cv::Mat(64, 64, CV_16U, cv::Scalar(1234)); }),
            "view 'frontal': all pixels have the same value 1234, so there is no edge; check the image file");
  EXPECT_EQ(said([&](View& view) {
              good.image.pixels.convertTo(view.image.pixels, CV_32F);
              view.image.pixels.at<float>(3, 3) = std::numeric_limits<float>::quiet_NaN();
            }),
            "view 'frontal': the image holds pixels that are not finite (NaN or infinity)");
  EXPECT_EQ(said([&](View& view) { good.image.pixels.convertTo(view.image.pixels, CV_32F, -1); }),
            "view 'frontal': the image has no positive grey value, so its logarithm cannot be taken");
  EXPECT_EQ(
      said([](View& view) { view.mask = cv::Mat(64, 64, CV_8U, cv::Scalar(0)); }),
      "view 'frontal': no pixel is left to search for edges (mask, image border and smoothing take all of 64 x 64)");
  EXPECT_EQ(said([](View& view) { view.image.pixels = cv::Mat(64, 64, CV_8UC3, cv::Scalar(1, 2, 3)); }),
            "view 'frontal': the image must have one channel of 8 or 16 bit whole numbers or 32 bit floats");
  EXPECT_HAS(said([](View& view) { view.camera.width_px = 65; }), "64 x 64 pixels, but its camera is for 65 x 64");
  EXPECT_EQ(said([](View& view) { view.image.pixels = cv::Mat(); }), "view 'frontal': the image is empty");
}

TEST_P(Edges, AreFoundInReasonableTime) {
  for (const int size : {512, 1024}) {
    const auto view = radiograph::image("frontal", radiograph::camera(0, size),
                                        radiograph::shaft({5, 3, 0}, {0.08, 0.05, 1}), 5000, 7);
    double best_ms = 1e9;
    for (int run = 0; run < 5; ++run) {
      const auto start = std::chrono::steady_clock::now();
      find_edges(view);
      best_ms = std::min(best_ms,
                         std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
    }
    std::printf("%d x %d: %.1f ms\n", size, size, best_ms);
    EXPECT_LT(best_ms, 10000);  // a wide margin, for a busy machine
  }
}

TEST(Canny, DeclaresTheOrderOfItsThresholds) {
  EXPECT_TRUE(declares("edges.canny", not_above("noise_low", "noise_high")));
}

}  // namespace marrow::test::detectors_test
