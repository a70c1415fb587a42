// SPDX-License-Identifier: Apache-2.0
// What the measures are worth on scenes with all in them that may matter: noise, masks, weights, levels, other fragments, borders.
// The numbers were worked out by the nodes themselves. Whoever changes one says so here; whoever did not mean to has made a mistake.
#include <algorithm>
#include <cmath>
#include <marrow/domain/features.hpp>
#include <random>

#include "intensity_behaviour.hpp"
#include "other_fragment.hpp"
#include "project/shapes.hpp"
#include "shipped.hpp"

namespace {

using intensity_behaviour::at;
using marrow::Cost;
using marrow::List;
using marrow::RigidTransform;
using marrow::View;

void expect(const std::vector<double>& found, const std::vector<double>& known, const std::string& what) {
  std::string text;
  for (const double number : found) text += (text.empty() ? "" : ", ") + std::to_string(number);
  ASSERT_EQ(found.size(), known.size()) << what << ": {" << text << "}";
  for (std::size_t i = 0; i < found.size(); ++i) EXPECT_NEAR(found[i], known[i], 2e-6) << what << ", number " << i + 1 << " of {" << text << "}";
}

/// The blobs, which also have outlines: circles of two of their widths.
class BlobsWithOutlines : public intensity_behaviour::BlobProjector {
 public:
  std::vector<marrow::OutlinePoint> outline(const marrow::Camera& camera, const RigidTransform& pose, double spacing_px) const override {
    std::vector<marrow::OutlinePoint> points;
    for (const auto& [u0, v0, radius] : {std::array{90.0, 80.0, 18.0}, {118.0, 96.0, 12.0}})
      for (double along = 0; along < 2 * marrow::kPi * radius; along += spacing_px) {
        const double c = std::cos(along / radius), s = std::sin(along / radius), u = u0 + radius * c + pose.translation_mm.x(), v = v0 + radius * s + pose.translation_mm.y();
        if (u >= 0 && v >= 0 && u <= camera.width_px - 1 && v <= camera.height_px - 1)
          points.push_back({float(u), float(v), float(c), float(s), Eigen::Vector3f(float(u - 100), float(85 - v), float(3 * c))});
      }
    return points;
  }
};

/// One view of whole numbers with a mask, and one of fractions in which some pixels are no numbers and some black.
List<View> views() {
  View masked = intensity_behaviour::view_of(50000, 0.02, 400), broken = intensity_behaviour::view_of(30000, 0.03, 200, "lateral");
  masked.mask = cv::Mat(170, 200, CV_8U, cv::Scalar(255));
  for (int v = 0; v < 170; ++v)
    for (int u = 0; u < 200; ++u)
      if (u + 2 * v < 190 || (u > 112 && v > 99 && u < 125)) masked.mask.at<std::uint8_t>(v, u) = 0;
  broken.image.pixels.convertTo(broken.image.pixels, CV_32F, 1.0 / 30000);
  for (int v = 60; v < 110; v += 7)
    for (int u = 50; u < 150; u += 11) broken.image.pixels.at<float>(v, u) = u % 2 ? std::nanf("") : 0.0f;
  List<View> views;
  views.add("frontal", masked);
  views.add("lateral", broken);
  return views;
}

/// Edges about the circles, some moved, some missing, and others anywhere.
List<marrow::EdgeMap> edges() {
  List<marrow::EdgeMap> edges;
  for (const unsigned seed : {1u, 2u}) {
    std::mt19937 random(seed);
    const auto part = [&] { return double(random()) / 4294967296.0; };
    marrow::EdgeMap map{200, 170, {}};
    for (const auto& [u0, v0, radius] : {std::array{90.0, 80.0, 18.0}, {118.0, 96.0, 12.0}})
      for (double angle = 0; angle < 6.28; angle += 0.9 / radius) {
        const double off = 1.2 * (part() - 0.5) + 0.4, c = std::cos(angle), s = std::sin(angle), turn = angle + 0.8 * (part() - 0.5);
        if (part() > 0.2)
          map.pixels.push_back({float(u0 + (radius + off) * c), float(v0 + (radius + off) * s), float(std::cos(turn)), float(std::sin(turn)), float(1 + part())});
      }
    for (int i = 0; i < 250; ++i) {
      const double turn = 6.28 * part();
      map.pixels.push_back({float(199 * part()), float(169 * part()), float(std::cos(turn)), float(std::sin(turn)), float(part())});
    }
    edges.add(seed == 1 ? "frontal" : "lateral", map);
  }
  return edges;
}

const std::vector<RigidTransform>& poses() {
  static const std::vector<RigidTransform> poses{at(0, 0), at(2.3, -1.2), at(-30.5, 12.25), at(80, 50), at(-70.5, -52)};
  return poses;
}

/// At its own level in five places, and in two at a coarser and a finer one.
std::vector<double> values_of(const std::string& node, const shipped::Inputs& inputs, const shipped::Options& options) {
  const marrow::Value made = shipped::call("similarity." + node, inputs, options).at("cost");
  const Cost& cost = made.as<Cost>();
  std::vector<double> values = cost.values(poses());
  for (const marrow::CostLevel& level : {marrow::CostLevel{4, 9, 4}, marrow::CostLevel{1.5, 4, 1}})
    for (const std::size_t pose : {1u, 2u}) values.push_back(cost.at_level(level)->value(poses()[pose]));
  return values;
}

shipped::Inputs blobs(bool with_edges, bool with_other) {
  shipped::Inputs inputs{{"projector", marrow::Value::of<marrow::Projector>(std::make_shared<const BlobsWithOutlines>())}, {"views", shipped::list(views(), "view")}};
  if (with_edges) inputs["edges"] = shipped::list(edges(), "view");
  if (!with_other) return inputs;
  const auto own = std::make_shared<const BlobsWithOutlines>();
  if (with_edges) return other_fragment::Fragments{own, std::make_shared<const other_fragment::SquareOutline>()}.with(inputs);
  return other_fragment::Fragments{own, std::make_shared<const other_fragment::SquareProjector>()}.with(inputs);
}

}  // namespace

