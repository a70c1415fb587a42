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

json pipeline_graph(const Experiment& experiment, const compare::CellRunner& runner) {
  const fs::path place = runner.case_place(0);
  const auto of_variant = [&](std::size_t v) {
    return runner.pipeline_of({v, 0, 0}, place, compare::CellRunner::Depth::pictures);
  };
  std::vector<std::pair<std::string, Pipeline>> others;
  for (std::size_t v = 0; v < experiment.variants.size(); ++v)
    if (v != experiment.baseline) others.emplace_back(experiment.variants[v].name, of_variant(v));
  return graph_of(of_variant(experiment.baseline), others);
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
  data["graph"] = pipeline_graph(experiment, runner);
  json record = json::object();
  try {
    if (!shown.empty()) record = read_record(runner.pictures_of(shown.front()));
  } catch (const Error&) {  // the report is written without it
  }
  data["marrow"] = record.value("marrow", "");
  data["experiment"]["machine"] = machine_of(record);
  data["experiment"]["finished"] = record.value("finished", "");
  data["experiment"]["plugins"] = plugins_of(record);
  add_cell_materials(data, runner, shown, folder, std::size_t(1e6 * request.page_mb));
  write_page(data, folder / "report.html");
  remove_other_parts(data, folder);
}

}  // namespace marrow::cli
