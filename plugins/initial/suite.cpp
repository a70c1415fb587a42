// SPDX-License-Identifier: Apache-2.0
// Checks for starts, on a long bone at a known pose. A start must lie within the range from which a registration finds
// the pose, also where the world has other axes, and for the bone of the other side.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <marrow/plugin.hpp>

#include "marrow/domain/decompositions.hpp"
#include "marrow/domain/random.hpp"
#include "marrow/toolbox/analytic/functions.hpp"

namespace marrow::conformance {
namespace {

// Test data of the suite for starts: a long bone that is known analytically, at a known pose, with everything that
// leads to a start: lines of its shaft and landmarks in two views, tracked points, nominal placements, and a cost.

/// Variants of the scene.
struct Scene {
  int seed = 1;              ///< of the pose and of all errors
  bool is_mirrored = false;  ///< the bone of the other side
  bool is_turned = false;    ///< the world has other axes and another origin; the images stay the same
};

/// A compact body in any orientation, with its edges in both views, and no placement.
struct FreeScene {
  RigidTransform truth;
  Inputs inputs;
};

using namespace analytic;

constexpr int kSize_px = 240;
constexpr double kPixel_mm = 0.8;

Eigen::Vector3d normal(Random& random, double deviation) {
  return deviation * Eigen::Vector3d{random.normal(), random.normal(), random.normal()};
}
/// A vector of random direction that is between half as long and as long as `most`.
Eigen::Vector3d drawn(Random& random, double most) {
  return normal(random, 1).normalized() * most * (0.5 + 0.5 * random.uniform());
}

/// turned_from_world: where the world's axes and origin are after the change.
RigidTransform turn_of_world(const Scene& scene) {
  RigidTransform turn{"world", "world"};
  if (!scene.is_turned) return turn;
  turn.rotation = rotation_from_vector({1.1, -0.7, 2.0});
  turn.translation_mm = {130, -40, 75};
  return turn;
}

Body bone(const Scene& scene) {
  Body body{{{0, 0, 60}, {13, 12, 160}}, {{25, -6, -38}, {8, 10, 12}}, {{-22, 9, -32}, {7, 9, 9}}};
  if (scene.is_mirrored)
    for (Ellipsoid& one : body) one.centre_mm.x() *= -1;
  return body;
}

RigidTransform truth(const Scene& scene) {
  Random random(std::uint64_t(scene.seed));
  const Eigen::Vector3d turn_rad = drawn(random, 0.15), shift_mm = drawn(random, 8);
  return turn_of_world(scene) * moved_by(turn_rad, shift_mm);
}

Camera camera_of(const Scene& scene, double angle_deg) {
  Camera camera = c_arm(angle_deg, kSize_px, kSize_px, kPixel_mm);
  camera.camera_from_world = camera.camera_from_world * inverse(turn_of_world(scene));
  return camera;
}

/// A view whose image is wide enough for the whole bone, and whose mask is where it sees the bone.
View silhouette_of(const Body& body, const RigidTransform& world_from_ct, const std::string& name, Camera camera) {
  constexpr int kWide_px = 520;
  constexpr double kWide_mm = 1.5;
  camera.intrinsics.topLeftCorner<2, 2>() *= kPixel_mm / kWide_mm;
  camera.intrinsics.topRightCorner<2, 1>().setConstant(0.5 * (kWide_px - 1));
  camera.width_px = camera.height_px = kWide_px;
  const std::vector<float> lengths_mm =
      BodyProjector(body).radiograph(camera, world_from_ct, PixelGrid{0, 0, 1, kWide_px, kWide_px});
  View view{name, {cv::Mat(kWide_px, kWide_px, CV_16U, cv::Scalar(1000))}, camera, {}};
  view.mask = cv::Mat(kWide_px, kWide_px, CV_32F, const_cast<float*>(lengths_mm.data())) > 0;
  return view;
}

/// The straight line through outline points, between the first and the last of them along the image's columns.
LineSegment line_through(const std::vector<Eigen::Vector2d>& pixels) {
  Eigen::MatrixXd terms(Eigen::Index(pixels.size()), 2);
  Eigen::VectorXd u(Eigen::Index(pixels.size()));
  double low = kSize_px, high = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    terms.row(Eigen::Index(i)) << 1, pixels[i].y();
    u[Eigen::Index(i)] = pixels[i].x();
    low = std::min(low, pixels[i].y()), high = std::max(high, pixels[i].y());
  }
  const Eigen::Vector2d line = least_squares(terms, u);
  return {{line[0] + line[1] * low, low}, {line[0] + line[1] * high, high}};
}

/// The borders of the shaft in the upper part of the image, where nothing lies beside it.
ShaftLines lines_of(const Scene& scene, const Camera& camera) {
  std::vector<Eigen::Vector2d> sides[2];
  for (const OutlinePoint& point : BodyProjector({bone(scene)[0]}).outline(camera, truth(scene), 2))
    if (point.v_px < 0.45 * kSize_px) sides[point.normal_u > 0].emplace_back(point.u_px, point.v_px);
  ShaftLines lines;
  lines.left = line_through(sides[1]);  // seen down the image, left is at larger u
  lines.right = line_through(sides[0]);
  lines.width_mm = 25;
  lines.width_deviation_mm = 1;
  return lines;
}

Landmarks landmarks_of(const Scene& scene, const List<View>& views, Random& random) {
  const Body body = bone(scene);
  const double side = scene.is_mirrored ? -1 : 1;
  const std::pair<const char*, Eigen::Vector3d> points[] = {
      {"lateral", body[1].centre_mm + Eigen::Vector3d(8 * side, 0, 0)},
      {"medial", body[2].centre_mm - Eigen::Vector3d(7 * side, 0, 0)},
      {"front", body[1].centre_mm - Eigen::Vector3d(0, 10, 0)},
      {"end", body[2].centre_mm - Eigen::Vector3d(0, 0, 9)},
      {"shaft", Eigen::Vector3d(0, 12, 45)}};
  Landmarks landmarks;
  for (const auto& [name, model_mm] : points) {
    const Eigen::Vector3d world_mm = truth(scene) * model_mm;
    landmarks.points.push_back({name, model_mm});
    landmarks.tracked.push_back({name, world_mm + normal(random, 0.5)});
    for (const View& view : views)
      landmarks.seen.push_back({name, view.name, project(view.camera, world_mm) + normal(random, 1).head<2>()});
  }
  return landmarks;
}

/// A placement off the truth by up to these numbers of degrees and mm, without axes.
Value placed(const Scene& scene, Random& random, double most) {
  Vector6d motion;
  motion << drawn(random, most) * radians(1), drawn(random, most);
  Pose pose;
  FragmentFrame middle;
  pose.world_from_model = moved(truth(scene), middle, motion);
  return item(pose);
}

/// All inputs of the kind. The nominal placement is up to 8 degrees and 8 mm off. Marked and tracked landmarks have
/// errors of 1 px and 0.5 mm.
Inputs inputs_of(const Scene& scene) {
  Random random(std::uint64_t(100 + scene.seed));
  List<View> views, silhouettes;
  List<ShaftLines> lines;
  std::vector<SeenBody> seen_bodies;
  for (const auto& [name, angle_deg] : {std::pair("frontal", 0.0), std::pair("lateral", 80.0)}) {
    const Camera camera = camera_of(scene, angle_deg);
    views.add(name, View{name, {cv::Mat(kSize_px, kSize_px, CV_16U, cv::Scalar(1000))}, camera, {}});
    silhouettes.add(name, silhouette_of(bone(scene), truth(scene), name, camera));
    lines.add(name, lines_of(scene, camera));
    seen_bodies.push_back(seen(bone(scene), camera, truth(scene), 8, 8));
  }
  return {{"model", item(mesh_of(bone(scene)))},
          {"lines", Value::of(lines, "view")},
          {"views", Value::of(views, "view")},
          {"silhouettes", Value::of(silhouettes, "view")},
          {"landmarks", item(landmarks_of(scene, views, random))},
          {"start", placed(scene, random, 8)},
          {"first", placed(scene, random, 40)},
          {"second", placed(scene, random, 6)},
          {"third", placed(scene, random, 20)},
          {"fourth", placed(scene, random, 30)},
          {"cost", Value::of<Cost>(std::make_shared<const OutlineCost>(bone(scene), seen_bodies))},
          {"optimizer", Value::of<Optimizer>(std::make_shared<const Compass>())}};
}

FreeScene free_scene(int seed) {
  Random random{std::uint64_t(seed)};
  const Body body{{{0, 0, 0}, {16, 12, 30}}, {{26, 4, 18}, {7, 8, 11}}, {{-20, -16, -14}, {9, 6, 7}}};
  FreeScene scene;
  scene.truth = moved_by(drawn(random, 3.1), drawn(random, 25));
  List<View> views;
  List<EdgeMap> edges;
  std::vector<SeenBody> seen_bodies;
  for (const auto& [name, angle_deg] : {std::pair("frontal", 0.0), std::pair("lateral", 80.0)}) {
    const Camera camera = camera_of({}, angle_deg);
    views.add(name, View{name, {cv::Mat(kSize_px, kSize_px, CV_16U, cv::Scalar(1000))}, camera, {}});
    EdgeMap map{kSize_px, kSize_px, {}};
    for (const OutlinePoint& p : BodyProjector(body).outline(camera, scene.truth, 1))
      map.pixels.push_back({p.u_px, p.v_px, p.normal_u, p.normal_v, 10});
    edges.add(name, map);
    seen_bodies.push_back(seen(body, camera, scene.truth, 8, 8));
  }
  scene.inputs = {{"model", item(mesh_of(body))},
                  {"views", Value::of(views, "view")},
                  {"edges", Value::of(edges, "view")},
                  {"projector", Value::of<OutlineProjector>(std::make_shared<const BodyProjector>(body))},
                  {"cost", Value::of<Cost>(std::make_shared<const OutlineCost>(body, seen_bodies))},
                  {"optimizer", Value::of<Optimizer>(std::make_shared<const Compass>())}};
  return scene;
}

constexpr int kCases = 3;

/// How far a start is from the truth: in its rotation, and in the middle of what the views show.
struct Off {
  double deg = 0, mm = 0;
  double most() const { return std::max(deg, mm); }
};

Off off_truth(const Subject& subject, const Inputs& inputs, const RigidTransform& right) {
  const RigidTransform found = subject.output(inputs, "pose").as<Pose>().world_from_model;
  return {degrees(geodesic_angle_rad(found.rotation, right.rotation)),
          (found.translation_mm - right.translation_mm).norm()};  // the CT's origin is in the middle
}

/// The largest over some cases, in degrees and in mm.
Off largest(const Subject& subject, bool is_mirrored, bool is_turned) {
  Off most;
  for (int seed = 1; seed <= kCases; ++seed) {
    const Off off =
        off_truth(subject, inputs_of({seed, is_mirrored, is_turned}), truth({seed, is_mirrored, is_turned}));
    most = {std::max(most.deg, off.deg), std::max(most.mm, off.mm)};
  }
  return most;
}

/// The angle between the long axis of the start and that of the bone.
double long_axis_off_deg(const Subject& subject) {
  const Inputs inputs = inputs_of({});
  const FragmentFrame found = subject.output(inputs, "pose").as<Pose>().frame;
  expect(found.is_anatomical, "its start does not have the axes of the fragment");
  const Eigen::Vector3d axis = fragment_frame(inputs.at("model").as<Mesh>()).axes.col(2);
  return degrees(found.axes.col(2).cross(axis).norm());
}

/// The same at all poses, without a word.
class Constant : public Cost {
 public:
  explicit Constant(double value) : value_(value) {}
  double value(const RigidTransform&) const override { return value_; }
  std::shared_ptr<const Cost> at_level(const CostLevel&) const override { return std::make_shared<Constant>(*this); }