TEST(Numbers, OfGreyValues) {
  const std::vector<std::pair<std::string, std::vector<double>>> known{
      {"entropy_of_difference", {}},
      {"gradient_correlation", {}},
      {"gradient_difference", {}},
      {"gradient_orientation", {}},
      {"mutual_information", {}},
      {"normalised_cross_correlation", {}},
      {"patch_correlation", {}},
      {"patch_gradient_correlation", {}},
      {"pattern_intensity", {}},
  };
  for (const auto& [node, numbers] : known) expect(values_of(node, blobs(false, false), {{"weights", std::vector<double>{2, 1}}, {"blur_px", 0.7}, {"margin_px", std::int64_t(9)}}), numbers, node);
}

TEST(Numbers, OfGreyValuesBesideAnotherFragment) {
  expect(values_of("normalised_cross_correlation", blobs(false, true), {}), {}, "drawn");
  shipped::Inputs outlined = blobs(false, false);
  outlined = other_fragment::Fragments{std::make_shared<const BlobsWithOutlines>(), std::make_shared<const other_fragment::SquareOutline>()}.with(outlined);
  expect(values_of("normalised_cross_correlation", outlined, {}), {}, "outlined");
}

TEST(Numbers, OfEdges) {
  const std::vector<double> weights{1, 3};
  expect(values_of("contour_distance", blobs(true, false), {{"weights", weights}}), {}, "one way");
  expect(values_of("contour_distance", blobs(true, false), {{"symmetric", true}, {"direction_tolerance_deg", 25.0}}), {}, "both ways");
  expect(values_of("contour_distance", blobs(true, true), {{"estimate_offset", false}, {"edge_offset_px", 0.5}, {"scale_px", 2.0}, {"others_reach_px", 5.0}}), {}, "with an offset");
  expect(values_of("drr_edges", blobs(true, false), {{"weights", weights}}), {}, "of radiographs");
  expect(values_of("drr_edges", blobs(true, true), {{"pixel_step", std::int64_t(3)}, {"blur_px", 3.0}, {"threshold_percent", 30.0}}), {}, "of blurred radiographs");
}

