// SPDX-License-Identifier: Apache-2.0
#include "silence_checks.hpp"
#include "marrow/similarity/x_ray_view.hpp"
#include "marrow/toolbox/search/search.hpp"
#include "scene.hpp"

namespace marrow::conformance {
namespace {

Inputs inputs_of_nothing_drawn() {
  Inputs inputs = inputs_of({});
  const auto invisible = std::make_shared<const analytic::InvisibleProjector>(PixelGrid{60, 60, 1, 120, 120});
  inputs.set("projector", Value::of<OutlineProjector>(invisible));
  inputs.set("projector", Value::of<RadiographProjector>(invisible));
  return inputs;
}

/// Whether the node has this input and requires it.
bool needs(const Subject& subject, const std::string& port) {
  return std::any_of(subject.info().inputs.begin(), subject.info().inputs.end(),
                     [&](const PortInfo& one) { return one.name == port && !one.optional; });
}
bool compares_images(const Subject& subject) { return needs(subject, "views"); }
bool compares_edges(const Subject& subject) { return needs(subject, "edges"); }
bool compares_grey_values(const Subject& subject) { return compares_images(subject) && !compares_edges(subject); }
bool draws(const Subject& subject) { return needs(subject, "projector"); }

/// A situation in which some nodes have nothing to compare.
struct Nothing {
  std::string name;
  bool (*is_for)(const Subject&);
  std::function<Inputs()> inputs;
  RigidTransform pose = truth();
};

std::vector<Nothing> ways() {
  const auto changed = [](std::function<void(View&, EdgeMap&)> change) {
    return [change] { return inputs_of({}, change); };
  };
  const auto sound = [] { return inputs_of({}); };
  const cv::Size size(kSize_px, kSize_px);
  return {
      {"an outline or radiograph that is empty", draws, inputs_of_nothing_drawn},
      {"no edges", compares_edges, changed([](View&, EdgeMap& map) { map.pixels.clear(); })},
      {"one edge far from the bone", compares_edges, changed([](View&, EdgeMap& map) {
         map.pixels = {{5, 5, 1, 0, 100}};
       })},
      {"a mask that hides everything", compares_images,
       changed([size](View& view, EdgeMap&) { view.mask = cv::Mat(size, CV_8U, cv::Scalar(0)); })},
      {"images that are constant", compares_grey_values,
       changed([size](View& view, EdgeMap&) { view.image.pixels = cv::Mat(size, CV_16U, cv::Scalar(30000)); })},
      {"the bone out of view", compares_images, sound, off_truth({0, 0, 0}, {0, 0, 400})},
      // The sources are 600 mm from the middle, 80 degrees apart; this is behind both.
      {"the bone behind the sources", compares_images, sound, off_truth({0, 0, 0}, {-1200, -1200, 0})},
  };
}

/// The number of ways in which the node's cost says something, so that a search could end there.
double poses_of_nothing(const Subject& subject) {
  if (!compares_images(subject)) throw NotApplicable("it compares no images");
  int count = 0;
  for (const Nothing& way : ways()) {
    if (!way.is_for(subject)) continue;
    const Inputs inputs = way.inputs();
    const Result result = subject.call(inputs);
    if (result.refusal) {
      expect_reason(*result.refusal);
      continue;
    }
    const Made cost(subject, inputs);
    const FragmentFrame frame = fragment_frame(analytic::mesh_of(bone()));
    for (const auto& level : {cost->at_level({2, 6, 2}), cost->at_level({8, 24, 8})})
      count += search::nothing_compared(*level, way.pose, frame).empty();
  }
  return count;
}

/// At the truth every cost must say something.
double silent_at_the_truth(const Subject& subject) {
  const Made cost = made(subject);
  for (const auto& level : {cost->at_level({2, 6, 2}), cost->at_level({8, 24, 8})}) {
    const std::string said = search::nothing_compared(*level, truth(), fragment_frame(analytic::mesh_of(bone())));
    expect(said.empty(), "at the true pose it says that nothing is compared: " + said);
    expect(level->silent_views(truth()).empty(), "at the true pose it says that a view shows nothing");
  }
  return 0;
}

}  // namespace

std::vector<Check> silence_checks() {
  return {{{"nothing_compared",
            "ways to have nothing to compare (no outline, no edges, a full mask, out of view) in which it neither says "
            "so nor is the same at all poses around",
            0, "ways"},
           poses_of_nothing},
          {{"something_compared", "costs that say at the true pose that nothing is compared", 0, "costs"},
           silent_at_the_truth}};
}

}  // namespace marrow::conformance
