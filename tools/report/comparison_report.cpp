// SPDX-License-Identifier: Apache-2.0
#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/text_file.hpp"
#include "report/cell_material.hpp"
#include "report/report.hpp"
#include "run_files.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;
using compare::CellRow;
using compare::Experiment;
using nlohmann::json;

std::string starts_sentence(const Experiment& experiment) {
  if (!experiment.protocol) return "Each run starts where its pipeline starts.";
  const compare::StartProtocol& protocol = *experiment.protocol;
  const std::string text = formatted(
      "{} starts a case, drawn with seed {}: rotated by an angle uniform in 0 to {:g} degrees about a "
      "direction uniform on the sphere through the "
      "fragment's centroid, and shifted by 0 to {:g} mm, uniform, in a direction uniform on the sphere.",
      protocol.count, static_cast<unsigned long long>(protocol.seed), protocol.rotation_deg, protocol.translation_mm);
  if (!(protocol.distance_mm > 0)) return text;
  const std::string scaled =
      formatted(" Each displacement is scaled until the surface has moved by a mean distance uniform in 0 to {:g} mm.",
                protocol.distance_mm);
  return text + scaled;
}

std::string success_sentence(const Experiment& experiment, const std::vector<std::string>& units) {
  std::string limits;
  for (std::size_t m = 0; m < experiment.metrics.size(); ++m)
    if (const compare::MetricChoice& metric = experiment.metrics[m]; metric.limit) {
      const std::string limit = (metric.higher_is_better() ? " above " : " below ") + short_number(*metric.limit, 6);
      limits += (limits.empty() ? "" : " and ") + metric.label + limit + (units[m].empty() ? "" : " " + units[m]);
    }
  return limits.empty() ? "The experiment sets no limits, so no run is a success or a miss."
                        : "A run is a success with " + limits + "; a failed run is not.";
}

/// The pipelines of the variants on the first case, from the first start.
using OfVariants = std::vector<std::pair<std::string, Pipeline>>;

OfVariants pipelines_of(const Experiment& experiment, const compare::CellRunner& runner) {
  OfVariants pipelines;
  for (std::size_t v = 0; v < experiment.variants.size(); ++v)
    pipelines.emplace_back(experiment.variants[v].name,
                           runner.pipeline_of({v, 0, 0}, runner.case_place(0), compare::CellRunner::Depth::pictures));
  return pipelines;
}

std::vector<NamedRecipe> recipes_of(const OfVariants& pipelines, const compare::CellRunner& runner) {
  std::vector<NamedRecipe> recipes;
  for (std::size_t v = 0; v < pipelines.size(); ++v)
    recipes.push_back({pipelines[v].first, runner.recipe_of({v, 0, 0}, pipelines[v].second).text()});
  return recipes;
}

json pipeline_graph(const Experiment& experiment, OfVariants others) {
  const Pipeline baseline = std::move(others[experiment.baseline].second);
  others.erase(others.begin() + std::ptrdiff_t(experiment.baseline));
  return graph_of(baseline, others);
}

std::string command_of(const Experiment& experiment, const CompareRequest& request) {
  std::string command = "marrow compare " + shell_path(experiment.file);
  if (!request.folder.empty()) command += " --out " + shell_path(request.folder);
  return command;
}

}  // namespace

void write_report(const Experiment& experiment, const std::vector<CellRow>& rows, const Answer& answer,
                  const compare::CellRunner& runner, const std::vector<compare::CellIndex>& shown,
                  const CompareRequest& request, const fs::path& folder) {
  const json answers = answer_json(experiment, answer);
  json data = {{"format", 1}, {"kind", "comparison"}, {"metrics", answers["metrics"]}};
  data["experiment"] = {{"name", experiment.name},
                        {"help", experiment.help},
                        {"file", experiment.file.string()},
                        {"text", experiment.text},
                        {"pipeline_text", text_if_readable(experiment.pipeline)},
                        {"seed", 1},
                        {"command", command_of(experiment, request)},
                        {"folder", folder.string()},
                        {"starts_protocol", starts_sentence(experiment)},
                        {"success_rule", success_sentence(experiment, answer.units)},
                        {"time_rule", answer.times}};
  if (!request.folder.empty()) data["experiment"]["out"] = request.folder.string();
  for (std::size_t v = 0; v < experiment.variants.size(); ++v) {
    json options = json::object();
    for (const Override& one : experiment.variants[v].overrides) options[one.key] = one.value;
    data["variants"].push_back(
        {{"name", experiment.variants[v].name}, {"is_baseline", v == experiment.baseline}, {"options", options}});
  }
  for (const auto& one : experiment.cases) data["cases"].push_back(one.name);
  for (const auto& start : experiment.starts) data["starts"].push_back(start.name);
  data["summary"] = answers["variants"];
  data["comparisons"] = answers["comparisons"];
  for (const char* part : {"all_pairs", "rankings", "effects", "curves", "tuning", "initial_error"})
    if (answers.contains(part)) data[part] = answers[part];

  data["cell_table"] = cell_table(experiment, rows);
  OfVariants pipelines = pipelines_of(experiment, runner);
  const std::vector<NamedRecipe> recipes = recipes_of(pipelines, runner);
  data["graph"] = pipeline_graph(experiment, std::move(pipelines));
  json record = json::object();
  try {
    if (!shown.empty()) record = read_record(runner.pictures_of(shown.front()));
  } catch (const Error&) {  // the report is written without it
  }
  data["marrow"] = record.value("marrow", "");
  data["experiment"]["machine"] = machine_of(record);
  data["experiment"]["finished"] = record.value("finished", "");
  data["experiment"]["plugins"] = plugins_of(record);
  const std::size_t most_bytes = std::size_t(1e6 * request.page_mb), taken = recipes_element(recipes).size();
  add_cell_materials(data, runner, shown, folder, most_bytes - std::min(most_bytes, taken));
  write_page(data, recipes, folder / "report.html");
  remove_other_parts(data, folder);
}

}  // namespace marrow::cli
