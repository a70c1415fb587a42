// SPDX-License-Identifier: Apache-2.0
// What searches make of images that say something, or of which one says nothing. That each cost says so where it has
// nothing to compare, and that no search then ends in a pose, is checked by the suites of their kinds.
#include <set>

#include "marrow/similarity/x_ray_view.hpp"
#include "marrow/toolbox/analytic/body.hpp"
#include "tests/harness/node_test.hpp"

namespace marrow::test::nothing_compared_test {

constexpr int kSize_px = 120;
constexpr double kPixel_mm = 1.6;

analytic::Body bone() { return {{{0, 0, 8}, {9, 13, 32}}, {{20, -5, -22}, {8, 10, 9}}}; }
RigidTransform truth() { return analytic::moved_by({0.2, -0.15, 0.3}, {3, -2, 5}); }

/// What is given to a cost, and the pose from which it is minimised.
struct Scene {
  std::shared_ptr<const OutlineProjector> outline;
  std::shared_ptr<const RadiographProjector> radiograph;
  List<View> views;
  List<EdgeMap> edges;
  Pose start;

  Scene() {
    const auto body = std::make_shared<const analytic::BodyProjector>(bone());
    outline = body, radiograph = body;
    for (const double angle : {0.0, 80.0}) {
      const analytic::XRay x_ray{analytic::c_arm(angle, kSize_px, kSize_px, kPixel_mm), 1, 0, 1, 1};
      const View view = x_ray_view(x_ray, angle > 0 ? "lateral" : "frontal", *body, truth());
      edges.add(view.name, analytic::edges_of(view));
      views.add(view.name, view);
    }
    start.frame = fragment_frame(analytic::mesh_of(bone()));
    start.world_from_model = marrow::moved(truth(), start.frame, Vector6d::Constant(0.01));
  }
  void change(const std::function<void(View&, EdgeMap&)>& of_view) {
    List<View> changed_views;
    List<EdgeMap> changed_edges;
    for (std::size_t i = 0; i < views.size(); ++i) {
      View view = views[i];
      EdgeMap map = edges[i];
      of_view(view, map);
      changed_views.add(views.name(i), view);
      changed_edges.add(views.name(i), map);
    }
    views = changed_views, edges = changed_edges;
  }
};

/// A node's inputs and its cost, which refers to them.
struct Made {
  Inputs inputs;
  Value cost;
  Made(const std::string& node, const Scene& scene) {
    const Grid grid = analytic::grid_of({68, 56, 100}, {1, 1, 1});
    for (const PortInfo& port : definition_of(node).info.inputs) {
      if (port.name == "projector" && port.type.id == TypeInfo::of<OutlineProjector>().id)
        inputs["projector"] = Value::of<OutlineProjector>(scene.outline);
      else if (port.name == "projector")
        inputs["projector"] = Value::of<RadiographProjector>(scene.radiograph);
      if (port.name == "views") inputs["views"] = shipped::list(scene.views, "view");
      if (port.name == "edges") inputs["edges"] = shipped::list(scene.edges, "view");
      if (port.name == "model") inputs["model"] = item(analytic::mesh_of(bone()));
      if (port.name == "volume") inputs["volume"] = item(analytic::volume_of(bone(), grid, 700, 0));
      if (port.name == "field") inputs["field"] = item(analytic::field_of(bone(), grid, 6));
    }
    cost = call(node, inputs).at("cost");
  }
};

Options one_level(const std::string& node) {
  const auto one = [](double value) { return OptionValue(Numbers{value}); };
  Options options{{"contour_spacing_px", one(2)}, {"reach_px", one(6)}};
  if (node == "initial.best_of") return {{"contour_spacing_px", 2.0}, {"reach_px", 6.0}};
  if (node == "initial.global_search")
    return {{"contour_spacing_px", one(2)},
            {"reach_px", one(6)},
            {"pixel_step", one(2)},
            {"poses", std::int64_t(1)},
            {"candidates", std::int64_t(1)}};
  options["step_deg"] = options["step_mm"] = one(0.5);
  options["step_axial_deg"] = one(1);
  options["max_evaluations"] = std::int64_t(60);
  if (node == "register.tracked") {
    options["wide_poses"] = std::int64_t(8);
    options["max_wide_deg"] = options["max_wide_mm"] = 2.0;
    return options;
  }
  options["step_tolerance"] = one(0.1);
  options["scan_rotation_deg"] = options["scan_translation_mm"] = 0.0;
  if (node == "register.sequence")
    for (const char* name : {"pixel_step", "step_deg", "step_axial_deg", "step_mm", "step_tolerance"})
      options[std::string("finer_") + name] = one(name == std::string("step_tolerance") ? 0.1 : 2);
  return options;
}

Inputs inputs_of(const std::string& node, const Made& made, const Pose& start) {
  Inputs inputs{{"cost", made.cost}, {"optimizer", call("optimizer.nelder_mead", {}).at("optimizer")}};
  if (node == "initial.best_of") {
    inputs["first"] = item(start);
  } else if (node == "initial.global_search") {
    inputs["start"] = item(start);
    inputs["model"] = item(analytic::mesh_of(bone()));
  } else {
    inputs["start"] = item(start);
  }
  if (node == "register.sequence") inputs["finer_cost"] = made.cost;
  return inputs;
}

const Strings kSearches{"register.multiresolution", "register.sequence", "register.tracked", "initial.global_search",
                        "initial.best_of"};
const Strings kCosts{"contour_distance",      "drr_edges",
                     "entropy_of_difference", "gradient_correlation",
                     "gradient_difference",   "gradient_orientation",
                     "gradient_projection",   "metal_gradient_correlation",
                     "mutual_information",    "normalised_cross_correlation",
                     "patch_correlation",     "patch_gradient_correlation",
                     "pattern_intensity",     "ray_to_surface"};

TEST(NothingCompared, SoundImagesAreAPoseWithDeviations) {
  const std::set<std::string> predict_none{"entropy_of_difference", "gradient_orientation", "gradient_projection",
                                           "mutual_information"};
  const Scene scene;
  for (const std::string& name : kCosts) {
    const Made made("similarity." + name, scene);
    for (const std::string& search : kSearches) {
      const Pose pose = output<Pose>(search, "pose", inputs_of(search, made, scene.start), one_level(search));
      if (search.starts_with("initial")) continue;  // without deviations
      ASSERT_EQ(bool(pose.covariance), !predict_none.contains(name)) << name << ", " << search;
      if (!pose.covariance) continue;
      EXPECT_TRUE(pose.covariance->allFinite() && pose.covariance->diagonal().minCoeff() > 0) << name << ", " << search;
    }
  }
}

TEST(NothingCompared, AViewThatShowsNothingIsNamedWhereAnotherShowsTheBone) {
  Scene scene;
  scene.change([](View& view, EdgeMap&) {
    if (view.name == "lateral") view.mask = cv::Mat(kSize_px, kSize_px, CV_8U, cv::Scalar(0));
  });
  const Made made("similarity.normalised_cross_correlation", scene);
  for (const std::string search : {"register.multiresolution", "register.sequence", "register.tracked"}) {
    const Pose pose = output<Pose>(search, "pose", inputs_of(search, made, scene.start), one_level(search));
    const std::string expected = "view 'lateral': no pixel inside the mask shows the bone; only the other views count";
    EXPECT_EQ(std::count(pose.warnings.begin(), pose.warnings.end(), expected), 1) << search;
    EXPECT_TRUE(pose.covariance->allFinite() && pose.covariance->diagonal().minCoeff() > 0) << search;
  }
}

TEST(NothingCompared, ASurfaceTurnedInsideOutIsNoPose) {
  Scene scene;
  Mesh mesh = analytic::mesh_of(bone());
  for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  const Value kept = item(mesh);
  const Value projector = call("project.silhouette_edges", {{"model", kept}}).at("projector");
  scene.outline = std::static_pointer_cast<const OutlineProjector>(projector.data);
  for (const std::string& search : kSearches)
    EXPECT_NE(
        refusal(search, inputs_of(search, Made("similarity.contour_distance", scene), scene.start), one_level(search))
            .find("view 'frontal': it shows nothing of the model's outline, which is empty or outside the image; "
                  "view 'lateral': it shows nothing of the model's outline"),
        std::string::npos)
        << search;
}

}  // namespace marrow::test::nothing_compared_test