 private:
  double value_;
};

bool takes(const Subject& subject, const std::string& input) {
  const auto& ports = subject.info().inputs;
  return std::any_of(ports.begin(), ports.end(), [&](const PortInfo& one) { return one.name == input; });
}

/// The number of costs without anything to compare that lead to a start.
double starts_of_nothing(const Subject& subject) {
  if (!takes(subject, "cost")) throw NotApplicable("it takes no cost");
  double count = 0;
  for (const double value : {0.0, 0.7, std::nan("")}) {
    Inputs inputs = inputs_of({});
    inputs.set("cost", Value::of<Cost>(std::make_shared<const Constant>(value)));
    const Result result = subject.call(inputs);
    if (result.refusal) expect_reason(*result.refusal);
    count += !result.refusal;
  }
  return count;
}

/// The larger of the angle and the distance, of a body in any orientation.
double without_start(const Subject& subject) {
  for (const char* port : {"projector", "views", "edges", "cost"})
    if (!takes(subject, port))
      throw NotApplicable(std::string("it takes no ") + port + ", so it needs more than images");
  double most = 0;
  for (int seed = 1; seed <= kCases; ++seed) {
    const FreeScene scene = free_scene(seed);
    most = std::max(most, off_truth(subject, scene.inputs, scene.truth).most());
  }
  return most;
}

void validate(const Inputs&, const std::vector<PortInfo>& ports, const std::vector<Value>& outputs) {
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    if (ports[i].name != "pose") continue;
    expect(outputs[i].data != nullptr, "it gives no start");
    const Pose& pose = outputs[i].as<Pose>();
    check_pose(pose, "the start");
    expect(std::isfinite(pose.cost), "the cost of its start is not finite");
  }
}

