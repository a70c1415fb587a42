// SPDX-License-Identifier: Apache-2.0
// Checks for costs on two simulated views of a body with a known pose: three ellipsoids in soft tissue, with blur and
// noise, and the edges of these images. Other inputs of a node (volume, field, surface, projector) show the same body.
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/task_arena.h>
#include <marrow/plugin.hpp>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>

#include "scene.hpp"
#include "silence_checks.hpp"

namespace marrow::conformance {
namespace {

using namespace analytic;

std::vector<RigidTransform> strange_poses() {
  RigidTransform out = truth(), behind = truth(), far = truth(), around = truth();
  out.translation_mm += Eigen::Vector3d(0, 0, 400);
  behind.translation_mm += Eigen::Vector3d(0, -900, 0);
  far.translation_mm += Eigen::Vector3d(1e7, 0, 1e7);
  around.translation_mm += Eigen::Vector3d(0, -600, 0);  // the body surrounds the frontal view's source
  return {truth(), out, behind, far, around};
}

void check_blocks(const Cost& cost, const std::vector<RigidTransform>& poses) {
  const std::size_t blocks = cost.without_each_block(truth()).size();
  for (const RigidTransform& pose : poses) {
    const std::vector<double> without = cost.without_each_block(pose);
    expect(without.size() == blocks,
           formatted("without_each_block() gives {} values at one pose and {} at another", blocks, without.size()));
    for (const double value : without) expect(std::isfinite(value), "a value without a block is not finite");
    for (std::size_t view = 0; view < cost.view_count(); ++view)
      expect(std::isfinite(cost.value_in_view(view, pose)), "its value in one view is not finite");
  }
}

void validate(const Inputs&, const std::vector<PortInfo>& ports, const std::vector<Value>& outputs) {
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    if (ports[i].name != "cost") continue;
    expect(outputs[i].data != nullptr, "it gives no cost");
    const Cost& cost = outputs[i].as<Cost>();
    const std::vector<RigidTransform> poses = strange_poses();
    const std::vector<double> together = cost.values(poses);
    expect(together.size() == poses.size(), formatted("of {} poses it gives {} values", poses.size(), together.size()));
    for (std::size_t k = 0; k < poses.size(); ++k) {
      const double value = cost.value(poses[k]);
      expect(std::isfinite(value), std::string("its value is ") + (std::isnan(value) ? "not a number" : "infinite") +
                                       " where the bone " +
                                       (k == 0   ? "is"
                                        : k == 1 ? "is out of view"
                                        : k == 2 ? "is behind the source"
                                        : k == 3 ? "is far away"
                                                 : "is about the source"));
      expect(value == together[k], "values() gives other values than value()");
    }
    expect(std::isfinite(cost.at_level({4, 10, 4})->value(truth())), "its value at another level is not finite");
    check_blocks(cost, poses);
  }
}

double better_than_truth_percent(const Subject& subject) {
  constexpr int kPoses = 60;
  const Made cost = made(subject);
  const double best = cost->value(truth());
  std::mt19937 random(4);
  const auto uniform = [&] { return 2 * double(random()) / 4294967296.0 - 1; };
  int better = 0;
  for (int i = 0; i < kPoses; ++i) {
    const Eigen::Vector3d turn(uniform(), uniform(), uniform()), shift(uniform(), uniform(), uniform());
    better += cost->value(off_truth(turn.normalized() * (2 + 3 * std::abs(uniform())),
                                    shift.normalized() * (2 + 3 * std::abs(uniform())))) <= best;
  }
  return 100.0 * better / kPoses;
}

/// Steps of 1.5 degrees or mm along each of the six axes, from 1.5 to 6 away from the truth.
double steps_down_percent(const Subject& subject) {
  const Made cost = made(subject);
  int down = 0, all = 0;
  for (int axis = 0; axis < 6; ++axis)
    for (const double side : {-1.0, 1.0}) {
      double before = cost->value(off_truth(axis, side * 1.5));
      for (const double by : {3.0, 4.5, 6.0}) {
        const double value = cost->value(off_truth(axis, side * by));
        down += value <= before;
        ++all;
        before = value;
      }
    }
  return 100.0 * down / all;
}

Pose pose_of(const RigidTransform& world_from_model) {
  Pose pose;
  pose.world_from_model = world_from_model;
  return pose;
}

/// Distance between the truth and the minimum along an axis, in steps of 0.2 [deg or mm].
double off_along(const Cost& cost, int axis) {
  double least = cost.value(truth()), at = 0;
  for (double by = -3; by < 3.1; by += 0.2)
    if (const double value = cost.value(off_truth(axis, by)); value < least) least = value, at = by;
  return std::abs(at);
}
double off_the_truth(const Made& cost) {
  double sum = 0;
  for (int axis = 0; axis < 6; ++axis) sum += off_along(*cost, axis) / 6;
  return sum;
}

/// The range of the cost: the largest difference between a pose 6 degrees or mm off and the truth.
double range_of(const Cost& cost) {
  double most = 0;
  for (int axis = 0; axis < 6; ++axis) most = std::max(most, cost.value(off_truth(axis, 6)) - cost.value(truth()));
  expect(most > 0, "its value 6 mm or degrees off is not above that at the truth");
  return most;
}

double gain_percent(const Subject& subject) {
  if (!subject.has_trait("unmoved_by_gain")) throw NotApplicable("it does not say that it is unmoved by them");
  const Made plain = made(subject, {false, 1, 0, 0}), changed = made(subject, {false, 1.6, 0.4, 0});
  double most = 0;
  for (int axis = 0; axis < 6; ++axis)
    for (const double by : {0.0, 2.0, 5.0})
      most = std::max(most, std::abs(plain->value(off_truth(axis, by)) - changed->value(off_truth(axis, by))));
  return 100 * most / range_of(*plain);
}

/// Changes grey values and edges in the masked part of the images, where a part of the body lies.
double mask_percent(const Subject& subject) {
  const auto masked = [](bool change) {
    return inputs_of({}, [change](View& view, EdgeMap& map) {
      view.mask = cv::Mat(kSize_px, kSize_px, CV_8U, cv::Scalar(255));
      const cv::Rect corner(0, 0, kSize_px, kSize_px / 3);
      view.mask(corner).setTo(0);
      if (!change) return;
      view.image.pixels = view.image.pixels.clone();
      // Not up to the border of the mask, because blur mixes a few pixels there.
      view.image.pixels(cv::Rect(0, 0, kSize_px, kSize_px / 3 - 12)).setTo(9000);
      std::erase_if(map.pixels, [&](const EdgePixel& edge) { return edge.v_px < kSize_px / 3 - 12; });
    });
  };
  const Made one(subject, masked(false)), other(subject, masked(true));
  double most = 0;
  for (const double by : {0.0, 2.0, 5.0})
    most = std::max(most, std::abs(one->value(off_truth(3, by)) - other->value(off_truth(3, by))));
  return 100 * most / range_of(*one);
}

double differing_values(const Subject& subject) {
  const Made cost = made(subject);
  const std::vector<RigidTransform> poses{truth(), off_truth(0, 2), off_truth(4, 3)};
  const std::vector<double> expected = cost->values(poses);
  int differing = 0;
  for (const int threads : {1, 2, 7}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, std::size_t(threads));
    tbb::task_arena arena(threads);
    arena.execute([&] {
      for (std::size_t i = 0; i < poses.size(); ++i) differing += cost->value(poses[i]) != expected[i];
    });
  }
  return differing;
}

