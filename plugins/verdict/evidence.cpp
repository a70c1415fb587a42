// SPDX-License-Identifier: Apache-2.0
// Judges a pose by evidence of many kinds: its cost against that of other poses, other minima, what each view alone
// prefers, where the outline lies on the images' edges, whether contour and grey values agree, and the predicted
// deviations. The failure model, which tools/studies/fit_verdict fits to poses whose errors are known, turns these
// figures into the probability that the pose is off.
#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "judged.hpp"
#include "marrow/toolbox/files/yaml_values.hpp"
#include "marrow/toolbox/search/search.hpp"
#include "marrow/verdict/spread.hpp"

namespace {

using namespace marrow;
using namespace verdict;

// The probability that a pose is off, from figures that speak for or against it.

/// A logistic regression on the figures' logarithms: log odds = bias + sum of weight * log(1 + figure / scale). No
/// weight is negative, so a larger figure never makes a pose more likely to be right.
struct FailureModel {
  struct Term {
    std::string figure;
    double scale = 1, weight = 0;
    double absent = 0;  ///< the figure's value where a registration does not give it
  };
  double bias = 0, doubtful_above = 0, wrong_above = 0.5;
  std::vector<Term> terms;

  /// How much a figure adds to the log odds.
  struct Contribution {
    const Term* term;
    const Metric* figure;  ///< null if it is absent
    double log_odds = 0;
  };
  std::vector<Contribution> contributions(const Evidence& evidence) const;
  double probability(const std::vector<Contribution>& contributions) const;
};

using files::YamlFile, files::YamlMap;

/// A number that must lie in a range; a value outside is a fault.
double number_within(const YamlMap& map, const std::string& key, double least, double most) {
  const auto value = map.number(key);
  if (!value) return least;
  if (!(*value >= least && *value <= most)) {
    const std::string text = formatted(": expected a number from {:g} to {:g}, got {:g}", least, most, *value);
    map.fault(key, key + text);
  }
  return *value;
}

FailureModel::Term term_from(YamlFile& file, const YAML::Node& node, std::size_t number) {
  const YamlMap map(file, node, formatted("term {}", number), {"figure", "scale", "weight", "absent"});
  FailureModel::Term term;
  term.figure = map.text("figure").value_or("");
  term.scale = number_within(map, "scale", 1e-6, 1e6);
  term.weight = number_within(map, "weight", 0, 1e6);
  term.absent = number_within(map, "absent", 0, 1e6);
  return term;
}

std::vector<FailureModel::Contribution> FailureModel::contributions(const Evidence& evidence) const {
  std::vector<Contribution> all;
  for (const Term& term : terms) {
    const auto found =
        std::find_if(evidence.begin(), evidence.end(), [&](const Metric& one) { return one.name == term.figure; });
    const Metric* const figure = found == evidence.end() ? nullptr : &*found;
    const double value = figure ? figure->value : term.absent;
    all.push_back({&term, figure, term.weight * std::log1p(std::max(0.0, value) / term.scale)});
  }
  return all;
}

double FailureModel::probability(const std::vector<Contribution>& contributions) const {
  double log_odds = bias;
  for (const Contribution& one : contributions) log_odds += one.log_odds;
  return 1 / (1 + std::exp(-log_odds));
}

/// Reads a file of tools/studies/fit_verdict. Throws Error with all of its faults.
FailureModel read_failure_model(const std::filesystem::path& path) {
  YamlFile file(path);
  const YamlMap map(file, file.root(), "failure model",
                    {"marrow-failure-model", "record", "bias", "doubtful_above", "wrong_above", "terms"});
  check_version(map, "marrow-failure-model");
  FailureModel model;
  map.text("record");
  model.bias = number_within(map, "bias", -1e6, 1e6);
  model.doubtful_above = number_within(map, "doubtful_above", 0, 1);
  model.wrong_above = number_within(map, "wrong_above", 0, 1);
  if (model.doubtful_above > model.wrong_above)
    map.fault("doubtful_above", "doubtful_above: expected at most wrong_above");
  if (const auto list = map.required("terms")) {
    if (!list->IsSequence() || list->size() == 0)
      map.fault("terms", "terms: expected a list of terms, each with figure, scale, weight and absent");
    else
      for (const auto& item : *list) model.terms.push_back(term_from(file, item, model.terms.size() + 1));
  }
  file.finish();
  return model;
}

struct Options {
  std::filesystem::path failure_model;
  std::filesystem::path contour_failure_model;
  int pixel_step = 4;
  double max_intersection_mm = 2;
};

/// The reason that a figure gives, with one place for its value, and what would settle the doubt.
struct Words {
  const char* figure;
  const char* reason;
  const char* remedy;
};
constexpr const char* kView = "another view, from a different direction";
constexpr const char* kAxial = "another view, or a landmark off the long axis";
constexpr const char* kLook = "a look at the overlay of each view: is this the bone, the side and the camera?";
constexpr const char* kStart = "a start nearer to the bone, by hand or by landmarks";
constexpr const char* kGiven =
    "a check of what was given: the bone, the side, which image belongs to which camera, the signs of its angles";
constexpr const char* kKnownCameras =
    "cameras that are known better, by a calibration; then give refine.cameras smaller rotation_deg, shift_mm, "
    "focal_percent and centre_px";
constexpr const char* kCameras = "a check of the cameras' calibration (camera.check), or refine.cameras";
constexpr Words kWords[] = {
    {"decoys_scatter", "the cost of random poses scatters by {:.2f} of what they lie above this pose", kStart},
    {"contour_decoys_scatter", "by contour, random poses scatter by {:.2f} of what they lie above this pose", kStart},
    {"best_decoy", "a random pose nearby explains the images {:.2f} times as well", kStart},
    {"contour_best_decoy", "by contour, a random pose nearby explains the images {:.2f} times as well", kStart},
    {"best_turned", "turned about its long axis, the bone explains the images {:.2f} times as well", kAxial},
    {"contour_best_turned", "turned about its long axis, the bone's contour fits {:.2f} times as well", kAxial},
    {"other_minimum", "a search from elsewhere ends at another pose that is {:.2f} times as good", kView},
    {"better_minimum", "a search from elsewhere ends at a pose that is better, by {:.2f} of the cost's rise", kStart},
    {"apart_mm", "the cost leads to a pose {:.2f} mm away", kStart},
    {"apart_deg", "the cost leads to a pose that is turned by {:.1f} degrees about the long axis", kStart},
    {"restarts_mm", "searches from starts nearby end {:.2f} mm apart", kView},
    {"restarts_deg", "searches from starts nearby end {:.1f} degrees apart about the long axis", kAxial},
    {"contour_apart_mm", "contour and grey values lead to poses {:.2f} mm apart", kLook},
    {"contour_apart_deg", "contour and grey values lead to poses {:.1f} degrees apart about the long axis", kAxial},
    {"view_pull_mm", "a view alone would move the bone by {:.2f} mm in its image", kCameras},
    {"view_pull_deg", "a view alone would turn the bone by {:.1f} degrees about its long axis", kCameras},
    {"contour_view_pull_mm", "the contour in a view alone would move the bone by {:.2f} mm in its image", kCameras},
    {"contour_view_pull_deg", "the contour in a view alone would turn the bone by {:.1f} degrees", kCameras},
    {"unexplained", "a share of {:.2f} of the outline has no edge in the worst view", kLook},
    {"outline_part_mm", "a part of the outline lies {:.2f} mm off its edges", kLook},
    {"outline_spread_mm", "the edges scatter by {:.2f} mm about the outline", kLook},
    {"predicted_mtre_mm", "the bone's surface is known to {:.2f} mm", kView},
    {"predicted_axial_deg", "the rotation about the long axis is known to {:.2f} degrees", kAxial},
    {"warnings", "warnings of the registration: {:.0f}", kLook},
};

std::string filled(const char* text, double value) { return formatted(fmt::runtime(text), value); }

void add(Evidence& all, const Evidence& more) { all.insert(all.end(), more.begin(), more.end()); }

void add_predicted(const Pose& pose, const Mesh& mesh, Evidence& evidence) {
  constexpr double kUnknown_mm = 50, kUnknown_deg = 90;
  if (!pose.covariance) return;
  verdict::Spread spread;
  spread.mtre_mm = kUnknown_mm, spread.axial_deg = kUnknown_deg;
  if (verdict::is_determined(pose)) spread = verdict::spread_of(pose, mesh);
  evidence.push_back({"predicted_mtre_mm", std::min(spread.mtre_mm, kUnknown_mm), "mm"});
  evidence.push_back({"predicted_axial_deg", std::min(spread.axial_deg, kUnknown_deg), "deg"});
}

/// The share of failures among the errors that the pose's own covariance predicts.
double predicted_failure(const Pose& pose, const verdict::Spread& spread) {
  if (!pose.covariance) return 0;
  if (!verdict::is_determined(pose)) return 1;
  return double(spread.off) / verdict::Spread::kDraws;
}

/// Explains what the pose's own covariance leaves open. After refine.cameras it includes the cameras.
void explain_predicted(const verdict::Spread& spread, double predicted, bool is_refined, Verdict& verdict) {
  if (is_refined) {
    verdict.reasons.push_back("with what is not known about the cameras, the bone's surface is known to " +
                              filled("{:.1f} mm, and the rotation about the long axis to ", spread.mtre_mm) +
                              filled("{:.1f} degrees", spread.axial_deg));
    verdict.remedies.emplace_back(kKnownCameras);
  } else {
    verdict.reasons.push_back(
        filled("the predicted deviations allow a failure with a probability of {:.2f}", predicted));
    verdict.remedies.emplace_back(kCameras);
  }
}

constexpr double kSpacing_px = 4, kReach_px = 16;

/// The cost at the level at which poses are judged.
std::shared_ptr<const Cost> compared(const Cost& cost, const Options& options) {
  return cost.at_level({kSpacing_px, kReach_px, options.pixel_step});
}

/// The verdict on a pose about which the images say nothing. It needs no failure model.
Verdict of_nothing(const std::string& why) {
  Verdict verdict;
  verdict.judgement = Judgement::wrong;
  verdict.failure_probability = 1;
  verdict.reasons = {"the images say nothing about this pose: " + why};
  verdict.remedies = {kStart, kGiven};
  return verdict;
}

Evidence gather(const Judged& judged, const Pose* contour_pose, const Pose& searched, const Cost& cost,
                const Cost* contour_cost, const List<View>& views, const List<EdgeMap>* edges,
                const OutlineProjector* projector, const Mesh& mesh, const Options& options, const Context& context) {
  const auto fine = compared(cost, options);
  const auto coarse = cost.at_level({2 * kSpacing_px, 2 * kReach_px, 2 * options.pixel_step});
  Evidence evidence, of_views, of_contour, of_outline;
  std::optional<verdict::Apart> apart;
  if (contour_pose)
    apart = {judged.off_mm(contour_pose->world_from_model), judged.axial_deg(contour_pose->world_from_model)};
  tbb::parallel_invoke(
      [&] {
        context.progress(0, "the cost of other poses");
        evidence = verdict::landscape(judged, *fine, "");
        context.progress(0.3, "other minima");
        add(evidence, verdict::other_minima(judged, *coarse, *fine));
      },
      [&] { of_views = verdict::views_alone(judged, *fine, views, ""); },
      [&] {
        if (!contour_cost) return;
        const auto contour = contour_cost->at_level({kSpacing_px, kReach_px, 0});
        of_contour = verdict::landscape(judged, *contour, "contour_");
        add(of_contour, verdict::views_alone(judged, *contour, views, "contour_"));
      },
      [&] {
        if (contour_cost) apart = verdict::second_cost(judged, *contour_cost);
      },
      [&] {
        if (projector && edges) of_outline = verdict::outline_on_edges(judged, *projector, views, *edges);
      });
  for (const Evidence* more : {&of_views, &of_contour, &of_outline}) add(evidence, *more);
  if (apart) {
    evidence.push_back({"contour_apart_mm", apart->mm, "mm"});
    evidence.push_back({"contour_apart_deg", apart->deg, "deg"});
  }
  add_predicted(searched, mesh, evidence);
  evidence.push_back({"warnings", double(judged.pose.warnings.size()), ""});
  return evidence;
}

const Words* words_of(const std::string& figure) {
  const auto found =
      std::find_if(std::begin(kWords), std::end(kWords), [&](const Words& words) { return figure == words.figure; });
  return found == std::end(kWords) ? nullptr : &*found;
}

/// A pose is doubtful if a cost leads away from it as far as a failure, whatever the model says.
void doubt_what_a_cost_denies(const Evidence& figures, Verdict& verdict) {
  for (const char* by : {"", "contour_"})
    for (const Metric& figure : figures) {
      const bool is_far = (figure.name == std::string(by) + "apart_mm" && figure.value > kMostError_mm) ||
                          (figure.name == std::string(by) + "apart_deg" && figure.value > kMostAxialError_deg);
      if (!is_far) continue;
      verdict.judgement = std::max(verdict.judgement, Judgement::doubtful);
      verdict.reasons.push_back(filled(words_of(figure.name)->reason, figure.value) + "; both cannot be right");
      verdict.remedies.emplace_back(words_of(figure.name)->remedy);
    }
}

/// Adds the figures that speak most against the pose, each with what would settle it.
void explain(std::vector<FailureModel::Contribution> contributions, Verdict& verdict) {
  constexpr std::size_t kMostReasons = 3;
  std::stable_sort(contributions.begin(), contributions.end(),
                   [](const auto& a, const auto& b) { return a.log_odds > b.log_odds; });
  for (const FailureModel::Contribution& one : contributions) {
    if (verdict.reasons.size() == kMostReasons || !(one.log_odds > 0)) break;
    if (!one.figure) continue;
    const Words* words = words_of(one.figure->name);
    if (!words) continue;
    verdict.reasons.push_back(filled(words->reason, one.figure->value));
    const bool is_new =
        std::find(verdict.remedies.begin(), verdict.remedies.end(), words->remedy) == verdict.remedies.end();
    if (verdict.judgement != Judgement::trusted && is_new) verdict.remedies.emplace_back(words->remedy);
  }
}

/// Throws Error if the model names a figure that this node does not know.
void check_figures(const FailureModel& model, const std::filesystem::path& path) {
  for (const FailureModel::Term& term : model.terms)
    if (!words_of(term.figure))
      throw Error(path.string() + ": there is no figure '" + term.figure +
                  "'; fit the model again with tools/studies/fit_verdict");
}

/// Another pose of the bone, found by another cost; null if there is none. It is only for pipelines without this cost:
/// it depends on where its own search began.
const Pose* other_pose(const Pose* contour_pose, const List<Pose>* stages) {
  return contour_pose ? contour_pose : stages ? stages->find("first") : nullptr;
}

Verdict judge(const Pose& pose, const Pose* contour_pose, const List<Pose>* stages, const Cost* grey_cost,
              const Cost* given_contour_cost, const Optimizer& optimizer, const List<View>& views,
              const List<EdgeMap>* edges, const OutlineProjector* projector, const Mesh& mesh, const List<Pose>* others,
              const List<SignedField>* other_bones, const Options& options, Context& context) {
  constexpr int kTargets = 100;
  check_pose(pose, "pose");
  if (!others != !other_bones) throw Error("others and other_bones belong together; wire both or none");
  if (!grey_cost && !given_contour_cost) throw Error("there is neither `cost` nor `contour_cost`; wire one of them");
  // Without grey values, the contour's cost is the one to judge by.
  const Cost& cost = grey_cost ? *grey_cost : *given_contour_cost;
  const Cost* contour_cost = grey_cost ? given_contour_cost : nullptr;
  const std::filesystem::path& file = grey_cost ? options.failure_model : options.contour_failure_model;
  FailureModel model;
  if (!file.empty()) {
    model = read_failure_model(file);
    check_figures(model, file);
  }
  Judged judged{pose, fragment_frame(mesh), geometry::targets_mm(pose.world_from_model, &mesh, nullptr, kTargets),
                &optimizer, &context};
  // A pose may have changed after its search, as refine.cameras does. Then its covariance includes what the images
  // cannot tell, which is no evidence against the search.
  const Pose& searched = stages && !stages->empty() ? (*stages)[stages->size() - 1] : pose;
  check_pose(searched, "the last pose of stages");
  Verdict verdict;
  const std::string why_nothing =
      search::nothing_compared(*compared(cost, options), pose.world_from_model, judged.frame);
  if (!why_nothing.empty()) return of_nothing(why_nothing);
  verdict.figures = gather(judged, other_pose(contour_pose, stages), searched, cost, contour_cost, views, edges,
                           projector, mesh, options, context);
  const double inside_mm = others ? verdict::intersection_mm(judged, mesh, *others, *other_bones) : 0;
  if (others) verdict.figures.push_back({"intersection_mm", inside_mm, "mm"});
  if (model.terms.empty()) {
    verdict.reasons.emplace_back("there is no failure model, so the figures are not judged");
    verdict.remedies.emplace_back("the option failure_model");
    return verdict;
  }
  const auto contributions = model.contributions(verdict.figures);
  const bool is_determined = verdict::is_determined(pose);
  const verdict::Spread spread = is_determined ? verdict::spread_of(pose, mesh) : verdict::Spread();
  const double predicted = predicted_failure(pose, spread);
  verdict.failure_probability = 1 - (1 - model.probability(contributions)) * (1 - predicted);
  verdict.judgement = verdict.failure_probability > model.wrong_above      ? Judgement::wrong
                      : verdict.failure_probability > model.doubtful_above ? Judgement::doubtful
                                                                           : Judgement::trusted;
  if (inside_mm > options.max_intersection_mm && verdict.judgement == Judgement::trusted) {
    verdict.judgement = Judgement::doubtful;
    verdict.reasons.push_back(filled("the bone reaches {:.1f} mm into another bone", inside_mm));
  }
  doubt_what_a_cost_denies(verdict.figures, verdict);
  if (verdict.judgement == Judgement::wrong) verdict.remedies.emplace_back(kGiven);
  if (predicted > model.doubtful_above)
    explain_predicted(spread, predicted, is_determined && &searched != &pose, verdict);
  explain(contributions, verdict);
  return verdict;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("verdict.evidence", judge)
      .summary("Judges a pose by evidence of many kinds, weighed by a failure model")
      .in("pose", "pose to judge")
      .in("contour_pose", "pose of the same bone, found by its contour; not used if contour_cost finds one itself")
      .in("stages",
          "poses of the search: the last one has the predicted deviations of the search, without those that come from "
          "the cameras (refine.cameras); 'first' takes the place of contour_pose",
          over("stage"))
      .in("cost", "cost whose minimum the pose is; if there is none, as without a CT, contour_cost is judged by alone")
      .in("contour_cost",
          "another cost of the same bone, such as that of the contour: where it leads from the pose, and how it "
          "changes")
      .in("optimizer", "minimiser of the cost")
      .in("views", "X-ray views", over("view"))
      .in("edges", "edge pixels of each view", over("view"))
      .in("projector", "draws the bone's outline")
      .in("model", "surface of the bone; it gives the axes, and 100 points as the targets of mTRE")
      .in("others", "poses of other bones, and maybe of this one", over("fragment"))
      .in("other_bones", "the bones of these poses", over("fragment"))
      .out("verdict", "the judgement, the probability that the pose is off, and all figures of the evidence")
      .option("failure_model", &Options::failure_model,
              "file of tools/studies/fit_verdict; none: the figures alone, to fit one, and the pose is doubtful")
      .option("contour_failure_model", &Options::contour_failure_model,
              "takes the place of failure_model where there is no cost, only contour_cost")
      .option("pixel_step", &Options::pixel_step,
              "for costs of grey values: only every n-th pixel is compared, and half as many pixels far from the pose",
              at_least(1), at_most(32), replaces({"cost.pixel_step"}))
      .option("max_intersection_mm", &Options::max_intersection_mm,
              "a pose is doubtful if the bone reaches deeper into one of the others", at_least(0));
}
