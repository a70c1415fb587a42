// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <marrow/runtime/node/types.hpp>
#include <set>

#include "tests/framework/domain/shapes.hpp"

namespace hash_test {

using marrow::hash_of;

/// That `value` hashes the same as a copy, and each change gives yet another hash.
template <class T, class... Changes>
void expect_sensitive(const T& value, Changes... changes) {
  std::set<marrow::Digest> seen{hash_of(value)};
  EXPECT_EQ(hash_of(T(value)), hash_of(value));
  int number = 0;
  const auto one = [&](auto change) {
    T changed = value;
    change(changed);
    EXPECT_TRUE(seen.insert(hash_of(changed)).second) << "change " << number << " gave a hash that was seen before";
    ++number;
  };
  (one(changes), ...);
}

marrow::Camera some_camera() {
  marrow::Camera camera;
  camera.width_px = 40;
  camera.height_px = 30;
  return camera;
}

cv::Mat some_pixels() {
  cv::Mat pixels(30, 40, CV_16U);
  for (int y = 0; y < 30; ++y)
    for (int x = 0; x < 40; ++x) pixels.at<unsigned short>(y, x) = static_cast<unsigned short>(y * 40 + x);
  return pixels;
}

TEST(Hash, OfAnImageIsOfItsPixelsShapeAndType) {
  const cv::Mat large = some_pixels();
  const cv::Mat part = large(cv::Rect(5, 6, 20, 10));
  ASSERT_FALSE(part.isContinuous());
  EXPECT_EQ(hash_of(marrow::Image{part}), hash_of(marrow::Image{part.clone()}));
  EXPECT_NE(hash_of(marrow::Image{part}), hash_of(marrow::Image{large(cv::Rect(6, 6, 20, 10))}));
  const cv::Mat pixels(4, 6, CV_8U, cv::Scalar(0));
  std::set<marrow::Digest> seen;
  for (const cv::Mat& image : {pixels, cv::Mat(6, 4, CV_8U, cv::Scalar(0)), cv::Mat(4, 3, CV_16U, cv::Scalar(0)),
                               cv::Mat(4, 2, CV_8UC3, cv::Scalar::all(0)), cv::Mat()})
    EXPECT_TRUE(seen.insert(hash_of(marrow::Image{image})).second) << image.size() << " type " << image.type();
}

TEST(Hash, OfViewsAndVolumesDependsOnEachField) {
  expect_sensitive(
      marrow::View{"frontal", {some_pixels()}, some_camera(), {}}, [](auto& v) { v.name = "lateral"; },
      [](auto& v) { v.image.pixels = some_pixels() + 1; }, [](auto& v) { v.camera.width_px = 41; },
      [](auto& v) { v.camera.height_px = 31; }, [](auto& v) { v.camera.intrinsics(0, 2) += 1e-12; },
      [](auto& v) { v.camera.camera_from_world.translation_mm.z() = 1; },
      [](auto& v) { v.camera.camera_from_world.rotation(0, 1) = 1; },
      [](auto& v) { v.camera.camera_from_world.source = "ct"; },
      [](auto& v) { v.camera.camera_from_world.target = "ct"; },
      [](auto& v) { v.mask = cv::Mat(30, 40, CV_8U, cv::Scalar(255)); });
  marrow::Volume volume;
  volume.grid.size = {2, 3, 1};
  volume.values = {1, 2, 3, 4, 5, 6};
  expect_sensitive(
      volume,
      [](auto& v) {
        v.grid.size = {3, 2, 1};
      },
      [](auto& v) { v.grid.spacing_mm.x() = 2; }, [](auto& v) { v.grid.origin_mm.x() = 2; },
      [](auto& v) { v.grid.direction(0, 0) = -1; }, [](auto& v) { v.grid.frame = "mri"; },
      [](auto& v) { v.values[5] = 7; }, [](auto& v) { v.values.pop_back(); });
}

TEST(Hash, OfMeshesAndPosesDependsOnEachField) {
  expect_sensitive(
      marrow::test::box({1, 2, 3}, {4, 5, 6}), [](auto& m) { m.vertices_mm[7].z() += 1e-9; },
      [](auto& m) { std::swap(m.triangles[0], m.triangles[1]); }, [](auto& m) { m.frame = "world"; },
      [](auto& m) {
        m.vertices_mm.push_back({0, 0, 0});
      });
  expect_sensitive(
      marrow::Pose{}, [](auto& p) { p.world_from_model.translation_mm.y() = 1; },
      [](auto& p) { p.frame.origin_mm.y() = 1; }, [](auto& p) { p.frame.axes(0, 0) = -1; },
      [](auto& p) { p.covariance = marrow::Matrix6d::Zero(); },
      [](auto& p) { p.covariance = marrow::Matrix6d::Identity(); }, [](auto& p) { p.warnings = {"limit"}; },
      [](auto& p) { p.warnings = {""}; }, [](auto& p) { p.cost = 1; }, [](auto& p) { p.evaluations = 1; });
}

TEST(Hash, OfEdgesAndLinesDependsOnEachField) {
  expect_sensitive(
      marrow::EdgeMap{40, 30, {{1, 2, 3, 4, 5}}}, [](auto& e) { e.width_px = 30; }, [](auto& e) { e.height_px = 40; },
      [](auto& e) { e.pixels[0].u_px = 9; }, [](auto& e) { e.pixels[0].v_px = 9; },
      [](auto& e) { e.pixels[0].direction_u = 9; }, [](auto& e) { e.pixels[0].direction_v = 9; },
      [](auto& e) { e.pixels[0].magnitude = 9; }, [](auto& e) { e.pixels.clear(); });
  expect_sensitive(
      marrow::ShaftLines{}, [](auto& l) { l.left.from_px.x() = 1; }, [](auto& l) { l.left.to_px.x() = 1; },
      [](auto& l) { l.right.from_px.x() = 1; }, [](auto& l) { l.width_mm = 1; },
      [](auto& l) { l.width_deviation_mm = 1; }, [](auto& l) { l.log_likelihood = 1; },
      [](auto& l) { l.rejected.resize(1); },
      [](auto& l) {
        l.rejected.resize(1);
        l.rejected[0].reason = "too wide";
      });
}

TEST(Hash, OfACaseDependsOnNamesAndItems) {
  marrow::Case a;
  a.seeds.add("distal", {"distal", {{1, 2, 3}}, true});
  expect_sensitive(
      a,
      [](auto& c) {
        c.seeds.add("proximal", {"proximal", {}, true});
      },
      [](auto& c) { c.views.add("frontal", marrow::View{}); }, [](auto& c) { c.start.add("distal", marrow::Pose{}); },
      [](auto& c) { c.truth.add("distal", marrow::Truth{}); },
      [](auto& c) {
        c.seeds = {};
        c.seeds.add("other", {"distal", {{1, 2, 3}}, true});
      },
      [](auto& c) {
        c.seeds = {};
        c.seeds.add("distal", {"distal", {{1, 2, 3}}, false});
      });
}

TEST(Hash, NeighboursDoNotRunTogetherAndHexIsWritten) {
  using Texts = std::vector<std::string>;
  EXPECT_NE(hash_of(Texts{"ab", "c"}), hash_of(Texts{"a", "bc"}));
  EXPECT_NE(hash_of(Texts{""}), hash_of(Texts{}));
  EXPECT_NE(hash_of(std::vector<int>{0}), hash_of(std::vector<int>{}));
  EXPECT_NE(hash_of(std::optional<int>{}), hash_of(std::optional<int>{0}));
  EXPECT_NE(hash_of(std::map<std::string, int>{{"a", 1}}), hash_of(std::map<std::string, int>{{"a", 2}}));
  EXPECT_EQ((marrow::Digest{0xfedcba9876543210u, 0x1u}.hex()), "0000000000000001fedcba9876543210");
}

}  // namespace hash_test