double coarse_level_off(const Subject& subject) {
  const Made cost = made(subject);
  const std::shared_ptr<const Cost> coarse = cost->at_level({4, 12, 4});
  double off = 0;
  for (int axis = 0; axis < 6; ++axis)
    for (const double side : {-1.0, 1.0}) off += coarse->value(off_truth(axis, 5 * side)) <= coarse->value(truth());
  return 100 * off / 12;
}

double nothing_seen(const Subject& subject) {
  const Made cost = made(subject);
  const std::vector<RigidTransform> poses = strange_poses();
  int better = 0;
  for (std::size_t i = 1; i < poses.size(); ++i) better += cost->value(poses[i]) <= cost->value(off_truth(3, 1));
  return better;
}

/// Difference between the cost's own derivatives and finite differences, in percent of their length, at a pose where
/// they are not small.
double slope_percent(const Subject& subject) {
  const Made cost = made(subject);
  const RigidTransform pose = off_truth({1, -0.7, 0.8}, {0.8, 0.6, -0.7});
  const FragmentFrame frame{Eigen::Vector3d::Zero(), rotation_from_vector({0.3, 0.2, -0.1})};
  const auto about = cost->expansion(pose, frame);
  const bool is_declared = subject.has_trait("derivatives");
  expect(!is_declared || about, "it declares the trait 'derivatives', but its cost tells none");
  expect(is_declared || !about, "its cost tells derivatives, but it does not declare the trait 'derivatives'");
  if (!about) throw NotApplicable("it tells no derivatives");
  expect(std::abs(about->value - cost->value(pose)) <= 1e-9 * (1 + std::abs(about->value)),
         "the value of its expansion is not that of the pose");
  expect(about->curvature.allFinite() && (about->curvature - about->curvature.transpose()).cwiseAbs().maxCoeff() <
                                             1e-9 * about->curvature.cwiseAbs().maxCoeff(),
         "its curvature is not symmetric");
  const Vector6d eigenvalues = about->curvature.selfadjointView<Eigen::Lower>().eigenvalues();
  expect(eigenvalues.minCoeff() >= -1e-9 * eigenvalues.maxCoeff(), "its curvature has a negative eigenvalue");
  Vector6d slope, scale;
  for (int k = 0; k < 6; ++k) {
    const double h = k < 3 ? 4e-3 : 0.1;
    const Vector6d step = h * Vector6d::Unit(k);
    scale[k] = k < 3 ? 0.03 : 1;  // converts rad to mm for the size of the body
    slope[k] = (cost->value(moved(pose, frame, step)) - cost->value(moved(pose, frame, -step))) / (2 * h);
  }
  return 100 * (slope - about->gradient).cwiseProduct(scale).norm() / slope.cwiseProduct(scale).norm();
}

