// SPDX-License-Identifier: Apache-2.0
// From simulated images of plates to the distortion. The truth is no polynomial, and its points are no dots.

#include <marrow/testing/node.hpp>

#include "marrow/toolbox/distortion/fit.hpp"
#include "marrow/toolbox/distortion/plate.hpp"
#include "tests/plugins/read/files.hpp"

namespace plate_test {

using namespace marrow;
using namespace marrow::test;
using distortion::Distortion, distortion::PlatePoints;
using Eigen::Vector2d;
using node_test::call, node_test::item, node_test::list;

struct Simulated {
  List<Image> images;
  List<PlatePoints> truth;
};

/// A device half as large as a real one: 512 pixels, a field of 235 px, neighbours 14.7 px apart.
Simulated simulated(std::uint64_t seed, node_test::Options options = {}) {
  options.insert({{"width_px", std::int64_t(512)},
                  {"height_px", std::int64_t(512)},
                  {"field_px", 235.0},
                  {"pincushion_px", 12.0},
                  {"turn_deg", -0.6}});
  const auto outputs = call("simulate.distortion_plate", {}, options, Context(seed));
  return {outputs.at("images").as_list<Image>(), outputs.at("true_points").as_list<PlatePoints>()};
}

double figure(const Value& metrics, const std::string& name) {
  for (const Metric& metric : metrics.as<Metrics>().items)
    if (metric.name == name) return metric.value;
  throw Error("there is no figure " + name);
}

struct Errors {
  double usual_px = 0, worst_px = 0, share = 0;
};

Errors errors_of(const Value& distortion, const PlatePoints& truth) {
  const auto outputs = call("evaluate.distortion", {{"distortion", distortion}, {"true_points", item(truth)}});
  const Value& metrics = outputs.at("metrics");
  return {figure(metrics, "error"), figure(metrics, "worst_error"), figure(metrics, "measured_share")};
}

struct Case {
  std::string name;
  node_test::Options options;
  double limit_px;
  double share = 88;  ///< of the true points that must be measured
};

class DistortionPlate : public testing::TestWithParam<Case> {};

TEST_P(DistortionPlate, StraightensPointsThatItDidNotSee) {
  const Simulated device = simulated(5, GetParam().options);
  const auto found = call("camera.distortion_plate", {{"image", item(device.images[0])}});
  const Errors errors = errors_of(found.at("distortion"), device.truth[0]);
  std::string told;
  for (const char* name : {"points", "outliers", "degree", "local", "residual", "validated"})
    told += std::string(name) + " " + std::to_string(figure(found.at("metrics"), name)) + ", ";
  EXPECT_LT(errors.usual_px, GetParam().limit_px) << told;
  EXPECT_LT(errors.worst_px, 6 * GetParam().limit_px) << told;
  EXPECT_GT(errors.share, GetParam().share);
}

const std::vector<Case> kCases{
    {"usual", {}, 0.05},
    {"hexagonal_dark", {{"grid", std::string("hexagonal")}, {"dots", std::string("dark")}}, 0.07},
    {"turned", {{"plate_turn_deg", 41.0}}, 0.05},
    {"missing", {{"missing_share", 0.05}}, 0.04},
    {"rod_apart", {{"instrument_px", 90.0}}, 0.07},
    {"half_covered", {{"covered_share", 0.4}}, 0.1, 45},
    {"uneven", {{"vignetting", 0.7}, {"unevenness", 0.6}}, 0.05},
    {"few_photons", {{"photons", 60.0}}, 0.1},
    {"blurred", {{"blur_px", 2.0}}, 0.05},
    {"barrel", {{"pincushion_px", -12.0}}, 0.05},
    {"iron", {{"iron_shift_px", 2.0}}, 0.06},
};
INSTANTIATE_TEST_SUITE_P(Plates, DistortionPlate, testing::ValuesIn(kCases),
                         [](const auto& info) { return info.param.name; });

TEST(DistortionPlates, SayTheTurnThePincushionAndTheCoverage) {
  const Simulated device = simulated(2);
  const auto found = call("camera.distortion_plate", {{"image", item(device.images[0])}}, {{"dot_spacing_mm", 4.4}});
  const Value& metrics = found.at("metrics");
  EXPECT_NEAR(figure(metrics, "turn"), -0.6, 0.1);
  EXPECT_NEAR(figure(metrics, "pixel"), 0.3, 0.002);
  EXPECT_GT(figure(metrics, "field_coverage"), 90);  // the rim cuts the outermost dots
  EXPECT_NEAR(figure(metrics, "coverage"), 100 * 3.14159 * 235 * 235 / (512.0 * 512.0), 6);
  EXPECT_LT(figure(metrics, "residual"), 0.15);
  EXPECT_GE(figure(metrics, "validated"), figure(metrics, "residual"));
}

TEST(DistortionPlates, AMirroredImageHasTheMirroredDistortion) {
  const Simulated device = simulated(3);
  cv::Mat mirrored;
  cv::flip(device.images[0].pixels, mirrored, 1);
  const auto one = call("camera.distortion_plate", {{"image", item(device.images[0])}}),
             other = call("camera.distortion_plate", {{"image", item(Image{mirrored})}});
  EXPECT_NEAR(figure(one.at("metrics"), "turn"), -figure(other.at("metrics"), "turn"), 0.01);
  EXPECT_NEAR(figure(one.at("metrics"), "pincushion"), figure(other.at("metrics"), "pincushion"), 0.05);
  PlatePoints truth = device.truth[0];
  for (auto* places : {&truth.ideal_px, &truth.seen_px})
    for (Vector2d& place : *places) place.x() = 511 - place.x();
  EXPECT_LT(errors_of(other.at("distortion"), truth).usual_px, 0.05);
}

struct Tilted {
  double error_px = 0, perspective_px = 0, deviation_px = 0;
  std::string told;
};

Tilted found_on_tilted(double tilt_deg, const std::string& straight, double iron_shift_px = 0) {
  const Simulated device = simulated(4, {{"tilt_deg", tilt_deg}, {"iron_shift_px", iron_shift_px}});
  Tilted result;
  Context::Hooks hooks;
  hooks.log = [&](std::string_view text, LogLevel) { result.told += text; };
  const auto found =
      call("camera.distortion_plate", {{"image", item(device.images[0])}}, {{"straight", straight}}, Context(hooks));
  result.error_px = errors_of(found.at("distortion"), device.truth[0]).usual_px;
  result.perspective_px = figure(found.at("metrics"), "perspective");
  result.deviation_px = figure(found.at("metrics"), "perspective_deviation");
  return result;
}

// Half an image of 512 px of 0.3 mm at 1000 mm: a tilt of a moves its rim by 256^2 sin(a) 0.3 / 1000 px.
TEST(DistortionPlates, ATiltIsToldFromTheDistortionAndSaidIfItIsNotTaken) {
  for (const double tilt_deg : {2.0, 5.0, 15.0}) {
    const Tilted found = found_on_tilted(tilt_deg, "automatic");
    EXPECT_LT(found.error_px, 0.06) << tilt_deg;
    EXPECT_NEAR(found.perspective_px, 256 * 256 * std::sin(tilt_deg * 3.14159 / 180) * 0.3 / 1000, 0.15) << tilt_deg;
    EXPECT_LT(found.deviation_px, 0.1) << tilt_deg;
    EXPECT_HAS(found.told, "is taken out of the distortion; if the plate is parallel");
  }
  const Tilted parallel = found_on_tilted(0, "automatic");
  EXPECT_LT(parallel.perspective_px, 3 * parallel.deviation_px);
  EXPECT_EQ(parallel.told.find("tilt"), std::string::npos) << parallel.told;
  const Tilted found = found_on_tilted(5, "similarity");
  EXPECT_GT(found.error_px, 0.2);
  EXPECT_HAS(found.told, "it becomes a part of the distortion unless straight=automatic");
}

TEST(DistortionPlates, WhereIronHidesTheTiltThePlateIsTakenAsParallel) {
  const Tilted found = found_on_tilted(0, "automatic", 2);
  EXPECT_LT(found.error_px, 0.1);
  EXPECT_HAS(found.told, "which the distortion hides, so the plate is taken as parallel to the detector");
}

TEST(DistortionPlates, RefuseAnImageWithoutAPlate) {
  cv::Mat noise(256, 256, CV_16U);
  cv::theRNG().state = 7;
  cv::randu(noise, 20000, 30000);
  EXPECT_SAYS(call("camera.distortion_plate", {{"image", item(Image{noise})}}),
              "0 dots or holes of a regular grid were found; at least 30 are needed");
  EXPECT_SAYS(call("camera.distortion_plate", {{"image", item(Image{cv::Mat()})}}), "the image of the plate is empty");
  cv::Mat1f broken(100, 100, 5.f);
  broken(3, 3) = std::nanf("");
  EXPECT_SAYS(call("camera.distortion_plate", {{"image", item(Image{broken})}}), "a pixel that is not a finite number");
}

/// The indices of a 12 x 9 grid, turned by 20 degrees, of which some dots are missing.
TEST(FindGrid, IndexesAKnownGrid) {
  using namespace distortion;
  for (const Pattern pattern : {Pattern::square, Pattern::hexagonal}) {
    std::vector<Spot> spots;
    std::vector<std::pair<int, int>> known;
    for (int row = 0; row < 9; ++row)
      for (int column = 0; column < 12; ++column) {
        if (row == 4 && column % 5 == 2) continue;
        const Vector2d at = 17 * place_on_plate(pattern, column, row);
        spots.push_back({{60 + std::cos(0.35) * at.x() - std::sin(0.35) * at.y(),
                          200 + std::sin(0.35) * at.x() + std::cos(0.35) * at.y()},
                         100});
        known.emplace_back(column, row);
      }
    spots.push_back({{90, 207}, 100});  // a scratch
    const std::vector<GridDot> dots = find_grid(spots, pattern);
    EXPECT_GE(dots.size(), known.size() - 4);
    EXPECT_NEAR(spacing_px(spots, dots, pattern), 17, 1e-6);
    // Distances on the plate are those of the known grid, wherever the counting began and however it is turned.
    for (std::size_t i = 1; i < dots.size(); ++i) {
      const auto& [column, row] = known.at(std::size_t(dots[i].spot));
      const auto& [first_column, first_row] = known.at(std::size_t(dots[0].spot));
      EXPECT_NEAR(
          (place_on_plate(pattern, dots[i].column, dots[i].row) - place_on_plate(pattern, dots[0].column, dots[0].row))
              .norm(),
          (place_on_plate(pattern, column, row) - place_on_plate(pattern, first_column, first_row)).norm(), 1e-9);
    }
    EXPECT_TRUE(find_grid(spots, pattern == Pattern::square ? Pattern::hexagonal : Pattern::square).empty());
  }
}

TEST(DistortionBetween, FindsAPoseThatWasHeldOut) {
  const Simulated device =
      simulated(6, {{"turn_deg", -1.5}, {"angles_deg", std::vector<double>{-60, -30, 0, 30, 60, 15}}});
  List<Distortion> measured;
  for (std::size_t i = 0; i < 5; ++i)
    measured.add(
        device.images.name(i),
        call("camera.distortion_plate", {{"image", item(device.images[i])}}).at("distortion").as<Distortion>());
  const node_test::Options options{{"measured_at", std::vector<double>{-60, -30, 0, 30, 60}},
                                   {"names", std::vector<std::string>{"frontal"}},
                                   {"wanted_at", std::vector<double>{15}}};
  const auto found = call("camera.distortion_between", {{"distortions", list(measured, "view")}}, options);
  const auto& between = found.at("distortion").as_list<Distortion>();
  const double between_px = errors_of(item(between[0]), device.truth[5]).usual_px;
  EXPECT_LT(between_px, 0.06);
  // The calibration of another pose does not serve this one.
  EXPECT_GT(errors_of(item(measured[0]), device.truth[5]).usual_px, 2 * between_px);
}

TEST(DistortionBetween, SaysWhatDoesNotFit) {
  List<Distortion> measured;
  const Simulated device = simulated(7);
  measured.add("a",
               call("camera.distortion_plate", {{"image", item(device.images[0])}}).at("distortion").as<Distortion>());
  measured.add("b", measured[0]);
  node_test::Options options{{"measured_at", std::vector<double>{0}},
                             {"names", std::vector<std::string>{"v"}},
                             {"wanted_at", std::vector<double>{50}}};
  const node_test::Inputs inputs{{"distortions", list(measured, "view")}};
  EXPECT_SAYS(call("camera.distortion_between", inputs, options),
              "2 distortions are wired, but measured_at has 1 poses; give one for each");
  options["measured_at"] = std::vector<double>{10, 10};
  EXPECT_SAYS(call("camera.distortion_between", inputs, options), "'a' and 'b' were both measured at 10");
  options["measured_at"] = std::vector<double>{0, 30};
  std::string warned;
  Context::Hooks hooks;
  hooks.log = [&](std::string_view text, LogLevel) { warned += text; };
  call("camera.distortion_between", inputs, options, Context(hooks));
  EXPECT_HAS(warned, "'v' at 50 lies beyond the poses that were measured");
}

}  // namespace plate_test
