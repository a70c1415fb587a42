// SPDX-License-Identifier: Apache-2.0
// The requests of the page "Results".
#include "marrow/base/error.hpp"
#include "marrow/base/printable.hpp"
#include "report/cell_material.hpp"
#include "report/report.hpp"
#include "run_files.hpp"
#include "workbench/results.hpp"
#include "workbench/workbench.hpp"

namespace marrow::workbench {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// A report may come from somebody else and contains scripts. So it is shown as a page without origin: it reaches
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

/// A file beside a comparison's page. The page in its frame may load nothing; the workbench's own page reads it for it.
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
    const bool is_run = fs::exists(workbench.folder.inside(result) / "run.json");  // a comparison wrote its own report
    return json_answer({{"command", is_run ? command_in_folder(workbench, "show " + cli::shell_path(result)) : ""}});
  });
  server.get("/results/report.html", [&](const Request& request) { return report_answer(workbench, request); });
  server.get("/results/part.txt", [&](const Request& request) { return part_answer(workbench, request); });
  server.get("/results/picture.png", [&](const Request& request) { return picture_answer(workbench, request); });
}

}  // namespace marrow::workbench