TEST(Numbers, OfTheContoursNoise) {
  std::vector<double> factors;
  for (const double error_px : {0.0, 0.4})
    for (const bool weighted : {false, true}) {
      const shipped::Inputs inputs = blobs(true, false);
      const marrow::Value made = shipped::call("similarity.contour_distance", inputs, {{"model_error_px", error_px}, {"weights", weighted ? std::vector<double>{1, 3} : std::vector<double>{}}}).at("cost");
      for (std::size_t pose = 0; pose < 3; ++pose) factors.push_back(std::log(made.as<Cost>().likelihood_factor(poses()[pose]).value_or(1)));
    }
  expect(factors, {}, "logarithms of the factors");
}

namespace {

/// A ball with a lump on it, in a grid that is turned and has three spacings.
constexpr double kRadius_mm = 18;
double depth_mm(const Eigen::Vector3d& p) { return std::max(kRadius_mm - p.norm(), 7 - (p - Eigen::Vector3d(13, 8, 9)).norm()); }

marrow::Grid grid() {
  marrow::Grid grid;
  grid.size = {46, 38, 60};
  grid.spacing_mm = {1.1, 1.4, 0.9};
  grid.direction = marrow::rotation_from_vector({0.2, -0.1, 0.3});
  grid.origin_mm = -grid.direction * Eigen::Vector3d(23 * 1.1, 19 * 1.4, 30 * 0.9);
  return grid;
}

template <class Value>
std::vector<float> filled(const marrow::Grid& grid, Value value) {
  std::vector<float> values;
  for (int z = 0; z < grid.size[2]; ++z)
    for (int y = 0; y < grid.size[1]; ++y)
      for (int x = 0; x < grid.size[0]; ++x) values.push_back(float(value(grid.point_from_index({double(x), double(y), double(z)}))));
  return values;
}

marrow::View lumpy_view(double angle_deg) {
  View view{angle_deg > 0 ? "lateral" : "frontal", {}, shapes::c_arm(angle_deg, 256), {}};
  view.image.pixels = cv::Mat(256, 256, CV_16U);
  std::mt19937 random(unsigned(angle_deg) + 1);
  const Eigen::Vector3d source = marrow::source_position_mm(view.camera);
  for (int v = 0; v < 256; ++v)
    for (int u = 0; u < 256; ++u) {
      const Eigen::Vector3d direction = marrow::ray_direction(view.camera, Eigen::Vector2d(u, v));
      double inside = 0;
      for (double t = 560; t < 640; t += 1) inside += std::clamp(depth_mm(source + t * direction) + 0.5, 0.0, 1.0);
      view.image.pixels.at<std::uint16_t>(v, u) = std::uint16_t(40000 * std::exp(-0.02 * inside - 0.002 * u) + 300 * (double(random()) / 4294967296.0));
    }
  if (angle_deg > 0) {
    view.mask = cv::Mat(256, 256, CV_8U, cv::Scalar(1));
    view.mask.colRange(0, 90).setTo(0);
  }
  return view;
}

RigidTransform moved(double rx, double ry, double rz, double tx, double ty, double tz) {
  marrow::Vector6d motion;
  motion << rx, ry, rz, tx, ty, tz;
  return marrow::moved(RigidTransform{"world", "ct"}, {}, motion);
}

const std::vector<RigidTransform>& places() {
  static const std::vector<RigidTransform> places{moved(0, 0, 0, 0, 0, 0), moved(0.05, -0.04, 0.1, 0.8, -0.5, 1.1), moved(-0.2, 0.3, -0.1, -3, 2, 4), moved(0.1, 0, 0, 40, -20, 38)};
  return places;
}

std::vector<double> values_at_places(const marrow::Value& made) {
  std::vector<double> values = made.as<Cost>().values(places());
  for (const marrow::CostLevel& level : {marrow::CostLevel{5, 9, 2}, marrow::CostLevel{1, 4, 1}})
    for (const std::size_t place : {1u, 2u}) values.push_back(made.as<Cost>().at_level(level)->value(places()[place]));
  return values;
}

}  // namespace

