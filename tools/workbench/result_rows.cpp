// SPDX-License-Identifier: Apache-2.0
#include "workbench/result_rows.hpp"

#include <algorithm>

#include "difference/run_record.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/json_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/base/text_file.hpp"
#include "marrow/runtime/run/verdict_json.hpp"
#include "report/report.hpp"
#include "run_files.hpp"
#include "workbench/file_time.hpp"

namespace marrow::workbench {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

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

}  // namespace

json list_results(const OpenedFolder& folder) {
  const json contents = folder.contents();
  json rows = json::array();
  add_rows(rows, folder, contents["comparisons"], comparison_row);
  add_rows(rows, folder, contents["runs"], run_row);
  std::stable_sort(rows.begin(), rows.end(), [](const json& a, const json& b) { return a["when"] > b["when"]; });
  add_what_was_given(rows, folder);
  return rows;
}

}  // namespace marrow::workbench
