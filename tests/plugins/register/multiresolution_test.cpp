// SPDX-License-Identifier: Apache-2.0
#include "bowl.hpp"
#include "marrow/toolbox/search/predicted_covariance.hpp"
#include "marrow/toolbox/search/search.hpp"
#include "tests/harness/threads.hpp"
#include "tests/plugins/project/shapes.hpp"

namespace marrow::test::multiresolution_test {

// Edge maps as a perfect detector would give them: the outline of a model at the true pose, and the ways in which a
// real detector falls short of that.

struct Faults {
  double noise_px = 0;   ///< independent, along the gradient
  double missing = 0;    ///< share of the outline that is missing, in gaps
  int outliers = 0;      ///< edge pixels of anything else
  double offset_px = 0;  ///< all edges lie this far outside the outline
  bool canal = false;    ///< the inner border of the cortex, 20 px inside, where it gets brighter inwards
  unsigned seed = 1;
};

EdgeMap edges_of(const OutlineProjector& projector, const Camera& camera, const RigidTransform& world_from_model,
                 const Faults& faults) {
  std::mt19937 random(faults.seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  EdgeMap map{camera.width_px, camera.height_px, {}};
  const auto add = [&](double u, double v, double du, double dv) {
    if (u < 0 || v < 0 || u > camera.width_px - 1 || v > camera.height_px - 1) return;
    map.pixels.push_back({float(u), float(v), float(du), float(dv), 1});
  };
  Numbers gaps;
  for (int i = 0; i < 64; ++i) gaps.push_back(uniform(random));
  for (const auto& p : projector.outline(camera, world_from_model, 1)) {
    // A gap is a cell of 64 x 64 pixels without edges.
    const int cell = int(p.u_px / 64) + 8 * int(p.v_px / 64);
    if (gaps[std::size_t(cell % 64)] < faults.missing) continue;
    const double shift = faults.offset_px + faults.noise_px * normal(random);
    add(p.u_px + shift * p.normal_u, p.v_px + shift * p.normal_v, p.normal_u, p.normal_v);
    if (faults.canal) add(p.u_px - 20 * p.normal_u, p.v_px - 20 * p.normal_v, -p.normal_u, -p.normal_v);
  }
  for (int i = 0; i < faults.outliers; ++i) {
    const double angle = 2 * kPi * uniform(random);
    add(uniform(random) * camera.width_px, uniform(random) * camera.height_px, std::cos(angle), std::sin(angle));
  }
  const auto place = [](const EdgePixel& e) { return std::pair(std::lround(e.v_px), std::lround(e.u_px)); };
  std::stable_sort(map.pixels.begin(), map.pixels.end(),
                   [&](const auto& a, const auto& b) { return place(a) < place(b); });
  return map;
}

struct Scene {
  List<View> views;
  List<EdgeMap> edges;
};

Scene scene_of(const OutlineProjector& projector, const RigidTransform& world_from_model, const Numbers& angles_deg,
               const Faults& faults = {}) {
  Scene scene;
  for (const double angle : angles_deg) {
    const std::string name = "at_" + std::to_string(int(angle));
    View view{name, {}, shapes::c_arm(angle), {}};
    Faults own = faults;
    own.seed = faults.seed * 1000 + unsigned(angle);
    scene.edges.add(name, edges_of(projector, view.camera, world_from_model, own));
    scene.views.add(name, std::move(view));
  }
  return scene;
}

struct Result {
  Pose pose;
  List<Pose> stages;
};

/// A fragment at a known pose, seen from given angles.
struct Trial {
  Trial(const Mesh& surface, double height_mm, const std::string& node = "project.silhouette_edges")
      : mesh(surface), projector(made<OutlineProjector>(node, "projector", {{"model", item(mesh)}})) {
    truth.frame = fragment_frame(mesh);
    truth.world_from_model =
        search::moved_by_units(shapes::centred_at({0, 0, height_mm}), truth.frame, {3, -5, 6, 3, -4, 5});
  }
  /// What a registration is given. The pose from which it starts is this far away, in degrees and mm.
  Inputs problem(const Numbers& angles_deg, const Faults& faults, const Vector6d& away) const {
    const Scene seen = scene_of(*projector, truth.world_from_model, angles_deg, faults);
    Pose start = truth;
    start.world_from_model = search::moved_by_units(truth.world_from_model, truth.frame, away);
    const auto cost = cost_by("similarity.contour_distance", {{"projector", Value::of<OutlineProjector>(projector)},
                                                              {"views", each_view(seen.views)},
                                                              {"edges", list(seen.edges, "view")}});
    return {{"cost", Value::of<Cost>(cost)},
            {"optimizer", call("optimizer.levenberg_marquardt", {}).at("optimizer")},
            {"start", item(start)}};
  }
  Result run(const Numbers& angles_deg, const Faults& faults, const Vector6d& away, const Options& options = {}) const {
    const auto outputs = call("register.multiresolution", problem(angles_deg, faults, away), options);
    return {outputs.at("pose").as<Pose>(), outputs.at("stages").as_list<Pose>()};
  }
  /// Errors (frontal, lateral, axial rotation [deg]; then translations [mm]).
  Vector6d error_of(const Pose& pose) const {
    return well::way(truth.world_from_model, pose.world_from_model, truth.frame);
  }
  void expect_found(const Pose& pose) const {
    const Vector6d error = error_of(pose);
    EXPECT_LT(std::abs(error[2]), 1.5) << error.transpose();
    EXPECT_LT(error.head<2>().norm(), 0.3) << error.transpose();
    EXPECT_LT(error.tail<3>().norm(), 0.3) << error.transpose();
  }

  Mesh mesh;
  std::shared_ptr<const OutlineProjector> projector;
  Pose truth;
};

const Trial& femur() {
  static const Trial trial(shapes::distal_femur(), 85);
  return trial;
}

TEST(Multiresolution, PerfectEdgesGiveTheTruth) {
  const Result result = femur().run({0, 90}, {}, {1, -1.5, 9, -2, 1.5, -9});
  const Vector6d error = femur().error_of(result.pose);
  EXPECT_LT(error.head<3>().norm(), 0.06) << error.transpose();
  EXPECT_LT(error.tail<3>().norm(), 0.06) << error.transpose();
  EXPECT_TRUE(result.pose.warnings.empty());
  ASSERT_EQ(result.stages.names(), (Strings{"start", "axial", "final"}));
  EXPECT_NEAR(femur().error_of(result.stages[0])[2], 9, 0.5);
  EXPECT_LT(result.stages[2].cost, result.stages[0].cost);
  EXPECT_GT(result.pose.evaluations, 100);
}

TEST(Multiresolution, SurvivesNoiseGapsOutliersAndAFatModel) {
  Faults faults{0.5, 0.25, 800, -1.5, true, 3};
  for (const auto& away : {Vector6d{1.5, -1, 10, 2, 2, 10}, Vector6d{-1, 1, -10, -2, 1, 10},
                           Vector6d{1, 1.5, 10, 1, -2, -10}, Vector6d{-1.5, -1, -10, 2, -1, -10}}) {
    const Pose pose = femur().run({0, 90}, faults, away).pose;
    // The gaps may hide one of the condyles, from which the axial rotation is seen: the prediction knows.
    EXPECT_LT(degrees(std::sqrt((*pose.covariance)(2, 2))), 2);
    femur().expect_found(pose);
    ++faults.seed;
  }
}

TEST(Multiresolution, ScattersPosesAboutAStartThatIsWrongInAllAxes) {
  const Options options{{"scan_poses", std::int64_t{1000}},
                        {"scan_rotation_deg", 6.0},
                        {"scan_translation_mm", 6.0},
                        {"scan_side_deg", 6.0},
                        {"scan_side_mm", 6.0},
                        {"candidates", std::int64_t{40}},
                        {"finalists", std::int64_t{8}}};
  Faults faults{0.5, 0.25, 3000, -1.5, true, 3};
  const std::vector<Vector6d> starts{{6, -5, 6, 6, -5, 6}, {-5, -6, -6, 5, 6, -5}, {5, 6, -5, -6, 6, 6}};
  // Among so many other edges the axial scan alone goes wrong.
  EXPECT_GT(femur().error_of(femur().run({0, 90}, faults, starts[0]).pose).head<3>().norm(), 3);
  for (const auto& away : starts) {
    femur().expect_found(femur().run({0, 90}, faults, away, options).pose);
    ++faults.seed;
  }
}

TEST(Multiresolution, ScattersEvenlyWithinTheRanges) {
  search::SearchOptions options;
  options.scan_poses = 500;
  options.scan_rotation_deg = 6;
  options.scan_translation_mm = 5;
  options.scan_side_deg = 4;
  options.scan_side_mm = 3;
  const search::Scan scan = search::scattered_scan(options);
  ASSERT_EQ(scan.motions.size(), 500u);
  EXPECT_EQ(scan.motions[0], Vector6d(Vector6d::Zero()));
  const Vector6d range{4, 4, 6, 3, 3, 5};
  for (int axis = 0; axis < 6; ++axis) {
    double sum = 0, squares = 0;
    for (const Vector6d& m : scan.motions) {
      EXPECT_LE(std::abs(m[axis]), range[axis]);
      sum += m[axis] / 500;
      squares += m[axis] * m[axis] / 500;
    }
    EXPECT_NEAR(sum, 0, 0.03 * range[axis]);
    EXPECT_NEAR(std::sqrt(3 * squares), range[axis], 0.03 * range[axis]);
  }
}

TEST(Multiresolution, TheLastLevelChoosesAmongTheFinalists) {
  Faults faults{0.5, 0.25, 800, -1.5, true, 3};
  const Vector6d away = Vector6d{1.5, -1, 10, 2, 2, 10};
  EXPECT_LE(femur().run({0, 90}, faults, away, {{"finalists", std::int64_t{3}}}).pose.cost,
            femur().run({0, 90}, faults, away).pose.cost);
}

TEST(Multiresolution, PredictsItsScatter) {
  Vector6d squares = Vector6d::Zero(), predicted = squares;
  constexpr int kRuns = 16;
  for (int run = 0; run < kRuns; ++run) {
    Faults faults;
    faults.noise_px = 0.5;
    faults.seed = unsigned(run) + 1;
    const Result result = femur().run({0, 90}, faults, {0.5, -0.5, 3, 1, 1, -2});
    const Vector6d error = femur().error_of(result.pose);
    squares += error.cwiseProduct(error) / kRuns;
    ASSERT_TRUE(result.pose.covariance.has_value());
    predicted += result.pose.covariance->diagonal() / kRuns;
  }
  predicted.head<3>() *= std::pow(degrees(1), 2);
  for (int axis = 0; axis < 6; ++axis) {
    const double actual = std::sqrt(squares[axis]), expected = std::sqrt(predicted[axis]);
    EXPECT_LT(actual, 2 * expected + 0.01) << "axis " << axis;
    // The axial rotation is seen by the few blocks that show the condyles, so its prediction is the least certain.
    EXPECT_GT(actual, expected / 2.5) << "axis " << axis;
  }
}

TEST(Multiresolution, OneViewAndThree) {
  const Result one = femur().run({90}, {}, {0.3, -0.3, 2, 1, 1, -2});
  Vector6d error = femur().error_of(one.pose);
  error[3] = 0;  // about the depth one view says little
  EXPECT_LT(error.norm(), 1) << error.transpose();
  EXPECT_GT(std::sqrt((*one.pose.covariance)(3, 3)), 5 * std::sqrt((*one.pose.covariance)(4, 4)));
  const Result three = femur().run({0, 60, 120}, {}, {1, -1.5, 9, -2, 1.5, -9});
  error = femur().error_of(three.pose);
  EXPECT_LT(error.norm(), 0.1) << error.transpose();
}

TEST(Multiresolution, WarnsThatACylinderTurnsUnseen) {
  const Trial trial(shapes::cylinder(14, 120), 60);
  Faults faults;
  faults.noise_px = 0.3;
  const Result result = trial.run({0, 90}, faults, {0.5, 0.5, 0, 1, 1, 3});
  ASSERT_EQ(result.pose.warnings.size(), 1u);
  EXPECT_EQ(result.pose.warnings[0],
            "axial rotation is not determined by these images: the cost hardly changes within 16 degrees");
  EXPECT_GT(degrees(std::sqrt((*result.pose.covariance)(2, 2))), 90);
  EXPECT_LT(std::sqrt((*result.pose.covariance)(5, 5)), 0.5);
}

TEST(Multiresolution, DeclaresAsManyNumbersForEachLevel) {
  const std::string node = "register.multiresolution";
  EXPECT_TRUE(declares(node, same_length({"contour_spacing_px", "reach_px", "step_deg", "step_axial_deg", "step_mm",
                                          "step_tolerance"})));
  EXPECT_TRUE(declares(node, as_many_or_none("pixel_step", "contour_spacing_px")));
}

TEST(Multiresolution, StopsWhenCancelled) {
  const std::atomic<bool> cancelled{true};
  Context::Hooks hooks;
  hooks.cancelled = &cancelled;
  EXPECT_THROW(call("register.multiresolution", femur().problem({0, 90}, {}, Vector6d::Zero()), {}, Context(hooks)),
               Cancelled);
}

// A body of revolution looks the same however it turns about its axis, so no registration knows this turn.
TEST(Undetermined, ABodyOfRevolutionIsNeverTrusted) {
  if (!Catalogue().find("verdict.predicted")) GTEST_SKIP() << "the kind 'verdict' is left out";
  for (const char* node : {"project.silhouette", "project.silhouette_edges"})
    for (const int facets : {60, 90, 200}) {
      const Trial trial(shapes::cylinder(14, 90, facets), 0, node);
      for (const unsigned seed : {1u, 2u, 3u}) {
        SCOPED_TRACE(std::string(node) + ", " + std::to_string(facets) + " facets, seed " + std::to_string(seed));
        Faults faults;
        faults.noise_px = 0.5;
        faults.seed = seed;
        const Pose pose = trial
                              .run({0, 90}, faults, {-2, 3, -10 * double(seed), -1, 1, -2},
                                   {{"scan_rotation_deg", 0.0}, {"scan_translation_mm", 0.0}})
                              .pose;
        // A turn that is anywhere between -16 and 16 degrees, as far as is looked, has a deviation of 16 / sqrt(3)
        // = 9.2.
        ASSERT_TRUE(pose.covariance);
        EXPECT_GT(degrees(std::sqrt((*pose.covariance)(2, 2))), 5);
        EXPECT_LT(std::sqrt((*pose.covariance)(5, 5)), 0.5);
        ASSERT_EQ(pose.warnings.size(), 1u);
        EXPECT_EQ(pose.warnings[0].rfind("axial rotation is ", 0), 0u) << pose.warnings[0];
        const auto verdict =
            output<Verdict>("verdict.predicted", "verdict", {{"pose", item(pose)}, {"model", item(trial.mesh)}});
        EXPECT_NE(verdict.judgement, Judgement::trusted);
      }
    }
}

}  // namespace marrow::test::multiresolution_test
