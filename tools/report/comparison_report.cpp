// SPDX-License-Identifier: Apache-2.0
// The rows of a comparison for its page, as data.js describes a cell_table.
#include <cstdlib>
#include <set>
#include <unordered_map>

#include "marrow/base/json_text.hpp"
#include "marrow/base/number_text.hpp"
#include "report/report.hpp"
#include "run_files.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;
using compare::CellIndex;
using compare::CellRow;
using compare::Experiment;
using nlohmann::json;

constexpr const char* kFolder = "report";

/// What is known of the cells of one case and start, and the pictures, meshes and scenes that they name.
struct CellsOfStart {
  std::size_t case_index = 0, start = 0;
  json cells = json::array();
  ReportMaterial material;
};

/// The bytes by which `data` grows if a place is added. Things that another place has added do not count.
std::size_t growth(const json& data, CellsOfStart& place) {
  std::size_t bytes = json_text(place.cells).size();
  for (const auto& [name, group] : place.material.groups())
    for (const auto& [id, thing] : group->items())
      if (!data.at(name).contains(id)) bytes += id.size() + 5 + json_text(thing).size();
  return bytes;
}

void enter(json& data, CellsOfStart place) {
  for (json& cell : place.cells) data["materials"].push_back(std::move(cell));
  for (const auto& [name, group] : place.material.groups()) data[name].update(*group);
}

std::vector<std::string> kinds_in(const json& cells) {
  std::vector<std::string> kinds;
  for (const char* kind : {"pictures", "scene", "convergence", "landscape"})
    if (std::any_of(cells.begin(), cells.end(),
                    [&](const json& cell) { return cell.contains(kind) && !cell[kind].empty(); }))
      kinds.push_back(kind);
  return kinds;
}

/// Writes a place as a file of `folder`, and returns how the page lists it.
json written_beside(CellsOfStart place, const fs::path& folder) {
  const std::vector<std::string> kinds = kinds_in(place.cells);
  json content = {{"materials", std::move(place.cells)}};
  for (const auto& [name, group] : place.material.groups()) content[name] = std::move(*group);
  const std::string text = json_text(content), name = hash_of(text).hex().substr(0, 16) + ".js";
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw Error("cannot make the folder " + folder.string() + ": " + error.message());
  write_text_file(folder / name, "Parts.take(\"" + name + "\",\n" + text + "\n);\n");
  return {{"case", place.case_index}, {"start", place.start}, {"file", name}, {"bytes", text.size()}, {"kinds", kinds}};
}

/// The next place among the shown cells from `at` on. Moves `at` behind it.
CellsOfStart next_place(const compare::CellRunner& runner, const std::vector<CellIndex>& shown, std::size_t& at) {
  CellsOfStart place{shown[at].case_index, shown[at].start, json::array(), {}};
  for (; at < shown.size() && shown[at].case_index == place.case_index && shown[at].start == place.start; ++at) {
    json cell = json::object();
    place.material.add_prepared(runner.pictures_of(shown[at]), cell);
    cell.update({{"variant", shown[at].variant}, {"case", place.case_index}, {"start", place.start}});
    place.cells.push_back(std::move(cell));
  }
  place.material.print_left_out();
  return place;
}

/// Enters the materials of the cells in `shown` into `data`, in this order, as long as the page has at most
/// `most_bytes`. Those of a case and start stay together. The others become files of FOLDER/report, which `data` lists
/// as parts. A file is named after its content. It holds a script, because a page from disk may load nothing else.
/// Besides the page, only one case and start is in memory at a time. Throws Error if a file cannot be written.
void add_cell_materials(json& data, const compare::CellRunner& runner, const std::vector<CellIndex>& shown,
                        const fs::path& folder, std::size_t most_bytes) {
  data["materials"] = data["parts"] = json::array();
  for (const char* name : {"pictures", "geometries", "scenes"}) data[name] = json::object();
  std::size_t bytes = page_bytes(data);
  for (std::size_t at = 0; at < shown.size();) {
    CellsOfStart place = next_place(runner, shown, at);
    const std::size_t more = growth(data, place);
    if (bytes + more <= most_bytes) {
      bytes += more;
      enter(data, std::move(place));
    } else {
      data["parts"].push_back(written_beside(std::move(place), folder / kFolder));
      bytes += json_text(data["parts"].back()).size() + 1;
    }
  }
}