/// Adds the fragments of the case: this one, and another one if wanted.
void add_fragments(Inputs& inputs, bool with_other) {
  List<OutlineProjector> outlines;
  List<RadiographProjector> radiographs;
  List<Pose> poses;
  const auto add = [&](const std::string& name, const std::shared_ptr<const BodyProjector>& projector) {
    outlines.add_shared(name, projector);
    radiographs.add_shared(name, projector);
    poses.add(name, pose_of(truth()));
  };
  add("bone", bone_projector());
  if (with_other) add("other", std::make_shared<const BodyProjector>(other_bone()));
  inputs.set("other_projectors", Value::of(outlines, "fragment"));
  inputs.set("other_projectors", Value::of(radiographs, "fragment"));
  inputs.set("others", Value::of(poses, "fragment"));
}

/// If the list of fragments holds only the own fragment, nothing may change. With another fragment in the images, the
/// minimum must stay near the truth.
double off_beside_another(const Subject& subject) {
  bool knows = false;
  for (const PortInfo& port : subject.info().inputs) knows = knows || port.name == "other_projectors";
  if (!knows) throw NotApplicable("it has no input 'other_projectors'");
  Inputs inputs = inputs_of({});
  const Made alone(subject, inputs);
  add_fragments(inputs, false);
  const Made listed(subject, inputs);
  for (int axis = 0; axis < 6; ++axis)
    expect(alone->value(off_truth(axis, 2)) == listed->value(off_truth(axis, 2)),
           "it leaves its own fragment out when that is in the list of all");
  Inputs beside = inputs_of({true, 1, 0, 1});
  add_fragments(beside, true);
  return off_the_truth(Made(subject, beside));
}

