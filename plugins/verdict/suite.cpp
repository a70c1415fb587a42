// SPDX-License-Identifier: Apache-2.0
// Checks for verdicts on a bone that is known analytically: right poses, poses after mistakes, and poses whose own
// predicted deviations are large. Data are those of the kind; a verdict takes what it has ports for.
#include "suite.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>

#include "marrow/domain/verdict.hpp"
#include "marrow/runtime/node/types.hpp"
#include "scene.hpp"

namespace marrow::conformance {
namespace {

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

}  // namespace

Suite verdict_suite() {
  Suite suite{[] { return inputs_of({}); }, validate, trials(), {}, options};
  const auto add = [&](const char* name, const std::string& what, double limit, const char* unit,
                       std::function<double(const Subject&)> measure) {
    suite.accuracy.push_back({{name, what, limit, unit}, std::move(measure)});
  };
  add("mistakes_trusted",
      "of poses 5 mm off in depth or along the bone, 8 degrees about it, at half a turn, after swapped views and of "
      "the "
      "other side's bone: those called trusted",
      0, "%", mistakes_trusted_percent);
  add("right_wrong", "right poses called wrong", 0, "%",
      [](const Subject& subject) { return right_poses_percent(subject, Judgement::wrong); });
  add("right_not_trusted", "right poses called doubtful or wrong", 50, "%",
      [](const Subject& subject) { return right_poses_percent(subject, Judgement::doubtful); });
  add("unknown_trusted", "poses trusted although their own predicted deviations are large, infinite or 0", 0, "poses",
      unknown_poses_trusted);
  return suite;
}

}  // namespace marrow::conformance
