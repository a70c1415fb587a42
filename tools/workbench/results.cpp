// SPDX-License-Identifier: Apache-2.0
#include "workbench/results.hpp"

#include <algorithm>

#include "difference/findings.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/json_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/base/text_file.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"
#include "marrow/runtime/run/verdict_json.hpp"
#include "report/report.hpp"
#include "run_files.hpp"

namespace fs = std::filesystem;

namespace marrow::workbench {
namespace {

using nlohmann::json;

constexpr std::size_t kMostRuns = 500;

/// When the file was written, as UTC: for records that do not say when they were made.
std::string time_of(const fs::path& file) {
  std::error_code error;
  const auto written = fs::last_write_time(file, error);
  if (error) return "";
  const auto clock = std::chrono::file_clock::to_sys(written);
  const std::time_t seconds =
      std::chrono::system_clock::to_time_t(std::chrono::time_point_cast<std::chrono::system_clock::duration>(clock));
  std::tm utc{};
  gmtime_r(&seconds, &utc);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc);
  return text;
}

json run_row(const fs::path& folder) {
  const json record = cli::read_record(folder);
  json verdicts = json::array();
  for (const NamedVerdict& one : verdicts_in(record)) verdicts.push_back(json_of(one));
  const std::string finished = record.value("finished", "");
  return {{"kind", "run"},
          {"name", record.value("pipeline", "")},
          {"when", finished.empty() ? time_of(folder / "run.json") : finished},
          {"status", record.value("status", "")},
          {"seconds", record.value("seconds", 0.0)},
          {"verdicts", verdicts},
          {"figures", cli::figures_of(folder, record)}};
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
          {"when", time_of(folder / "comparison.json")},
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
      row = {{"kind", "run"}, {"name", ""}, {"when", time_of(folder)}, {"fault", printable_lines(error.what())}};
    }
    row["folder"] = path;
    row["has_report"] = cli::file_of_run(folder, "report.html").has_value();
    rows.push_back(std::move(row));
  }
}

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

}  // namespace

json list_results(const OpenedFolder& folder) {
  const json contents = folder.contents();
  json rows = json::array();
  add_rows(rows, folder, contents["comparisons"], comparison_row);
  add_rows(rows, folder, contents["runs"], run_row);
  std::stable_sort(rows.begin(), rows.end(), [](const json& a, const json& b) { return a["when"] > b["when"]; });
  return rows;
}

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
          {"pictures", pictures}};
}

fs::path report_of(const OpenedFolder& opened, const std::string& result) {
  const fs::path folder = opened.inside(result);
  if (const auto file = cli::file_of_run(folder, "report.html")) return *file;
  std::error_code error;
  if (fs::exists(folder / "comparison.json", error))
    throw Error("this comparison has no report.html; continue it by: marrow compare");
  cli::refuse_outside(folder, "report.html");
  return cli::write_run_page(folder);
}

}  // namespace marrow::workbench
