// SPDX-License-Identifier: Apache-2.0
// Checks for nodes that find named points in views, on a bone whose points are exactly known.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <marrow/plugin.hpp>
#include <set>
#include <string>
#include <vector>

#include "marrow/domain/random.hpp"
#include "marrow/toolbox/analytic/body.hpp"

namespace marrow::conformance {
namespace {

// A bone that is known analytically, two X-ray views of it, and named points whose pixels are exactly known.

/// A pose of the bone, drawn by its number. is_turned: the world has other axes and another origin.
struct LandmarkScene {
  int seed = 1;
  bool is_turned = false;
};

using namespace analytic;

constexpr int kSize_px = 240;
constexpr double kPixel_mm = 0.8;

/// A shaft and two condyles of different size.
Body bone() { return {{{0, 0, 60}, {13, 12, 90}}, {{24, -5, -38}, {11, 15, 13}}, {{-22, 8, -32}, {13, 11, 15}}}; }

/// A vector of random direction that is between half as long and as long as `most`.
Eigen::Vector3d drawn(Random& random, double most) {
  const Eigen::Vector3d direction(random.normal(), random.normal(), random.normal());
  return direction.normalized() * most * (0.5 + 0.5 * random.uniform());
}

RigidTransform turn_of_world(const LandmarkScene& scene) {
  RigidTransform turn{"world", "world"};
  if (!scene.is_turned) return turn;
  turn.rotation = rotation_from_vector({1.1, -0.7, 2.0});
  turn.translation_mm = {130, -40, 75};
  return turn;
}

RigidTransform truth(const LandmarkScene& scene) {
  Random random(std::uint64_t(scene.seed));
  const Eigen::Vector3d turn_rad = drawn(random, 0.2), shift_mm = drawn(random, 10);
  return turn_of_world(scene) * moved_by(turn_rad, shift_mm);
}

Landmarks points() {
  Landmarks landmarks;
  landmarks.points = {{"lateral", {35, -5, -38}}, {"medial", {-35, 8, -32}}, {"front", {24, -20, -38}},
                      {"back", {-22, 19, -32}},   {"end", {-22, 8, -47}},    {"low", {24, -5, -51}}};
  return landmarks;
}

View view_of(const LandmarkScene& scene, const std::string& name, double angle_deg, bool shows_bone, Random& random) {
  constexpr double kBright = 50000, kPerMm = 0.02, kNoise = 250;
  View view;
  view.name = name;
  view.camera = c_arm(angle_deg, kSize_px, kSize_px, kPixel_mm);
  view.camera.camera_from_world = view.camera.camera_from_world * inverse(turn_of_world(scene));
  const std::vector<float> chords =
      BodyProjector(bone()).radiograph(view.camera, truth(scene), PixelGrid{0, 0, 1, kSize_px, kSize_px});
  view.image.pixels.create(kSize_px, kSize_px, CV_16U);
  for (int i = 0; i < kSize_px * kSize_px; ++i) {
    const double tissue_mm = 40 + 30 * std::sin(0.02 * (i % kSize_px)) * std::cos(0.017 * (i / kSize_px));
    const double chord_mm = shows_bone ? chords[std::size_t(i)] : 0;
    view.image.pixels.ptr<std::uint16_t>()[i] =
        std::uint16_t(kBright * std::exp(-kPerMm * (chord_mm + 0.4 * tissue_mm)) + kNoise * random.normal() + 2000);
  }
  return view;
}

Inputs made(const LandmarkScene& scene, bool shows_bone) {
  Random random(std::uint64_t(200 + scene.seed));
  List<View> views;
  for (const auto& [name, angle_deg] : {std::pair("frontal", 0.0), std::pair("lateral", 80.0)})
    views.add(name, view_of(scene, name, angle_deg, shows_bone, random));
  Vector6d off;
  off << drawn(random, 6) * radians(1), drawn(random, 6);
  Pose start;
  start.world_from_model = moved(truth(scene), FragmentFrame(), off);
  return {{"points", item(points())},
          {"views", Value::of(views, "view")},
          {"projector", Value::of<RadiographProjector>(std::make_shared<const BodyProjector>(bone()))},
          {"start", item(start)}};
}

/// What nodes of the kind take. The start is 3 to 6 degrees and mm off the truth. The views have noise.
Inputs inputs_of(const LandmarkScene& scene) { return made(scene, true); }
/// The same without the bone in the views.
Inputs without_bone(const LandmarkScene& scene) { return made(scene, false); }

// A network of one convolution of 1 x 1 pixels as an ONNX file. Field numbers are those of onnx.proto.

constexpr int kSide_px = 64;

std::string varint(std::uint64_t number) {
  std::string bytes;
  for (; number > 127; number >>= 7) bytes += char((number & 127) | 128);
  return bytes + char(number);
}
std::string whole(int field, std::uint64_t value) { return varint(std::uint64_t(field) << 3) + varint(value); }
std::string part(int field, const std::string& bytes) {
  return varint(std::uint64_t(field) << 3 | 2) + varint(bytes.size()) + bytes;
}

std::string tensor(const std::string& name, const std::vector<int>& sides, const std::vector<float>& values) {
  std::string bytes, raw(values.size() * sizeof(float), '\0');
  for (const int side : sides) bytes += whole(1, std::uint64_t(side));
  std::memcpy(raw.data(), values.data(), raw.size());
  return bytes + whole(2, 1) + part(8, name) + part(9, raw);
}

std::string shape(const std::string& name, int channels) {
  std::string dimensions;
  for (const int side : {1, channels, kSide_px, kSide_px}) dimensions += part(1, whole(1, std::uint64_t(side)));
  return part(1, name) + part(2, part(1, whole(1, 1) + part(2, dimensions)));
}

std::string model(int channels) {
  const std::string sides = part(1, "kernel_shape") + whole(8, 1) + whole(8, 1) + whole(20, 7);
  const std::string layer = part(1, "image") + part(1, "weights") + part(1, "bias") + part(2, "points") +
                            part(3, "layer") + part(4, "Conv") + part(5, sides);
  const std::string graph =
      part(1, layer) + part(2, "network") +
      part(5, tensor("weights", {channels, 1, 1, 1}, std::vector<float>(std::size_t(channels), 1))) +
      part(5, tensor("bias", {channels}, std::vector<float>(std::size_t(channels), 0))) + part(11, shape("image", 1)) +
      part(12, shape("points", channels));
  return whole(1, 6) + part(7, graph) + part(8, part(1, "") + whole(2, 11));
}

/// Writes a network into the folder, and returns its description: each point's heat map is the bone's brightness
/// itself. It finds nothing well, but a node that runs networks can be called with it.
std::filesystem::path written_network(const std::filesystem::path& folder, const std::vector<std::string>& names) {
  std::ofstream(folder / "network.onnx", std::ios::binary) << model(int(names.size()));
  const std::filesystem::path description = folder / "network.yaml";
  std::ofstream text(description);
  text << "marrow-network: 1\nname: bright\nhelp: for checks\nversion: 1.0.0\nlicence: Apache-2.0\n"
          "trained: {data: nothing, good_for: checks, not_for: anything else}\n"
          "input:\n  values: line_integrals\n  bone: bright\n  pixel_px: 2\n"
          "  normalise: {method: percentiles, low: 1, high: 99}\n"
       << "  size_px: [" << kSide_px << ", " << kSide_px << "]\n  overlap_px: 16\n"
       << "outputs:\n  heat_maps:\n    layer: points\n    names: [";
  for (std::size_t i = 0; i < names.size(); ++i) text << (i ? ", " : "") << names[i];
  text << "]\n    activation: none\n";
  return description;
}

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

}  // namespace
}  // namespace marrow::conformance

MARROW_PLUGIN(plugin) { plugin.suite("landmarks", marrow::conformance::landmarks_suite()); }
