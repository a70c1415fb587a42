// SPDX-License-Identifier: Apache-2.0
// Checks for nodes that find named points in views, on a bone whose points are exactly known.
#include "suite.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "marrow/domain/camera.hpp"
#include "marrow/runtime/node/types.hpp"
#include "scene.hpp"
#include "written_network.hpp"

namespace marrow::conformance {
namespace {

constexpr int kCases = 4;

struct Found {
  double off_px = 0, deviation_px = 0;
};

/// A node without a start finds what it was trained for, which this bone is not.
void expect_start(const Subject& subject) {
  const auto& ports = subject.info().inputs;
  if (std::none_of(ports.begin(), ports.end(), [](const PortInfo& one) { return one.name == "start"; }))
    throw NotApplicable("it takes no start, so what it finds depends on what it was trained for");
}

/// How far each found point is from where the view shows it.
std::vector<Found> found_in(const Subject& subject, const LandmarkScene& scene) {
  expect_start(subject);
  const Inputs inputs = inputs_of(scene);
  const Landmarks landmarks = subject.output(inputs, "landmarks").as<Landmarks>();
  const List<View> views = inputs.at("views").as_list<View>();
  std::vector<Found> found;
  for (const auto& seen : landmarks.seen) {
    const auto point = std::find_if(landmarks.points.begin(), landmarks.points.end(),
                                    [&](const auto& one) { return one.name == seen.name; });
    const Eigen::Vector2d right = project(views.find(seen.view)->camera, truth(scene) * point->model_mm);
    found.push_back({(seen.pixel - right).norm() / std::sqrt(2.0), seen.deviation_px});
  }
  return found;
}

std::vector<Found> found_in_all(const Subject& subject, bool is_turned) {
  std::vector<Found> all;
  for (int seed = 1; seed <= kCases; ++seed)
    for (const Found& one : found_in(subject, {seed, is_turned})) all.push_back(one);
  expect(!all.empty(), "it finds no point at all");
  return all;
}

double root_mean_square(const std::vector<Found>& found, double (*value)(const Found&)) {
  double sum = 0;
  for (const Found& one : found) sum += value(one) * value(one) / double(found.size());
  return std::sqrt(sum);
}

double distance_px(const Subject& subject, bool is_turned) {
  return root_mean_square(found_in_all(subject, is_turned), [](const Found& one) { return one.off_px; });
}

double worst_px(const Subject& subject) {
  double worst = 0;
  for (const Found& one : found_in_all(subject, false)) worst = std::max(worst, one.off_px);
  return worst;
}

double missed_percent(const Subject& subject) {
  const double all = 12.0 * kCases;
  return 100 * (all - double(found_in_all(subject, false).size())) / all;
}

double in_deviations(const Subject& subject) {
  std::vector<Found> stated;
  for (const Found& one : found_in_all(subject, false))
    if (one.deviation_px > 0) stated.push_back(one);
  if (stated.empty()) throw NotApplicable("it states no deviations");
  return root_mean_square(stated, [](const Found& one) { return one.off_px / one.deviation_px; });
}

double seen_of_nothing(const Subject& subject) {
  expect_start(subject);
  double count = 0;
  for (int seed = 1; seed <= kCases; ++seed) {
    const Result result = subject.call(without_bone({seed}));
    if (result.refusal)
      expect_reason(*result.refusal);
    else
      count += double(result.outputs.at(0).as<Landmarks>().seen.size());
  }
  return 100 * count / (12.0 * kCases);
}

void validate(const Inputs& inputs, const std::vector<PortInfo>& ports, const std::vector<Value>& outputs) {
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    if (ports[i].name != "landmarks") continue;
    expect(!outputs[i].is_absent(), "it gives no landmarks");
    const Landmarks& before = inputs.at("points").as<Landmarks>();
    const Landmarks& landmarks = outputs[i].as<Landmarks>();
    expect(landmarks.points.size() == before.points.size(), "it does not give back the points");
    std::set<std::pair<std::string, std::string>> shown;
    for (const auto& seen : landmarks.seen) {
      expect(seen.pixel.allFinite() && std::isfinite(seen.deviation_px) && seen.deviation_px >= 0,
             "a pixel or its deviation is not a number");
      expect(std::any_of(before.points.begin(), before.points.end(),
                         [&](const auto& point) { return point.name == seen.name; }),
             "it sees '" + seen.name + "', which is none of the points");
      const auto& views = inputs.at("views").names;
      expect(std::find(views.begin(), views.end(), seen.view) != views.end(),
             "it sees a point in '" + seen.view + "', which is none of the views");
      expect(shown.insert({seen.view, seen.name}).second, "it sees a point twice in a view");
    }
  }
}

/// The inputs with a change of each view.
Trial with_views(const std::string& name, const std::function<void(View&)>& change) {
  return {name, [change] {
            Inputs inputs = inputs_of({});
            List<View> views;
            for (const Value& one : inputs.at("views").items) {
              View view = one.as<View>();
              view.image.pixels = view.image.pixels.clone();
              change(view);
              const std::string its_name = view.name;
              views.add(its_name, std::move(view));
            }
            inputs.set("views", Value::of(views, "view"));
            return inputs;
          }};
}

template <class T>
Trial with_changed(const std::string& name, const std::string& port, const std::function<void(T&)>& change) {
  return {name, [port, change] {
            Inputs inputs = inputs_of({});
            T changed = inputs.at(port).as<T>();
            change(changed);
            inputs.set(port, item(changed));
            return inputs;
          }};
}

std::vector<Trial> trials() {
  const double none = std::nan("");
  return {with_changed<Landmarks>("no_points", "points", [](Landmarks& points) { points = {}; }),
          with_changed<Landmarks>("point_not_a_number", "points",
                                  [none](Landmarks& points) { points.points[0].model_mm.x() = none; }),
          with_changed<Landmarks>("points_out_of_view", "points",
                                  [](Landmarks& points) {
                                    for (auto& point : points.points) point.model_mm.z() += 400;
                                  }),
          {"no_views",
           [] {
             Inputs inputs = inputs_of({});
             inputs.at("views").items.clear();
             inputs.at("views").names.clear();
             return inputs;
           }},
          with_views("empty_image", [](View& view) { view.image.pixels = cv::Mat(); }),
          with_views("one_pixel", [](View& view) { view.image.pixels = cv::Mat(1, 1, CV_16U, cv::Scalar(9)); }),
          with_views("constant_image", [](View& view) { view.image.pixels.setTo(30000); }),
          with_views("black_image", [](View& view) { view.image.pixels.setTo(0); }),
          with_views("nan_pixel",
                     [none](View& view) {
                       view.image.pixels.convertTo(view.image.pixels, CV_32F);
                       view.image.pixels.at<float>(50, 60) = float(none);
                     }),
          with_views("mask_of_nothing",
                     [](View& view) { view.mask = cv::Mat(view.image.pixels.size(), CV_8U, cv::Scalar(0)); }),
          with_views("broken_camera", [none](View& view) { view.camera.intrinsics(0, 0) = none; }),
          with_changed<Pose>("start_not_a_number", "start",
                             [none](Pose& start) { start.world_from_model.translation_mm.x() = none; }),
          with_changed<Pose>("start_not_rigid", "start", [](Pose& start) { start.world_from_model.rotation *= 2; }),
          with_changed<Pose>("start_behind_the_source", "start",
                             [](Pose& start) { start.world_from_model.translation_mm.y() += 5000; })};
}

}  // namespace

