// SPDX-License-Identifier: Apache-2.0
// Checks for verdicts on a bone that is known analytically: right poses, poses after mistakes, and poses whose own
// predicted deviations are large. Data are those of the kind; a verdict takes what it has ports for.
#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <marrow/plugin.hpp>
#include <vector>

#include "marrow/domain/random.hpp"
#include "marrow/toolbox/analytic/functions.hpp"

namespace marrow::conformance {
namespace {

// Test data of the suite for verdicts: a bone that is known analytically, drawn exactly into two views, and a pose of
// it that is right or the result of a mistake.

enum class Mistake {
  none,
  depth,      ///< 5 mm off along the line of sight of the frontal view
  axial,      ///< turned by 8 degrees about the long axis
  along,      ///< 5 mm off along the long axis
  half_turn,  ///< the best pose near half a turn about the long axis
  swapped,    ///< the best pose for images whose views were exchanged
  mirrored,   ///< the best pose of the bone of the other side
};

struct Scene {
  int seed = 1;  ///< of the true pose and of the errors of the outline
  Mistake mistake = Mistake::none;
};

using namespace analytic;

constexpr int kSize_px = 240;
constexpr double kPixel_mm = 0.8, kEdges_px = 0.4;

/// Radii and places differ, so that no turn about the long axis looks the same.
Body bone(bool is_mirrored) {
  Body body{{{0, 0, 8}, {9, 13, 32}}, {{20, -5, -22}, {8, 10, 9}}, {{-17, 7, -25}, {6, 9, 8}}};
  if (is_mirrored)
    for (Ellipsoid& one : body) one.centre_mm.x() *= -1;
  return body;
}

/// A pose that is turned and shifted by up to 10 degrees and mm.
RigidTransform truth(const Scene& scene) {
  Random random(std::uint64_t(scene.seed));
  const auto drawn = [&](double most) {
    Eigen::Vector3d vector;
    for (double& one : vector) one = most * (2 * random.uniform() - 1);
    return vector;
  };
  const Eigen::Vector3d turn_rad = drawn(radians(10)), shift_mm = drawn(10);
  return moved_by(turn_rad, shift_mm);
}

struct Drawn {
  std::string name;
  SeenBody seen;
  View view;
  EdgeMap edges;
};

/// An X-ray image of the bone without noise: what the rays pass through, in a device that darkens exponentially.
cv::Mat image_of(const Camera& camera, const RigidTransform& pose) {
  const std::vector<float> bone_mm =
      BodyProjector(bone(false)).radiograph(camera, pose, PixelGrid{0, 0, 1, kSize_px, kSize_px});
  cv::Mat pixels(kSize_px, kSize_px, CV_16U);
  std::transform(bone_mm.begin(), bone_mm.end(), pixels.begin<std::uint16_t>(),
                 [](float mm) { return std::uint16_t(std::lround(40000 * std::exp(-0.02 * double(mm)))); });
  return pixels;
}

/// Edge pixels on the outline, with errors. Their gradients point away from the bone, where the image is brighter.
EdgeMap edges_of(const Camera& camera, const RigidTransform& pose, Random& random) {
  EdgeMap map{kSize_px, kSize_px, {}};
  for (const OutlinePoint& point : BodyProjector(bone(false)).outline(camera, pose, 1))
    map.pixels.push_back({point.u_px + float(kEdges_px * random.normal()),
                          point.v_px + float(kEdges_px * random.normal()), point.normal_u, point.normal_v, 300});
  const auto place = [](const EdgePixel& e) { return std::pair(std::lround(e.v_px), std::lround(e.u_px)); };
  std::stable_sort(map.pixels.begin(), map.pixels.end(),
                   [&](const EdgePixel& a, const EdgePixel& b) { return place(a) < place(b); });
  return map;
}

/// Two views of the bone. If they are swapped, each camera has what the other one saw.
std::vector<Drawn> drawn_views(const Scene& scene) {
  const std::pair<const char*, double> views[] = {{"frontal", 0}, {"lateral", 80}};
  Random random(std::uint64_t(50 + scene.seed));
  std::vector<Drawn> drawn;
  for (std::size_t i = 0; i < 2; ++i) {
    const Camera own = c_arm(views[i].second, kSize_px, kSize_px, kPixel_mm),
                 of_image =
                     c_arm(views[scene.mistake == Mistake::swapped ? 1 - i : i].second, kSize_px, kSize_px, kPixel_mm);
    SeenBody seen_body = seen(bone(false), of_image, truth(scene), 4, 2);
    for (Eigen::Vector2d& pixel : seen_body.outline_px)
      pixel += kEdges_px * Eigen::Vector2d{random.normal(), random.normal()};
    seen_body.camera = own;
    const std::string name = views[i].first;
    drawn.push_back({name, std::move(seen_body), View{name, {image_of(of_image, truth(scene))}, own, {}},
                     edges_of(of_image, truth(scene), random)});
  }
  return drawn;
}

RigidTransform refined(const Cost& cost, const RigidTransform& from, const FragmentFrame& frame) {
  MinimisationProblem problem;
  problem.function = [&](const Eigen::VectorXd& x) { return cost.value(moved(from, frame, Vector6d(x))); };
  problem.start = Eigen::VectorXd::Zero(6);
  problem.initial_step = Eigen::VectorXd::Constant(6, 1);
  problem.initial_step.head<3>() *= radians(1);
  problem.step_tolerance = 0.02;
  return moved(from, frame, Vector6d(Compass().minimise(problem).x));
}

/// The pose after the mistake.
RigidTransform judged_pose(const Scene& scene, const Cost& cost, const FragmentFrame& frame) {
  Vector6d off = Vector6d::Zero();
  RigidTransform pose = truth(scene);
  switch (scene.mistake) {
    case Mistake::depth:
      pose.translation_mm += 5 * c_arm(0, kSize_px, kSize_px, kPixel_mm).camera_from_world.rotation.row(2).transpose();
      return pose;
    case Mistake::axial:
      off[2] = radians(8);
      return moved(pose, frame, off);
    case Mistake::along:
      off[5] = 5;
      return moved(pose, frame, off);
    case Mistake::half_turn:
      off[2] = kPi;
      break;
    default:
      break;
  }
  return refined(cost, moved(pose, frame, off), frame);
}

/// All inputs of the kind but those about other poses of this bone and about other fragments. The pose has the
/// predicted deviations of a right one.
Inputs inputs_of(const Scene& scene) {
  const Body body = bone(scene.mistake == Mistake::mirrored);
  const std::vector<Drawn> all = drawn_views(scene);
  std::vector<SeenBody> seen_bodies;
  List<View> views;
  List<EdgeMap> edges;
  for (const Drawn& one : all) {
    seen_bodies.push_back(one.seen);
    views.add(one.name, one.view);
    edges.add(one.name, one.edges);
  }
  const auto cost = std::make_shared<const RadiographCost>(body, seen_bodies);
  const Mesh model = mesh_of(body);
  Pose pose;
  pose.frame = fragment_frame(model);
  pose.world_from_model = judged_pose(scene, *cost->at_level({4, 8, 4}), pose.frame);
  Vector6d deviations;
  deviations << radians(0.2), radians(0.2), radians(0.5), 0.1, 0.1, 0.2;
  pose.covariance = deviations.cwiseAbs2().asDiagonal();
  return {{"pose", item(pose)},
          {"cost", Value::of<Cost>(cost)},
          {"contour_cost", Value::of<Cost>(std::make_shared<const OutlineCost>(body, seen_bodies))},
          {"optimizer", Value::of<Optimizer>(std::make_shared<const Compass>())},
          {"views", Value::of(views, "view")},
          {"edges", Value::of(edges, "view")},
          {"projector", Value::of<OutlineProjector>(std::make_shared<const BodyProjector>(body))},
          {"model", item(model)}};
}

constexpr Mistake kMistakes[] = {Mistake::depth,     Mistake::axial,   Mistake::along,
                                 Mistake::half_turn, Mistake::swapped, Mistake::mirrored};
constexpr int kRightPoses = 3, kCasesOfMistakes = 2;

Verdict verdict_on(const Subject& subject, const Inputs& inputs) {
  return subject.output(inputs, "verdict").as<Verdict>();
}

/// Whether the node is given anything that shows how the pose fits the images.
bool sees_the_images(const Subject& subject) {
  const auto& ports = subject.info().inputs;
  return std::any_of(ports.begin(), ports.end(), [](const PortInfo& one) {
    return one.name == "cost" || one.name == "contour_cost" || one.name == "views" || one.name == "edges";
  });
}

/// The share of poses after mistakes that are called trusted.
double mistakes_trusted_percent(const Subject& subject) {
  if (!sees_the_images(subject))
    throw NotApplicable("it takes neither a cost nor views nor edges, so no mistake shows");
  int trusted = 0, all = 0;
  for (const Mistake mistake : kMistakes)
    for (int seed = 1; seed <= kCasesOfMistakes; ++seed, ++all)
      trusted += verdict_on(subject, inputs_of({seed, mistake})).judgement == Judgement::trusted;
  return 100.0 * trusted / all;
}

/// The share of right poses whose judgement is at least as bad as this one.
double right_poses_percent(const Subject& subject, Judgement at_least) {
  int judged_so = 0;
  for (int seed = 1; seed <= kRightPoses; ++seed)
    judged_so += verdict_on(subject, inputs_of({seed, Mistake::none})).judgement >= at_least;
  return 100.0 * judged_so / kRightPoses;
}

Inputs with_deviations(const Vector6d& deviations) {
  Inputs inputs = inputs_of({});
  Pose pose = inputs.at("pose").as<Pose>();
  pose.covariance = deviations.cwiseAbs2().asDiagonal();
  inputs.set("pose", item(pose));
  return inputs;
}

/// The number of poses trusted that are hardly known by their own prediction: a deviation of 10 mm along an axis, of 20
/// degrees about the long axis, none known about it, and deviations of 0, which no comparison gives.
double unknown_poses_trusted(const Subject& subject) {
  Vector6d good;
  good << radians(0.2), radians(0.2), radians(0.5), 0.1, 0.1, 0.2;
  Vector6d far = good, turned = good, open = good;
  far[3] = 10;
  turned[2] = radians(20);
  open[2] = std::numeric_limits<double>::infinity();
  int trusted = 0;
  for (const Vector6d& deviations : {far, turned, open, Vector6d(Vector6d::Zero())})
    trusted += verdict_on(subject, with_deviations(deviations)).judgement == Judgement::trusted;
  return trusted;
}

/// A failure model for these data, set by hand: for a verdict that needs the file of one.
std::map<std::string, OptionValue> options() {
  const std::filesystem::path path = files_folder() / "failure-model.yaml";
  std::ofstream(path)
      << "marrow-failure-model: 1\nrecord: set by hand\nbias: -5\ndoubtful_above: 0.1\nwrong_above: 0.9\nterms:\n"
         "- {figure: unexplained, scale: 0.1, weight: 6, absent: 0}\n"
         "- {figure: outline_part_mm, scale: 0.2, weight: 3, absent: 0}\n"
         "- {figure: apart_mm, scale: 1, weight: 2, absent: 0}\n"
         "- {figure: apart_deg, scale: 2, weight: 2, absent: 0}\n";
  return {{"failure_model", path.string()}};
}

void validate(const Inputs&, const std::vector<PortInfo>& ports, const std::vector<Value>& outputs) {
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    if (ports[i].name != "verdict") continue;
    expect(outputs[i].data != nullptr, "it gives no verdict");
    const Verdict& verdict = outputs[i].as<Verdict>();
    const double probability = verdict.failure_probability;
    expect(std::isnan(probability) || (probability >= 0 && probability <= 1),
           "its probability of a failure is " + digits(probability) + ", not in 0 to 1");
    const bool is_trusted = verdict.judgement == Judgement::trusted;
    expect(is_trusted || !verdict.reasons.empty(), "it calls a pose doubtful or wrong without a reason");
    expect(is_trusted || !verdict.remedies.empty(), "it calls a pose doubtful or wrong without saying what would help");
    for (const Metric& figure : verdict.figures)
      expect(std::isfinite(figure.value), "its figure '" + figure.name + "' is not finite");
  }
}

std::vector<Trial> trials() {
  const auto with_pose = [](const std::function<void(Pose&)>& change) {
    return [change] {
      Inputs inputs = inputs_of({});
      Pose pose = inputs.at("pose").as<Pose>();
      change(pose);
      inputs.set("pose", item(pose));
      return inputs;
    };
  };
  return {{"pose_not_a_number", with_pose([](Pose& pose) { pose.world_from_model.translation_mm.x() = std::nan(""); })},
          {"pose_not_rigid", with_pose([](Pose& pose) { pose.world_from_model.rotation *= 2; })},
          {"pose_out_of_view", with_pose([](Pose& pose) { pose.world_from_model.translation_mm.z() += 400; })},
          {"no_deviations", with_pose([](Pose& pose) { pose.covariance.reset(); })},
          {"no_surface",
           [] {
             Inputs inputs = inputs_of({});
             inputs.set("model", item(Mesh()));
             return inputs;
           }},
          {"no_views", [] {
             Inputs inputs = inputs_of({});
             for (const char* port : {"views", "edges"}) {
               inputs.at(port).items.clear();
               inputs.at(port).names.clear();
             }
             return inputs;
           }}};
}

Suite verdict_suite() {
  Suite suite{[] { return inputs_of({}); }, validate, trials(), {}, options};
  const auto add = [&](const char* name, const std::string& what, double limit, const char* unit,
                       std::function<double(const Subject&)> measure) {
    suite.accuracy.push_back({{name, what, limit, unit}, std::move(measure)});
  };
  add("mistakes_trusted",
      "of poses 5 mm off in depth or along the bone, 8 degrees about it, at half a turn, after swapped views and of "
      "the other side's bone: those called trusted",
      0, "%", mistakes_trusted_percent);
  add("right_wrong", "right poses called wrong", 0, "%",
      [](const Subject& subject) { return right_poses_percent(subject, Judgement::wrong); });
  add("right_not_trusted", "right poses called doubtful or wrong", 50, "%",
      [](const Subject& subject) { return right_poses_percent(subject, Judgement::doubtful); });
  add("unknown_trusted", "poses trusted although their own predicted deviations are large, infinite or 0", 0, "poses",
      unknown_poses_trusted);
  return suite;
}

}  // namespace
}  // namespace marrow::conformance

MARROW_PLUGIN(plugin) { plugin.suite("verdict", marrow::conformance::verdict_suite()); }