Inputs spoilt(const std::function<void(View&, EdgeMap&)>& change) { return inputs_of({}, change); }

std::vector<Trial> trials() {
  const auto fill = [](double value) {
    return spoilt([value](View& view, EdgeMap& map) {
      view.image.pixels = cv::Mat(kSize_px, kSize_px, CV_16U, cv::Scalar(value));
      map.pixels.clear();
    });
  };
  return {{"constant_image", [fill] { return fill(30000); }},
          {"black_image", [fill] { return fill(0); }},
          {"no_edges", [] { return spoilt([](View&, EdgeMap& map) { map.pixels.clear(); }); }},
          {"one_edge", [] { return spoilt([](View&, EdgeMap& map) { map.pixels.resize(1); }); }},
          {"all_masked",
           [] {
             return spoilt([](View& view, EdgeMap&) { view.mask = cv::Mat(kSize_px, kSize_px, CV_8U, cv::Scalar(0)); });
           }},
          {"not_a_number",
           [] {
             return spoilt([](View& view, EdgeMap&) {
               cv::Mat pixels;
               view.image.pixels.convertTo(pixels, CV_32F);
               pixels(cv::Rect(100, 90, 20, 30)).setTo(std::nan(""));
               view.image.pixels = pixels;
             });
           }},
          {"other_size", [] { return spoilt([](View& view, EdgeMap&) { view.camera.width_px = 50; }); }},
          {"broken_camera",
           [] { return spoilt([](View& view, EdgeMap&) { view.camera.intrinsics(0, 0) = std::nan(""); }); }},
          {"no_views", [] {
             Inputs inputs = inputs_of({});
             for (const char* port : {"views", "edges"}) {
               inputs.at(port).items.clear();
               inputs.at(port).names.clear();
             }
             return inputs;
           }}};
}

Suite similarity_suite() {
  Suite suite;
  suite.sample = [] { return inputs_of({}); };
  suite.validate = validate;
  suite.trials = trials();
  const auto add = [&](const char* name, const std::string& what, double limit, const char* unit,
                       std::function<double(const Subject&)> measure) {
    suite.accuracy.push_back({{name, what, limit, unit}, std::move(measure)});
  };
  add("truth", "poses 2 to 5 mm and degrees from the truth that cost no more than the true pose", 0, "%",
      better_than_truth_percent);
  add("six_axes", "steps away from the truth along each axis, up to 6 mm or degrees, in which the cost does not rise",
      15, "%", steps_down_percent);
  add("minimum", "mean distance between the truth and the minimum along each axis", 0.5, "mm or degrees",
      [](const Subject& subject) { return off_the_truth(made(subject)); });
  add("gain", "change of the cost if gain and offset of the line integrals change, in percent of its range", 5, "%",
      gain_percent);
  add("mask", "change of the cost if masked pixels change, in percent of its range", 2, "%", mask_percent);
  add("any_threads", "values that differ with 1, 2 and 7 threads", 0, "values", differing_values);
  add("coarse_level",
      "at a coarse level: directions of the six axes in which a pose 5 mm or degrees off costs no more than the truth",
      10, "%", coarse_level_off);
  add("nothing_seen", "poses out of view or behind the source that cost no more than a pose 1 mm from the truth", 0,
      "poses", nothing_seen);
  add("slope", "difference between the cost's derivatives and finite differences", 10, "%", slope_percent);
  add("beside_another",
      "distance between the truth and the minimum if the images show another fragment with a known pose", 0.5,
      "mm or degrees", off_beside_another);
  for (const Check& check : silence_checks()) suite.accuracy.push_back(check);
  return suite;
}

}  // namespace
}  // namespace marrow::conformance

MARROW_PLUGIN(plugin) { plugin.suite("similarity", marrow::conformance::similarity_suite()); }
