// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <atomic>
#include <cmath>

#include "ideal_edges.hpp"
#include "marrow/toolbox/search/predicted_covariance.hpp"
#include "marrow/toolbox/search/scan.hpp"
#include "shipped.hpp"

namespace multiresolution_test {

/// Errors (frontal, lateral, axial rotation [deg]; then translations [mm]).
marrow::Vector6d error_of(const marrow::Pose& pose, const marrow::Pose& truth) {
  marrow::Vector6d error = marrow::motion_between(truth.world_from_model, pose.world_from_model, truth.frame);
  error.head<3>() *= marrow::degrees(1);
  return error;
}

marrow::Vector6d motion(double rx, double ry, double rz, double tx, double ty, double tz) {
  marrow::Vector6d deg_and_mm;
  deg_and_mm << rx, ry, rz, tx, ty, tz;
  return deg_and_mm;
}

struct Result {
  marrow::Pose pose;
  marrow::List<marrow::Pose> stages;
};

/// What a registration is given, and what its cost was made from.
struct Problem {
  shipped::Inputs scene, inputs;
};

/// A fragment at a known pose, seen from given angles.
struct Trial {
  Trial(marrow::Mesh surface, double height_mm)
      : mesh(std::move(surface)),
        projector(shipped::call("project.silhouette_edges", {{"model", shipped::item(mesh)}}).at("projector")) {
    truth.frame = marrow::fragment_frame(mesh);
    truth.world_from_model =
        marrow::search::moved_by_units(shapes::centred_at({0, 0, height_mm}), truth.frame, motion(3, -5, 6, 3, -4, 5));
  }
  Problem problem(const std::vector<double>& angles_deg, const ideal_edges::Faults& faults,
                  const marrow::Vector6d& away) const {
    const ideal_edges::Scene seen =
        ideal_edges::scene_of(projector.as<marrow::OutlineProjector>(), truth.world_from_model, angles_deg, faults);
    marrow::Pose start = truth;
    start.world_from_model = marrow::search::moved_by_units(truth.world_from_model, truth.frame, away);
    Problem problem;
    problem.scene = {{"projector", projector},
                     {"views", shipped::list(seen.views, "view")},
                     {"edges", shipped::list(seen.edges, "view")}};
    problem.inputs = {{"cost", shipped::call("similarity.contour_distance", problem.scene).at("cost")},
                      {"optimizer", shipped::call("optimizer.levenberg_marquardt", {}).at("optimizer")},
                      {"start", shipped::item(start)}};
    return problem;
  }
  Result run(const std::vector<double>& angles_deg, const ideal_edges::Faults& faults, const marrow::Vector6d& away,
             const shipped::Options& options = {}) const {
    const Problem given = problem(angles_deg, faults, away);
    const auto outputs = shipped::call("register.multiresolution", given.inputs, options);
    return {outputs.at("pose").as<marrow::Pose>(), outputs.at("stages").as_list<marrow::Pose>()};
  }