TEST(Numbers, OfProjectedGradients) {
  marrow::Volume volume;
  volume.grid = grid();
  volume.values = filled(volume.grid, [](const Eigen::Vector3d& p) { return 900 * std::clamp(0.5 * depth_mm(p) + 0.5, 0.0, 1.0) + 4 * p.x(); });
  marrow::Mesh mesh = shapes::sphere(kRadius_mm);
  for (auto& vertex : mesh.vertices_mm) vertex.z() -= kRadius_mm;
  List<View> views;
  for (const double angle : {0.0, 90.0}) views.add(angle > 0 ? "lateral" : "frontal", lumpy_view(angle));
  const shipped::Inputs inputs{{"mesh", shipped::item(mesh)}, {"volume", shipped::item(volume)}, {"views", shipped::list(views, "view")}};
  expect(values_at_places(shipped::call("similarity.gradient_projection", inputs, {{"weights", std::vector<double>{3, 2}}}).at("cost")), {}, "by weights");
  expect(values_at_places(shipped::call("similarity.gradient_projection", inputs, {{"points", std::int64_t(700)}, {"blur_px", 2.5}, {"touch_deg", 15.0}}).at("cost")), {}, "blurred");
}

TEST(Numbers, OfRays) {
  marrow::SignedField field;
  field.grid = grid();
  field.values_mm = filled(field.grid, [](const Eigen::Vector3d& p) { return std::clamp(-depth_mm(p), -6.0, 6.0); });
  List<View> views;
  List<marrow::EdgeMap> maps;
  for (const double angle : {0.0, 90.0}) {
    View view{angle > 0 ? "lateral" : "frontal", {}, shapes::c_arm(angle, 256), {}};
    std::mt19937 random(unsigned(angle) + 1);
    const auto part = [&] { return double(random()) / 4294967296.0; };
    marrow::EdgeMap map{256, 256, {}};
    for (int i = 0; i < 300; ++i) {
      const double at = 0.02094 * i, radius = 51 + 4 * (part() - 0.5), turn = at + 0.5 * (part() - 0.5);
      map.pixels.push_back({float(127.5 + radius * std::cos(at)), float(127.5 + radius * std::sin(at)), float(std::cos(turn)), float(std::sin(turn)), 1});
    }
    map.pixels.push_back({-3, 4, 1, 0, 1});  // not in the image
    map.pixels.push_back({300, 4, 1, 0, 1});
    if (angle > 0) {
      view.mask = cv::Mat(256, 256, CV_8U, cv::Scalar(1));
      view.mask.rowRange(0, 90).setTo(0);
    }
    views.add(view.name, view);
    maps.add(view.name, map);
  }
  const shipped::Inputs inputs{{"field", shipped::item(field)}, {"views", shipped::list(views, "view")}, {"edges", shipped::list(maps, "view")}};
  expect(values_at_places(shipped::call("similarity.ray_to_surface", inputs, {{"weights", std::vector<double>{3, 2}}}).at("cost")), {}, "by weights");
  const marrow::Value made = shipped::call("similarity.ray_to_surface", inputs, {{"edge_offset_mm", -0.6}, {"ray_step", std::int64_t(1)}, {"direction_tolerance_deg", 70.0}, {"reach_mm", 3.0}}).at("cost");
  expect(values_at_places(made), {}, "with an offset");
  const auto about = made.as<Cost>().expansion(places()[1], {Eigen::Vector3d(1, 2, 3), marrow::rotation_from_vector({0.3, 0.2, -0.1})});
  std::vector<double> numbers{about->value};
  for (int i = 0; i < 6; ++i) numbers.push_back(about->gradient[i]);
  for (int i = 0; i < 6; ++i) numbers.push_back(about->curvature(i, (i + 1) % 6));
  expect(numbers, {}, "its derivatives");
}