/// The inputs with a change of one of them.
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
  const auto without = [](const char* port) {
    return [port] {
      Inputs inputs = inputs_of({});
      inputs.at(port).items.clear();
      inputs.at(port).names.clear();
      return inputs;
    };
  };
  const auto with_masks = [](const std::function<cv::Mat(const cv::Mat&)>& change) {
    return [change] {
      Inputs inputs = inputs_of({});
      List<View> silhouettes;
      for (const Value& one : inputs.at("silhouettes").items) {
        View view = one.as<View>();
        view.mask = change(view.mask);
        const std::string name = view.name;
        silhouettes.add(name, std::move(view));
      }
      inputs.set("silhouettes", Value::of(silhouettes, "view"));
      return inputs;
    };
  };
  return {
      with_changed<Landmarks>("no_landmarks", "landmarks", [](Landmarks& marks) { marks = {}; }),
      with_changed<Landmarks>("two_landmarks", "landmarks",
                              [](Landmarks& marks) {
                                marks.tracked.resize(2);
                                marks.seen.resize(4);
                              }),
      with_changed<Landmarks>("landmark_not_a_number", "landmarks",
                              [none](Landmarks& marks) {
                                marks.tracked[0].world_mm.x() = none;
                                marks.seen[0].pixel.x() = none;
                              }),
      with_changed<Landmarks>("unknown_landmark", "landmarks",
                              [](Landmarks& marks) { marks.points.erase(marks.points.begin()); }),
      {"no_lines", without("lines")},
      {"no_views", without("views")},
      {"no_silhouettes", without("silhouettes")},
      {"silhouettes_without_masks", with_masks([](const cv::Mat&) { return cv::Mat(); })},
      {"empty_silhouettes", with_masks([](const cv::Mat& mask) { return cv::Mat(mask.size(), CV_8U, cv::Scalar(0)); })},
      {"silhouettes_cut_off", with_masks([](const cv::Mat& mask) {
         cv::Mat cut = mask.clone();
         cut.rowRange(0, cut.rows / 2).setTo(255);
         return cut;
       })},
      {"broken_camera",
       [none] {
         Inputs inputs = inputs_of({});
         for (const char* port : {"views", "silhouettes"}) {
           List<View> views;
           for (const Value& one : inputs.at(port).items) {
             View view = one.as<View>();
             view.camera.intrinsics(0, 0) = none;
             const std::string name = view.name;
             views.add(name, std::move(view));
           }
           inputs.set(port, Value::of(views, "view"));
         }
         return inputs;
       }},
      with_changed<Mesh>("no_surface", "model", [](Mesh& mesh) { mesh = {}; }),
      with_changed<Pose>("start_not_a_number", "start",
                         [none](Pose& start) { start.world_from_model.translation_mm.x() = none; }),
      with_changed<Pose>("start_not_rigid", "start", [](Pose& start) { start.world_from_model.rotation *= 2; }),
      with_changed<Pose>("start_far_off", "start",
                         [](Pose& start) { start.world_from_model.translation_mm.z() += 5000; })};
}