  marrow::Mesh mesh;
  marrow::Value projector;
  marrow::Pose truth;
};

const Trial& femur() {
  static const Trial trial(shapes::distal_femur(), 85);
  return trial;
}

TEST(Multiresolution, PerfectEdgesGiveTheTruth) {
  const Result result = femur().run({0, 90}, {}, motion(1, -1.5, 9, -2, 1.5, -9));
  const marrow::Vector6d error = error_of(result.pose, femur().truth);
  EXPECT_LT(error.head<3>().norm(), 0.06) << error.transpose();
  EXPECT_LT(error.tail<3>().norm(), 0.06) << error.transpose();
  EXPECT_TRUE(result.pose.warnings.empty());
  ASSERT_EQ(result.stages.names(), (std::vector<std::string>{"start", "axial", "final"}));
  EXPECT_NEAR(error_of(result.stages[0], femur().truth)[2], 9, 0.5);
  EXPECT_LT(result.stages[2].cost, result.stages[0].cost);
  EXPECT_GT(result.pose.evaluations, 100);
}

TEST(Multiresolution, SurvivesNoiseGapsOutliersAndAFatModel) {
  ideal_edges::Faults faults{0.5, 0.25, 800, -1.5, true, 3};
  const std::vector<marrow::Vector6d> starts{motion(1.5, -1, 10, 2, 2, 10), motion(-1, 1, -10, -2, 1, 10),
                                             motion(1, 1.5, 10, 1, -2, -10), motion(-1.5, -1, -10, 2, -1, -10)};
  for (const auto& away : starts) {
    const Result result = femur().run({0, 90}, faults, away);
    const marrow::Vector6d error = error_of(result.pose, femur().truth);
    // The gaps may hide one of the condyles, from which the axial rotation is seen: the prediction knows.
    const double axial_sd_deg = marrow::degrees(std::sqrt((*result.pose.covariance)(2, 2)));
    EXPECT_LT(axial_sd_deg, 2);
    EXPECT_LT(std::abs(error[2]), 1.5) << error.transpose();
    EXPECT_LT(error.head<2>().norm(), 0.3) << error.transpose();
    EXPECT_LT(error.tail<3>().norm(), 0.3) << error.transpose();
    ++faults.seed;
  }
}

TEST(Multiresolution, ScattersPosesAboutAStartThatIsWrongInAllAxes) {
  const shipped::Options options{{"scan_poses", std::int64_t{1000}},
                                 {"scan_rotation_deg", 6.0},
                                 {"scan_translation_mm", 6.0},
                                 {"scan_side_deg", 6.0},
                                 {"scan_side_mm", 6.0},
                                 {"candidates", std::int64_t{40}},
                                 {"finalists", std::int64_t{8}}};
  ideal_edges::Faults faults{0.5, 0.25, 3000, -1.5, true, 3};
  const std::vector<marrow::Vector6d> starts{motion(6, -5, 6, 6, -5, 6), motion(-5, -6, -6, 5, 6, -5),
                                             motion(5, 6, -5, -6, 6, 6)};
  // Among so many other edges the axial scan alone goes wrong.
  EXPECT_GT(error_of(femur().run({0, 90}, faults, starts[0]).pose, femur().truth).head<3>().norm(), 3);
  for (const auto& away : starts) {
    const Result result = femur().run({0, 90}, faults, away, options);
    const marrow::Vector6d error = error_of(result.pose, femur().truth);
    EXPECT_LT(std::abs(error[2]), 1.5) << error.transpose();
    EXPECT_LT(error.head<2>().norm(), 0.3) << error.transpose();
    EXPECT_LT(error.tail<3>().norm(), 0.3) << error.transpose();
    ++faults.seed;
  }
}

TEST(Multiresolution, ScattersEvenlyWithinTheRanges) {
  marrow::search::SearchOptions options;
  options.scan_poses = 500;
  options.scan_rotation_deg = 6;
  options.scan_translation_mm = 5;
  options.scan_side_deg = 4;
  options.scan_side_mm = 3;
  const marrow::search::Scan scan = marrow::search::scattered_scan(options);
  ASSERT_EQ(scan.motions.size(), 500u);
  EXPECT_EQ(scan.motions[0], motion(0, 0, 0, 0, 0, 0));
  const marrow::Vector6d range = motion(4, 4, 6, 3, 3, 5);
  for (int axis = 0; axis < 6; ++axis) {
    double sum = 0, squares = 0;
    for (const marrow::Vector6d& m : scan.motions) {
      EXPECT_LE(std::abs(m[axis]), range[axis]);
      sum += m[axis] / 500;
      squares += m[axis] * m[axis] / 500;
    }
    EXPECT_NEAR(sum, 0, 0.03 * range[axis]);
    EXPECT_NEAR(std::sqrt(3 * squares), range[axis], 0.03 * range[axis]);
  }
}

TEST(Multiresolution, TheLastLevelChoosesAmongTheFinalists) {
  ideal_edges::Faults faults{0.5, 0.25, 800, -1.5, true, 3};
  const marrow::Vector6d away = motion(1.5, -1, 10, 2, 2, 10);
  EXPECT_LE(femur().run({0, 90}, faults, away, {{"finalists", std::int64_t{3}}}).pose.cost,
            femur().run({0, 90}, faults, away).pose.cost);
}

TEST(Multiresolution, PredictsItsScatter) {
  marrow::Vector6d squares = marrow::Vector6d::Zero(), predicted = squares;
  constexpr int kRuns = 16;
  for (int run = 0; run < kRuns; ++run) {
    ideal_edges::Faults faults;
    faults.noise_px = 0.5;
    faults.seed = unsigned(run) + 1;
    const Result result = femur().run({0, 90}, faults, motion(0.5, -0.5, 3, 1, 1, -2));
    const marrow::Vector6d error = error_of(result.pose, femur().truth);
    squares += error.cwiseProduct(error) / kRuns;
    ASSERT_TRUE(result.pose.covariance.has_value());
    marrow::Vector6d variance = result.pose.covariance->diagonal();
    variance.head<3>() *= std::pow(marrow::degrees(1), 2);
    predicted += variance / kRuns;
  }
  for (int axis = 0; axis < 6; ++axis) {
    const double actual = std::sqrt(squares[axis]), expected = std::sqrt(predicted[axis]);
    EXPECT_LT(actual, 2 * expected + 0.01) << "axis " << axis;
    // The axial rotation is seen by the few blocks that show the condyles, so its prediction is the least certain.
    EXPECT_GT(actual, expected / 2.5) << "axis " << axis;
  }
}

TEST(Multiresolution, OneViewAndThree) {
  const Result one = femur().run({90}, {}, motion(0.3, -0.3, 2, 1, 1, -2));
  marrow::Vector6d error = error_of(one.pose, femur().truth);
  error[3] = 0;  // about the depth one view says little
  EXPECT_LT(error.norm(), 1) << error.transpose();
  EXPECT_GT(std::sqrt((*one.pose.covariance)(3, 3)), 5 * std::sqrt((*one.pose.covariance)(4, 4)));
  const Result three = femur().run({0, 60, 120}, {}, motion(1, -1.5, 9, -2, 1.5, -9));
  error = error_of(three.pose, femur().truth);
  EXPECT_LT(error.norm(), 0.1) << error.transpose();
}

TEST(Multiresolution, WarnsThatACylinderTurnsUnseen) {
  const Trial trial(shapes::cylinder(14, 120), 60);
  ideal_edges::Faults faults;
  faults.noise_px = 0.3;
  const Result result = trial.run({0, 90}, faults, motion(0.5, 0.5, 0, 1, 1, 3));
  ASSERT_EQ(result.pose.warnings.size(), 1u);
  EXPECT_EQ(result.pose.warnings[0],
            "axial rotation is not determined by these images: the cost hardly changes within 16 degrees");
  EXPECT_GT(marrow::degrees(std::sqrt((*result.pose.covariance)(2, 2))), 90);
  EXPECT_LT(std::sqrt((*result.pose.covariance)(5, 5)), 0.5);
}

TEST(Multiresolution, SameBytesAtAnyNumberOfThreads) {
  const ideal_edges::Faults faults{0.5, 0.2, 300, 0, false, 5};
  const auto run = [&](std::size_t threads) {
    tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    return femur().run({0, 90}, faults, motion(1, 1, 5, 1, 1, 5)).pose;
  };
  const marrow::Pose a = run(1), b = run(4);
  EXPECT_EQ(a.world_from_model.rotation, b.world_from_model.rotation);
  EXPECT_EQ(a.world_from_model.translation_mm, b.world_from_model.translation_mm);
  EXPECT_EQ(*a.covariance, *b.covariance);
}

TEST(Multiresolution, DeclaresAsManyNumbersForEachLevel) {
  const std::string node = "register.multiresolution";
  EXPECT_TRUE(shipped::declares(node, marrow::same_length({"contour_spacing_px", "reach_px", "step_deg",
                                                           "step_axial_deg", "step_mm", "step_tolerance"})));
  EXPECT_TRUE(shipped::declares(node, marrow::as_many_or_none("pixel_step", "contour_spacing_px")));
}

TEST(Multiresolution, StopsWhenCancelled) {
  const Problem problem = femur().problem({0, 90}, {}, motion(0, 0, 0, 0, 0, 0));
  const std::atomic<bool> cancelled{true};
  marrow::Context::Hooks hooks;
  hooks.cancelled = &cancelled;
  EXPECT_THROW(shipped::call("register.multiresolution", problem.inputs, {}, marrow::Context(hooks)),
               marrow::Cancelled);
}

}  // namespace multiresolution_test