/// Removes the files of FOLDER/report that `data` does not list: those of an earlier page. Other files stay.
void remove_other_parts(const json& data, const fs::path& folder) {
  std::set<std::string> listed;
  for (const json& part : data.at("parts")) listed.insert(part.at("file"));
  std::error_code error, ignored;
  std::vector<fs::path> others;
  for (fs::directory_iterator at(folder / kFolder, error), end; !error && at != end; at.increment(error))
    if (const std::string name = at->path().filename().string(); is_part_name(name) && !listed.contains(name))
      others.push_back(at->path());
  for (const fs::path& file : others) fs::remove(file, ignored);
  if (listed.empty()) fs::remove(folder / kFolder, ignored);  // fails if anything else is in it, which then stays
}

/// Enough digits to tell cells apart; the tables have all of them.
constexpr std::size_t kKeyDigits = 12;

/// With nine digits, like the tables for other programs: half as long as the exact number.
json rounded(const std::optional<double>& value) {
  if (!value) return {};
  return parsed_number(formatted("{:.9g}", *value)).value();
}

/// Texts that many cells share. Each is stored once.
class Texts {
 public:
  json place_of(const std::string& text) {
    if (text.empty()) return {};
    const auto [found, is_new] = places_.try_emplace(text, all_.size());
    if (is_new) all_.push_back(text);
    return found->second;
  }
  const std::vector<std::string>& all() const { return all_; }

 private:
  std::unordered_map<std::string, std::size_t> places_;
  std::vector<std::string> all_;
};

json row_of(const compare::Experiment& experiment, const compare::CellIndex& index, const CellRow& row, Texts& texts) {
  const bool is_done = row.failed.empty();
  int cached = 0;
  for (const auto& [name, calls] : row.nodes) cached += calls.made == 0 && calls.cached > 0;
  json values = {index.variant,
                 index.case_index,
                 index.start,
                 texts.place_of(is_done ? "done" : "failed"),
                 experiment.defines_success() ? json(row.is_success(experiment)) : json(),
                 row.tries,
                 rounded(row.initial_error),
                 rounded(row.seconds),
                 is_done ? json(row.evaluations) : json(),
                 cached,
                 texts.place_of(row.failed),
                 texts.place_of(row.absent),
                 texts.place_of(row.verdict ? name_of(*row.verdict) : ""),
                 row.verdict ? rounded(row.failure_probability) : json(),
                 row.key.empty() ? json() : json(row.key.substr(0, kKeyDigits))};
  for (const auto& value : row.values) values.push_back(is_done ? rounded(value) : json());
  return values;
}

/// All cells, as data.js describes a cell_table.
json cell_table(const compare::Experiment& experiment, const std::vector<CellRow>& rows) {
  const std::size_t starts = experiment.starts.size(), variants = experiment.variants.size();
  Texts texts;
  json table = json::array();
  for (std::size_t i = 0; i < rows.size(); ++i)  // in the order of the cells: by case, by start, by variant
    table.push_back(row_of(experiment, {i % variants, i / variants / starts, i / variants % starts}, rows[i], texts));
  return {{"fields",
           {"variant", "case", "start", "status", "success", "tries", "initial_error", "seconds", "evaluations",
            "cached_nodes", "reason", "absent", "verdict", "failure_probability", "key"}},
          {"rows", std::move(table)},
          {"texts", texts.all()}};
}

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

bool is_part_name(const std::string& name) {
  return name.size() == 19 && name.ends_with(".js") && name.find_first_not_of("0123456789abcdef") == 16;
}

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