Suite initial_suite() {
  constexpr double kRange = 10;  // from which a registration finds the pose
  Suite suite{[] { return inputs_of({}); }, validate, trials(), {}};
  // The truth is near, so a search of many poses needs no more than this.
  suite.options = [] { return std::map<std::string, OptionValue>{{"poses", 1500}, {"candidates", 20}}; };
  const auto add = [&](const char* name, const std::string& what, double limit, const char* unit,
                       std::function<double(const Subject&)> measure) {
    suite.accuracy.push_back({{name, what, limit, unit}, std::move(measure)});
  };
  add("rotation", "the largest angle to the true pose, of 3 poses; the nominal placement is 4 to 8 degrees and mm off",
      kRange, "deg", [](const Subject& subject) { return largest(subject, false, false).deg; });
  add("position", "the largest distance of the bone from the truth in the middle of the views, of the same poses",
      kRange, "mm", [](const Subject& subject) { return largest(subject, false, false).mm; });
  add("turned_world", "the larger of both where the world has other axes and another origin", kRange, "degrees or mm",
      [](const Subject& subject) { return largest(subject, false, true).most(); });
  add("mirrored", "the larger of both for the bone of the other side", kRange, "degrees or mm",
      [](const Subject& subject) { return largest(subject, true, false).most(); });
  add("long_axis", "the long axis of the start from that of the bone", 1e-3, "deg", long_axis_off_deg);
  add("without_start", "the larger of both for a body of 8 cm in any of 3 orientations, about which nothing is known",
      kRange, "degrees or mm", without_start);
  add("nothing_compared", "starts found where the cost is constant or not a number", 0, "starts", starts_of_nothing);
  return suite;
}

}  // namespace
}  // namespace marrow::conformance

MARROW_PLUGIN(plugin) { plugin.suite("initial", marrow::conformance::initial_suite()); }