Suite landmarks_suite() {
  Suite suite{[] { return inputs_of({}); }, validate, trials(), {}};
  suite.options = [] {
    const Inputs inputs = inputs_of({});
    std::vector<std::string> names;
    for (const auto& point : inputs.at("points").as<Landmarks>().points) names.push_back(point.name);
    return std::map<std::string, OptionValue>{{"network", written_network(files_folder(), names).string()}};
  };
  const auto add = [&](const char* name, const std::string& what, double limit, const char* unit,
                       std::function<double(const Subject&)> measure) {
    suite.accuracy.push_back({{name, what, limit, unit}, std::move(measure)});
  };
  const std::string where = "of 6 points in 2 views at 4 poses; a start is 3 to 6 degrees and mm off";
  add("distance", "root mean square error of a coordinate " + where, 3, "px",
      [](const Subject& subject) { return distance_px(subject, false); });
  add("turned_world", "the same where the world has other axes and another origin", 3, "px",
      [](const Subject& subject) { return distance_px(subject, true); });
  add("worst", "the largest of these errors", 12, "px", worst_px);
  add("missed", "points that are not seen", 25, "%", missed_percent);
  add("in_deviations", "root mean square of the errors in units of the stated deviations", 2, "deviations",
      in_deviations);
  add("seen_of_nothing", "points seen in views without the bone", 10, "%", seen_of_nothing);
  return suite;
}

}  // namespace marrow::conformance
