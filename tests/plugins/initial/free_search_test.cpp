// SPDX-License-Identifier: Apache-2.0
// A search without a start: a body of three ellipsoids, whose outline is exact, in any orientation anywhere in view.
#include "marrow/initial/evidence.hpp"
#include "marrow/initial/seen_space.hpp"
#include "marrow/toolbox/analytic/body.hpp"
#include "tests/harness/threads.hpp"

namespace marrow::test::free_search_test {

using analytic::Body, analytic::BodyProjector;

constexpr int kSize_px = 256;

Body body() { return {{{0, 0, 0}, {16, 12, 30}}, {{26, 4, 18}, {7, 8, 11}}, {{-20, -16, -14}, {9, 6, 7}}}; }

List<View> views_of(const Numbers& angles_deg) {
  List<View> views;
  for (const double angle_deg : angles_deg) {
    const std::string name = "at " + std::to_string(int(angle_deg));
    views.add(name, even_view(name, analytic::c_arm(angle_deg, kSize_px, kSize_px, 1.2)));
  }
  return views;
}

/// An edge at each point of the outline, in the order of their pixels.
EdgeMap edges_of(const Camera& camera, const RigidTransform& world_from_ct) {
  EdgeMap edges{camera.width_px, camera.height_px, {}};
  for (const OutlinePoint& p : BodyProjector(body()).outline(camera, world_from_ct, 1))
    edges.pixels.push_back({p.u_px, p.v_px, p.normal_u, p.normal_v, 10});
  std::stable_sort(edges.pixels.begin(), edges.pixels.end(), [](const EdgePixel& a, const EdgePixel& b) {
    return std::pair(std::lround(a.v_px), std::lround(a.u_px)) < std::pair(std::lround(b.v_px), std::lround(b.u_px));
  });
  return edges;
}

struct Trial {
  explicit Trial(const RigidTransform& moved, const Numbers& angles_deg = {0, 80}) : truth(moved) {
    views = views_of(angles_deg);
    for (std::size_t i = 0; i < views.size(); ++i) edges.add(views.name(i), edges_of(views[i].camera, truth));
    inputs = {{"model", item(analytic::mesh_of(body()))},
              {"views", each_view(views)},
              {"edges", shipped::list(edges, "view")},
              {"projector", Value::of<OutlineProjector>(std::make_shared<const BodyProjector>(body()))}};
    inputs["cost"] = Value::of<Cost>(
        cost_by("similarity.contour_distance",
                {{"views", inputs["views"]}, {"edges", inputs["edges"]}, {"projector", inputs["projector"]}},
                {{"estimate_offset", false}}));
    inputs["optimizer"] = call("optimizer.levenberg_marquardt", {}).at("optimizer");
  }
  RigidTransform run() const {
    const Options few{{"poses", std::int64_t(1500)}, {"candidates", std::int64_t(20)}};
    return output<Pose>("initial.global_search", "pose", inputs, few).world_from_model;
  }

  RigidTransform truth;
  List<View> views;
  List<EdgeMap> edges;
  Inputs inputs;
};

TEST(FreeSearch, FindsAnyOrientationAnywhereInView) {
  for (const Vector3d& turn :
       {Vector3d(0, 0, 0), Vector3d(3.1, 0, 0), Vector3d(0.4, -1.9, 0.8), Vector3d(-1.2, 1.3, -2)}) {
    const Trial trial(placed({18, -25, 22}, turn));
    const RigidTransform found = trial.run();
    EXPECT_LT(turn_between_deg(found, trial.truth), 1) << turn.transpose();
    EXPECT_LT(shift_between_mm(found, trial.truth), 0.5) << turn.transpose();
  }
}

TEST(FreeSearch, OneViewTellsAllButTheDepth) {
  const Trial trial(placed({18, -25, 22}, {0.4, -1.9, 0.8}), {0});
  const RigidTransform found = trial.run();
  EXPECT_LT(turn_between_deg(found, trial.truth), 10);
  const Camera& camera = trial.views[0].camera;
  const Vector2d at = project(camera, found.translation_mm), right = project(camera, trial.truth.translation_mm);
  EXPECT_LT((at - right).norm(), 3);
}

TEST(FreeSearch, SameBytesAtAnyNumberOfThreads) {
  const Trial trial(placed({18, -25, 22}, {0.4, -1.9, 0.8}));
  const auto run = [&](std::size_t threads) { return with_threads(threads, [&] { return trial.run(); }); };
  const RigidTransform a = run(1), b = run(4);
  EXPECT_EQ(a.rotation, b.rotation);
  EXPECT_EQ(a.translation_mm, b.translation_mm);
}

TEST(FreeSearch, TheTruthHasMoreEvidenceThanOtherPlacesAndMostlyHiddenOnes) {
  const Trial trial(placed({0, 0, 0}, {0.4, -1.9, 0.8}));
  const Mesh model = analytic::mesh_of(body());
  const BodyProjector projector(body());
  const initial::Seen seen{model, projector, trial.views, trial.edges};
  const initial::Evidence evidence(seen, Vector3d::Zero(), 2);
  const double most = evidence.of(trial.truth);
  EXPECT_GT(most, 0);
  RigidTransform beside = trial.truth, hidden = trial.truth;
  beside.translation_mm += Vector3d(12, 0, 0);
  hidden.translation_mm += Vector3d(0, 0, 500);
  EXPECT_LT(evidence.of(beside), 0.5 * most);
  EXPECT_EQ(evidence.of(hidden), 0);
  std::vector<RigidTransform> moved{beside};
  evidence.climb(moved, Vector3d::Zero(), 4, 4);
  EXPECT_GT(evidence.of(moved[0]), evidence.of(beside));
}

TEST(SeenSpace, IsWhereTheViewsCross) {
  const List<View> views = views_of({0, 90});
  const initial::SeenSpace space = initial::SeenSpace::of(views);
  EXPECT_LT(space.middle_mm.norm(), 15);  // the isocentre, 600 mm from both sources
  EXPECT_NEAR(space.width_mm, 256 * 1.2 * 0.6, 5);
  for (const Vector3d& place : initial::places_in(space, views, 20))
    for (const View& view : views) EXPECT_TRUE(initial::is_seen(view.camera, place));
}

TEST(FreeSearch, SaysWhatIsWrong) {
  const std::string node = "initial.global_search";
  const Trial trial(placed({0, 0, 0}, {0.4, -1.9, 0.8}));
  Inputs unwired = trial.inputs;
  unwired.erase("edges");
  EXPECT_EQ(refusal(node, unwired),
            "a search without a start needs projector, views and edges, but nothing is wired to edges; wire it, or "
            "give a start");
  View moved = trial.views[1];
  moved.camera.camera_from_world.translation_mm += Vector3d(0, 3000, 0);
  EXPECT_EQ(refusal(node, with(trial.inputs, {{"views", each_view(trial.views[0], moved)}})),
            "no place between 250 and 2000 mm in front of the sources is seen by all views, so the bone cannot be "
            "either; see whether the cameras belong to these images and state their world in mm");
  const EdgeMap none{kSize_px, kSize_px, {}};
  EXPECT_NE(refusal(node, with(trial.inputs, {{"edges", per_view("at 0", none, "at 80", none)}})).find("edge"),
            std::string::npos);
}

}  // namespace marrow::test::free_search_test
