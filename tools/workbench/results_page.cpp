// SPDX-License-Identifier: Apache-2.0
// The page "Results": lists the runs and comparisons of the opened folder, and compares two runs.
#include <algorithm>

#include "difference/difference.hpp"
#include "marrow/base/json_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"
#include "marrow/runtime/run/verdicts.hpp"
#include "report/report.hpp"
#include "run_files.hpp"
#include "workbench/workbench.hpp"

namespace marrow::workbench {
namespace {

using nlohmann::json;

// The runs and comparisons of the opened folder, as the list of the page "Results" shows them.

namespace fs = std::filesystem;

constexpr std::size_t kMostRuns = 500;
constexpr std::size_t kMostDescribed = 100;  // runs whose options are read: a tenth of a second for ten of them

/// What a run was given, by name: options as node.option, and what nodes use. The case has a column of its own.
using Given = std::map<std::string, std::string>;

Given given_to(const cli::RunRecord& run) {
  Given given;
  for (const cli::RecordedNode& node : run.nodes) {
    given[node.id + " uses"] = node.uses;
    for (const auto& [option, value] : node.options)
      if (node.uses != "read.case" || option != "path") given[node.id + "." + option] = value;
  }
  return given;
}

/// The folder of the case that a run reads, relative to the opened one; as it is written if it lies elsewhere.
std::string case_of(const cli::RunRecord& run, const OpenedFolder& opened) {
  for (const cli::RecordedNode& node : run.nodes) {
    const auto path = node.options.find("path");
    if (node.uses != "read.case" || path == node.options.end()) continue;
    const fs::path place = fs::path(path->second).lexically_normal();
    const std::string relative = opened.relative(place.has_filename() ? place : place.parent_path());
    return place.is_relative() || relative.empty() || relative.starts_with("..") ? path->second : relative;
  }
  return "";
}

json changes_between(const Given& before, const Given& now) {
  json changes = json::array();
  for (const auto& [what, value] : now)
    if (const auto found = before.find(what); found != before.end() && found->second != value)
      changes.push_back({{"what", what}, {"before", found->second}, {"now", value}});
  return changes;
}

/// Adds `case` and `changes` to the rows of runs, which are sorted by time.
void add_what_was_given(json& rows, const OpenedFolder& opened) {
  std::map<std::string, Given> before;  // by the pipeline's name
  const std::size_t described = std::min(rows.size(), kMostDescribed);
  for (std::size_t i = described; i-- > 0;) {  // the oldest first
    json& row = rows[i];
    if (row["kind"] != "run" || row.contains("fault")) continue;
    try {
      const cli::RunRecord run = cli::read_run(opened.inside(row["folder"].get<std::string>()));
      row["case"] = case_of(run, opened);
      Given given = given_to(run);
      const auto known = before.find(run.pipeline);
      if (known != before.end()) row["changes"] = changes_between(known->second, given);
      before[run.pipeline] = std::move(given);
    } catch (const std::exception&) {  // a record of an older version: the row shows the rest
    }
  }
}

json run_row(const fs::path& folder) {
  const json record = cli::read_record(folder);
  json verdicts = json::array();
  for (const NamedVerdict& one : verdicts_in(record)) verdicts.push_back(json_of(one));
  const std::string finished = record.value("finished", "");
  return {{"kind", "run"},
          {"name", record.value("pipeline", "")},
          {"when", finished.empty() ? time_of_file(folder / "run.json") : finished},
          {"status", record.value("status", "")},
          {"seconds", record.value("seconds", 0.0)},
          {"verdicts", verdicts},
          {"figures", cli::figures_of(folder, record)},
          {"case", ""},
          {"changes", nullptr}};
}

json comparison_row(const fs::path& folder) {
  if (cli::leads_outside(folder, "comparison.json")) throw Error("its comparison.json is a link that leads elsewhere");
  const json record = parse_json(read_text_file(folder / "comparison.json", kMostRecordBytes), "comparison.json");
  if (!record.is_object()) throw Error("its comparison.json holds no object");
  json sentences = json::array();
  for (const json& one : record.value("comparisons", json::array()))
    if (one.is_object()) sentences.push_back(one.value("sentence", ""));
  return {{"kind", "comparison"},
          {"name", record.value("experiment", "")},
          {"when", time_of_file(folder / "comparison.json")},
          {"status", "done"},
          {"verdicts", json::array()},
          {"sentences", sentences},
          {"figures", json::array()}};
}

void add_rows(json& rows, const OpenedFolder& opened, const json& paths, json (*row_of)(const fs::path&)) {
  for (const json& path : paths) {
    if (rows.size() >= kMostRuns) return;
    json row;
    const fs::path folder = opened.inside(path.get<std::string>());
    try {
      row = row_of(folder);
    } catch (const std::exception& error) {
      row = {{"kind", "run"}, {"name", ""}, {"when", time_of_file(folder)}, {"fault", printable_lines(error.what())}};
    }
    row["folder"] = path;
    row["has_report"] = cli::file_of_run(folder, "report.html").has_value();
    rows.push_back(std::move(row));
  }
}

/// [{folder, kind, name, when, status, seconds, verdicts, figures, has_report, case, changes, fault}], the newest
/// first. `kind` is run or comparison. `case`: of a run, relative to the opened folder; empty if it reads none.
/// `changes`:
/// [{what, before, now}], the options, nodes and inputs that differ from the run of the same pipeline before it; null
/// if there is no such run, or if it is not known. `fault` says why nothing else is known; otherwise it is missing.
json list_results(const OpenedFolder& folder) {
  const json contents = folder.contents();
  json rows = json::array();
  add_rows(rows, folder, contents["comparisons"], comparison_row);
  add_rows(rows, folder, contents["runs"], run_row);
  std::stable_sort(rows.begin(), rows.end(), [](const json& a, const json& b) { return a["when"] > b["when"]; });
  add_what_was_given(rows, folder);
  return rows;
}

namespace fs = std::filesystem;

/// The figures of both runs side by side: [{table, column, name, unit, before, now}].
json figures_side_by_side(const json& before, const json& now) {
  json rows = json::array();
  const auto add = [&](const json& tables, const char* side) {
    for (const json& table : tables)
      for (const json& row : table["rows"])
        for (std::size_t i = 0; i < row["values"].size(); ++i) {
          const json key = {{"table", table["name"]}, {"column", table["columns"][i]}, {"name", row["name"]}};
          auto same = std::find_if(rows.begin(), rows.end(), [&](const json& one) {
            return one["table"] == key["table"] && one["column"] == key["column"] && one["name"] == key["name"];
          });
          if (same == rows.end()) {
            rows.push_back(key);
            rows.back()["unit"] = row["unit"];
            rows.back()["before"] = rows.back()["now"] = nullptr;
            same = std::prev(rows.end());
          }
          (*same)[side] = row["values"][i];
        }
  };
  add(before, "before");
  add(now, "now");
  return rows;
}

std::vector<std::string> pictures_of(const fs::path& folder, const json& record) {
  std::vector<std::string> pictures;
  for (const json& output : record.value("outputs", json::array()))
    for (const json& file : output.value("files", json::array()))
      if (file.is_string() && fs::path(file.get<std::string>()).extension() == ".png" && cli::file_of_run(folder, file))
        pictures.push_back(file);
  return pictures;
}

json verdicts_of(const json& record) {
  json verdicts = json::array();
  for (const NamedVerdict& one : verdicts_in(record)) verdicts.push_back(json_of(one));
  return verdicts;
}

/// What `marrow diff` finds between two runs, and the pictures that both have: {findings, figures, pictures, verdicts:
/// {before, now}}. Throws Error if one of them is not a run.
json compare_results(const OpenedFolder& opened, const std::string& first, const std::string& second) {
  const fs::path before = opened.inside(first), now = opened.inside(second);
  cli::KnownValues values;
  const cli::Findings findings = cli::find_differences(cli::read_run(before), cli::read_run(now), values);
  const json before_record = cli::read_record(before), now_record = cli::read_record(now);
  const std::vector<std::string> others = pictures_of(now, now_record);
  json pictures = json::array();
  for (const std::string& picture : pictures_of(before, before_record))
    if (contains(others, picture)) pictures.push_back(picture);
  return {{"findings", cli::json_of(findings)},
          {"figures", figures_side_by_side(cli::figures_of(before, before_record), cli::figures_of(now, now_record))},
          {"pictures", pictures},
          {"verdicts", {{"before", verdicts_of(before_record)}, {"now", verdicts_of(now_record)}}}};
}

/// The file report.html of a run or comparison. A run without one gets one. Throws Error for a comparison without one.
fs::path report_of(const OpenedFolder& opened, const std::string& result) {
  const fs::path folder = opened.inside(result);
  if (const auto file = cli::file_of_run(folder, "report.html")) return *file;
  std::error_code error;
  if (fs::exists(folder / "comparison.json", error))
    throw Error("this comparison has no report.html; continue it by: marrow compare");
  cli::refuse_outside(folder, "report.html");
  return cli::write_run_page(folder);
}

/// A report may come from somebody else, and it contains scripts. So it is shown as a page without origin: it reaches
/// neither this server nor anything else, and can only draw.
constexpr const char* kReportPolicy =
    "sandbox allow-scripts; default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; "
    "img-src data: blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'self'";

/// The name of a downloaded file, reduced to characters that a header may hold.
std::string download_name(const std::string& result) {
  std::string name;
  for (const char c : fs::path(result).filename().string())
    name += std::isalnum(static_cast<unsigned char>(c)) || c == '-' || c == '_' || c == '.' ? c : '_';
  return (name.empty() ? "report" : name) + ".html";
}

Answer report_answer(const Workbench& workbench, const Request& request) {
  const std::string& result = request.parameter("folder");
  Answer answer{read_text_file(report_of(workbench.folder, result), kMostRecordBytes), "text/html; charset=utf-8"};
  answer.headers = {{"Content-Security-Policy", kReportPolicy}};
  if (request.parameters.contains("download"))
    answer.headers.push_back({"Content-Disposition", "attachment; filename=\"" + download_name(result) + "\""});
  return answer;
}

Answer picture_answer(const Workbench& workbench, const Request& request) {
  const fs::path folder = workbench.folder.inside(request.parameter("folder"));
  const std::string& name = request.parameter("name");
  const auto file = cli::file_of_run(folder, name);
  if (!file || file->extension() != ".png") throw Error("the run has no picture " + in_quotes(printable(name)));
  return {read_text_file(*file, kMostRecordBytes), "image/png"};
}

/// A file beside a comparison's page. The page in its frame may load nothing, so the workbench's own page reads the
/// file.
Answer part_answer(const Workbench& workbench, const Request& request) {
  const fs::path folder = workbench.folder.inside(request.parameter("folder"));
  const std::string& name = request.parameter("file");
  const auto file = cli::is_part_name(name) ? cli::file_of_run(folder, "report/" + name) : std::nullopt;
  if (!file) throw Error("the report has no part " + in_quotes(printable(name)));
  return {read_text_file(*file, kMostRecordBytes), "text/plain; charset=utf-8"};
}

}  // namespace

void add_results_page(Server& server, Workbench& workbench) {
  server.get("/api/results", [&](const Request&) {
    return json_answer({{"results", list_results(workbench.folder)}, {"folder", workbench.folder.path().string()}});
  });
  server.get("/api/results/diff", [&](const Request& request) {
    const std::string &first = request.parameter("first"), &second = request.parameter("second");
    json answer = compare_results(workbench.folder, first, second);
    answer["command"] = command_in_folder(workbench, "diff " + cli::shell_path(first) + " " + cli::shell_path(second));
    return json_answer(answer);
  });
  server.post("/api/results/report", [&](const Request& request) {
    const std::string result = request.text("folder");
    report_of(workbench.folder, result);
    const bool is_run =
        fs::exists(workbench.folder.inside(result) / "run.json");  // a comparison has written its own report
    return json_answer({{"command", is_run ? command_in_folder(workbench, "show " + cli::shell_path(result)) : ""}});
  });
  server.get("/results/report.html", [&](const Request& request) { return report_answer(workbench, request); });
  server.get("/results/part.txt", [&](const Request& request) { return part_answer(workbench, request); });
  server.get("/results/picture.png", [&](const Request& request) { return picture_answer(workbench, request); });
}

}  // namespace marrow::workbench
