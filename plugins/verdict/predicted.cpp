// SPDX-License-Identifier: Apache-2.0
// Judges a pose by what its registration says about it: the predicted covariance and the warnings. It draws errors from
// the normal distribution with this covariance, and counts those that are off.
#include <algorithm>
#include <optional>
#include <string>

#include "marrow/verdict/spread.hpp"

namespace {

using marrow::formatted;
using marrow::Judgement;
using marrow::Verdict;
using marrow::verdict::Spread, marrow::verdict::about_the_bones_axes;

struct Options {
  double doubtful_above = 0.05;
  double wrong_above = 0.5;
  double contradicts_above = 1.8;
  double clear_times = 1.2;
  double beside_px = 3;
};

/// Adds the reasons why the pose is uncertain, the more important first, each with what would settle it.
void explain(const Spread& spread, Verdict& verdict) {
  const bool is_axial_first = spread.off_axial >= spread.off_mm;
  for (const bool is_axial : {is_axial_first, !is_axial_first}) {
    const bool is_second = is_axial != is_axial_first;
    if (is_second && (is_axial ? spread.off_axial : spread.off_mm) == 0) break;
    if (is_axial) {
      verdict.reasons.emplace_back(
          formatted("the rotation about the long axis is known to {:.1f} degrees only", spread.axial_deg));
      verdict.remedies.emplace_back("another view, or a landmark off the long axis");
    } else {
      verdict.reasons.emplace_back(formatted("the bone's surface is known to {:.1f} mm only", spread.mtre_mm));
      verdict.remedies.emplace_back("another view, from a different direction");
    }
  }
}

void judge_by_deviations(const marrow::Pose& pose, const marrow::Mesh& mesh, const Options& options, Verdict& verdict) {
  if (!pose.covariance) {
    verdict.judgement = Judgement::doubtful;
    verdict.reasons.emplace_back(
        "the registration predicts no deviations, so nothing says how far the pose may be off");
    verdict.remedies.emplace_back("a registration that predicts its deviations");
    return;
  }
  if (!marrow::verdict::is_determined(pose)) {
    const bool is_finite = pose.covariance->allFinite();
    verdict.judgement = Judgement::wrong;
    verdict.failure_probability = 1;
    verdict.reasons.emplace_back(is_finite ? "the predicted deviations are 0, so the registration compared nothing"
                                           : "the images do not determine the pose in every direction");
    verdict.remedies.emplace_back(is_finite
                                      ? "a start nearer to the bone, and a look at the masks and edges of each view"
                                      : "another view, or a landmark");
    return;
  }
  const Spread spread = marrow::verdict::spread_of(pose, mesh);
  verdict.failure_probability = double(spread.off) / Spread::kDraws;
  verdict.judgement = verdict.failure_probability > options.wrong_above      ? Judgement::wrong
                      : verdict.failure_probability > options.doubtful_above ? Judgement::doubtful
                                                                             : Judgement::trusted;
  verdict.figures = {{"predicted_mtre_mm", spread.mtre_mm, "mm"}, {"predicted_axial_deg", spread.axial_deg, "deg"}};
  if (verdict.judgement != Judgement::trusted) return explain(spread, verdict);
  verdict.reasons.emplace_back(
      formatted("the bone's surface is known to {:.1f} mm, and the rotation about the long axis to {:.1f} degrees",
                spread.mtre_mm, spread.axial_deg));
}

/// A registration that warns is at best doubtful.
void judge_by_warnings(const marrow::Pose& pose, Verdict& verdict) {
  if (pose.warnings.empty()) return;
  verdict.judgement = std::max(verdict.judgement, Judgement::doubtful);
  std::vector<std::string> reasons;
  for (const std::string& warning : pose.warnings) reasons.emplace_back("the registration warns: " + warning);
  verdict.reasons.insert(verdict.reasons.begin(), reasons.begin(), reasons.end());
  verdict.remedies.emplace_back("a look at the overlay of each view");
}

/// The rotation about the long axis between the prior and the pose found from images and prior, in standard deviations.
/// The pose lies between the two, so its difference from the prior has the variance of the prior minus that of the
/// pose; this is the same as comparing prior and images with the sum of their variances. Nothing if the images say
/// hardly more than the prior. Both covariances are about the bone's axes.
std::optional<double> deviations_of(double apart_rad, const marrow::Pose& pose, const marrow::Pose& prior) {
  constexpr double kLeastNews = 0.01;  // of the prior's variance
  const double of_prior = (*prior.covariance)(2, 2), news = of_prior - (*pose.covariance)(2, 2);
  if (!(news > kLeastNews * of_prior)) return std::nullopt;
  return apart_rad / std::sqrt(news);
}

/// A prior that the images contradict makes the pose doubtful: one of the two is wrong. Both are about the bone's axes.
void judge_by_prior(const marrow::Pose& pose, const marrow::Pose& prior, const Options& options, Verdict& verdict,
                    marrow::Context& context) {
  marrow::check_pose(prior, "the prior");
  if (!prior.covariance)
    throw marrow::Error("the prior has no covariance; take it from a node that predicts one, such as a fit of markers");
  if (!pose.covariance) return;
  const double apart_rad = std::abs(motion_between(prior.world_from_model, pose.world_from_model, pose.frame)[2]),
               apart_deg = marrow::degrees(apart_rad);
  verdict.figures.push_back({"prior_axial_deg", apart_deg, "deg"});
  const std::optional<double> deviations = deviations_of(apart_rad, pose, prior);
  if (!deviations) return;
  verdict.figures.push_back({"prior_axial_deviations", *deviations, ""});
  if (*deviations <= options.contradicts_above) return;
  verdict.judgement = std::max(verdict.judgement, Judgement::doubtful);
  verdict.reasons.insert(verdict.reasons.begin(),
                         formatted("the prior contradicts the images: they are {:.1f} degrees apart about the long "
                                   "axis, {:.1f} times the deviation expected of this difference",
                                   apart_deg, *deviations));
  verdict.remedies.emplace_back(
      "a look at the markers, if the prior comes from these: has the skin slid, or one moved?");
  context.warn(verdict.reasons.front());
}

/// A pose is doubtful at best if another one, which is farther off than a failure, has nearly its cost.
void judge_by_other(const marrow::Pose& pose, const marrow::Pose& other, const Options& options, Verdict& verdict) {
  constexpr double kSame_deg = 5;
  marrow::check_pose(other, "the other pose");
  const double apart_deg =
      marrow::degrees(marrow::geodesic_angle_rad(pose.world_from_model.rotation, other.world_from_model.rotation));
  const double times = pose.cost > 0 ? other.cost / pose.cost : 1;
  verdict.figures.push_back({"other_apart_deg", apart_deg, "deg"});
  verdict.figures.push_back({"other_cost_times", times, ""});
  if (apart_deg < kSame_deg || times >= options.clear_times) return;
  verdict.judgement = std::max(verdict.judgement, Judgement::doubtful);
  verdict.reasons.insert(verdict.reasons.begin(), formatted("another pose, {:.1f} degrees away, explains the images "
                                                            "nearly as well: its cost is {:.2f} times that of this one",
                                                            apart_deg, times));
  verdict.remedies.emplace_back(
      "another view, or a look at both overlays: which of the two can be, beside the other bones and parts?");
}

/// A pose is doubtful at best if in one of the views half of its outline lies far from all edges. Predicted deviations
/// describe one minimum of the cost, and a wrong one may be as narrow as the right one.
void judge_by_outline(const marrow::Metrics& distance, const Options& options, Verdict& verdict) {
  const std::string ending = "_median_px";
  const marrow::Metric* worst = nullptr;
  for (const marrow::Metric& figure : distance.items)
    if (figure.name.ends_with(ending) && (!worst || !(figure.value <= worst->value))) worst = &figure;
  if (!worst)
    throw marrow::Error(
        "the distance has no figure of a view, such as frontal_median_px; wire evaluate.outline_distance");
  verdict.figures.push_back({"outline_distance_px", worst->value, "px"});
  if (worst->value <= options.beside_px) return;  // not a number is beside
  verdict.judgement = std::max(verdict.judgement, Judgement::doubtful);
  verdict.reasons.insert(verdict.reasons.begin(),
                         formatted("view '{}': half of the outline lies {:.1f} pixels or more from the nearest edge",
                                   worst->name.substr(0, worst->name.size() - ending.size()), worst->value));
  verdict.remedies.emplace_back("a look at the overlay of this view, and a start nearer to the pose");
}

Verdict predicted(const marrow::Pose& pose, const marrow::Mesh& mesh, const marrow::Pose* prior,
                  const marrow::Pose* other, const marrow::Metrics* distance, const Options& options,
                  marrow::Context& context) {
  marrow::check_pose(pose, "pose");
  Verdict verdict;
  judge_by_deviations(pose, mesh, options, verdict);
  judge_by_warnings(pose, verdict);
  if (prior)
    judge_by_prior(about_the_bones_axes(pose, mesh), about_the_bones_axes(*prior, mesh), options, verdict, context);
  if (other) judge_by_other(pose, *other, options, verdict);
  if (distance) judge_by_outline(*distance, options, verdict);
  return verdict;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("verdict.predicted", predicted)
      .summary("Judges a pose by its predicted deviations and its warnings, and by what else is wired")
      .in("pose", "pose to judge, with its predicted covariance")
      .in("model", "surface of the bone; 200 points spread over it are the targets of the mTRE")
      .in("prior",
          "pose known from elsewhere, which the registration took into account: whether its rotation about the long "
          "axis agrees with the images")
      .in("other",
          "another pose with its cost, from the same cost, such as the mirror pose of an implant: a pose that this one "
          "nearly equals is doubtful")
      .in("distance",
          "figures of evaluate.outline_distance: a pose whose outline lies beside the edges of a view is doubtful")
      .out("verdict",
           "probability that the mTRE is above 2 mm or the rotation about the long axis off by more than 5 degrees, "
           "from 10000 errors drawn with the predicted covariance; not known for a pose without one")
      .option("doubtful_above", &Options::doubtful_above, "a pose is doubtful above this probability",
              marrow::at_least(0), marrow::at_most(1))
      .option("wrong_above", &Options::wrong_above, "a pose is wrong above this probability", marrow::at_least(0),
              marrow::at_most(1))
      .relation(marrow::below("doubtful_above", "wrong_above"))
      .option("contradicts_above", &Options::contradicts_above,
              "a prior whose rotation about the long axis is farther off than this many standard deviations "
              "contradicts the images: the pose is doubtful at best",
              marrow::at_least(0))
      .option("clear_times", &Options::clear_times,
              "the other pose must cost at least this many times what the pose costs; else the pose is doubtful",
              marrow::at_least(1))
      .option("beside_px", &Options::beside_px,
              "a pose is doubtful if the median distance between outline and edges is above this in one of the views",
              marrow::at_least(0));
}
