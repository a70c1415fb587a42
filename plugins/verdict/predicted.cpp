// SPDX-License-Identifier: Apache-2.0
// Judges a pose by what its registration says about it: the predicted covariance and the warnings. It draws errors from
// the normal distribution with this covariance, and counts those that are off.
#include <algorithm>
#include <cstdio>
#include <marrow/plugin.hpp>

#include "spread.hpp"

namespace {

using marrow::Judgement;
using marrow::Verdict;
using marrow::verdicts::Spread;

struct Options {
  double doubtful_above = 0.05;
  double wrong_above = 0.5;
};

/// With one decimal.
std::string shown(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.1f", value);
  return text;
}

/// What makes the pose uncertain, the weightier first, each with what would settle it.
void explain(const Spread& spread, Verdict& verdict) {
  const bool is_axial_first = spread.off_axial >= spread.off_mm;
  for (const bool is_axial : {is_axial_first, !is_axial_first}) {
    const bool is_second = is_axial != is_axial_first;
    if (is_second && (is_axial ? spread.off_axial : spread.off_mm) == 0) break;
    if (is_axial) {
      verdict.reasons.emplace_back("the rotation about the long axis is known to " + shown(spread.axial_deg) +
                                   " degrees only");
      verdict.remedies.emplace_back("a third view, or a landmark off the long axis");
    } else {
      verdict.reasons.emplace_back("the bone's surface is known to " + shown(spread.mtre_mm) + " mm only");
      verdict.remedies.emplace_back("a third view, from a direction between the others");
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
  if (!pose.covariance->allFinite()) {
    verdict.judgement = Judgement::wrong;
    verdict.failure_probability = 1;
    verdict.reasons.emplace_back("the images do not determine the pose in every direction");
    verdict.remedies.emplace_back("a third view, or a landmark");
    return;
  }
  const Spread spread = marrow::verdicts::spread_of(pose, mesh);
  verdict.failure_probability = double(spread.off) / Spread::kDraws;
  verdict.judgement = verdict.failure_probability > options.wrong_above      ? Judgement::wrong
                      : verdict.failure_probability > options.doubtful_above ? Judgement::doubtful
                                                                             : Judgement::trusted;
  verdict.figures = {{"predicted_mtre_mm", spread.mtre_mm, "mm"}, {"predicted_axial_deg", spread.axial_deg, "deg"}};
  if (verdict.judgement != Judgement::trusted) return explain(spread, verdict);
  verdict.reasons.emplace_back("the bone's surface is known to " + shown(spread.mtre_mm) +
                               " mm, and the rotation about the long axis to " + shown(spread.axial_deg) + " degrees");
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

Verdict predicted(const marrow::Pose& pose, const marrow::Mesh& mesh, const Options& options) {
  marrow::check_rigid(pose.world_from_model, "pose");
  Verdict verdict;
  judge_by_deviations(pose, mesh, options, verdict);
  judge_by_warnings(pose, verdict);
  return verdict;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("verdict.predicted", predicted)
      .summary("Judges a pose by its predicted deviations and its warnings alone")
      .in("pose", "pose to judge, with its predicted covariance")
      .in("mesh", "surface of the bone; 200 points spread over it are the targets of the mTRE")
      .out("verdict",
           "probability that the mTRE is above 2 mm or the rotation about the long axis off by more than 5 degrees, "
           "from 10000 errors drawn with the predicted covariance; not known for a pose without one")
      .option("doubtful_above", &Options::doubtful_above, "a pose is doubtful above this probability",
              marrow::at_least(0), marrow::at_most(1))
      .option("wrong_above", &Options::wrong_above, "a pose is wrong above this probability", marrow::at_least(0),
              marrow::at_most(1))
      .relation(marrow::below("doubtful_above", "wrong_above"));
}
