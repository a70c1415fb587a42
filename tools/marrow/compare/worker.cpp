// SPDX-License-Identifier: Apache-2.0
// A worker process of a comparison. It makes cases, says what is in them, and runs, times and draws cells.
#include <algorithm>

#include "command_options.hpp"
#include "compare/comparison.hpp"
#include "compare/pool.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/no_process.hpp"
#include "marrow/runtime/process/worker.hpp"
#include "report/report.hpp"

namespace marrow::cli {
namespace {

using compare::CellIndex;
using compare::CellRunner;
using compare::Experiment;
using nlohmann::json;

[[noreturn]] void refuse_job(const std::string& what) {
  throw Error(what + " changed while the comparison ran; run it again");
}

/// The requested cell. Cases and files may change between the reading of the experiment by the main process and by this
/// one. So a request has the cell's name and the key of everything that the cell depends on.
CellIndex cell_in(CellRunner& runner, const json& asked) {
  const std::string id = asked.at("cell");
  const auto cell = compare::cell_of(runner.experiment(), id);
  if (!cell || runner.key_of(*cell) != asked.at("key")) refuse_job("what cell " + id + " depends on");
  return *cell;
}

void make_case(CellRunner& runner, const json& asked) {
  const std::vector<compare::ExperimentCase>& cases = runner.experiment().cases;
  const std::string name = asked.at("case");
  const auto found = std::find_if(cases.begin(), cases.end(), [&](const auto& one) { return one.name == name; });
  const std::size_t index = std::size_t(found - cases.begin());
  if (found == cases.end() || runner.case_place(index).string() != bytes_of_json(asked.at("place")))
    refuse_job("what case '" + name + "' is made from");
  runner.case_folder(index);
}

/// Reports the current node of a run, and whether the run waits for another one.
std::function<void(const RunEvent&)> observer_of(WorkerReports& reports) {
  return [&reports](const RunEvent& event) {
    const std::string item = event.item.empty() ? "" : " (" + event.item + ")";
    if (event.kind == RunEvent::Kind::started || event.kind == RunEvent::Kind::waiting)
      reports.at("node '" + event.node + "'" + item);
    if (event.kind == RunEvent::Kind::waiting || event.kind == RunEvent::Kind::waited)
      reports.waiting(event.kind == RunEvent::Kind::waiting);
    if (event.kind == RunEvent::Kind::waiting && !event.text.empty()) reports.say({{"say", "waits long"}});
  };
}

/// The result of a task. If the system gave it no process, the reason instead: the cell itself did not fail.
json with_processes(const std::function<json()>& task) {
  const long before = calls_without_process();
  try {
    return task();
  } catch (const Error& error) {
    if (calls_without_process() == before) throw;
    return {{kNoProcess, error.what()}};
  }
}

/// The names of the items along an axis, before there are cells with keys.
json items_of(CellRunner& runner, const json& asked) {
  const std::string id = asked.at("cell");
  const auto cell = compare::cell_of(runner.experiment(), id);
  if (!cell) refuse_job("what cell " + id + " depends on");
  compare::NamedItem item;
  item.node = asked.at("node");
  item.output = asked.at("output");
  item.axis = asked.at("axis");
  return runner.items_of(*cell, item);
}

json run_cell(CellRunner& runner, const Store& store, const json& asked, WorkerReports& reports) {
  const long before = calls_without_process();
  const compare::CellRow row = runner.run(cell_in(runner, asked), observer_of(reports));
  say_complaint(store);
  if (!row.failed.empty() && calls_without_process() != before) throw Error(row.failed);
  return json::parse(compare::to_json(row));
}

int worker(const CompareRequest& request) {
  const Catalogue catalogue;
  Diagnostics diagnostics;
  Experiment experiment = compare::read_experiment(request.file, catalogue, diagnostics, request.more_cases);
  if (!diagnostics.empty()) throw Error("the experiment has faults:\n" + diagnostics.text());
  if (!request.tuned.empty() && !add_tuned(experiment, request.tuned)) refuse_job("what the experiment tunes");
  const Store store;
  CellRunner runner(experiment, catalogue, request.no_cache ? nullptr : &store, request.folder, request.threads,
                    request.file_limits);
  return serve_worker({
      {"case",
       [&](const json& asked, WorkerReports&) {
         return with_processes([&] {
           make_case(runner, asked);
           return json(true);
         });
       }},
      {"items",
       [&](const json& asked, WorkerReports&) { return with_processes([&] { return items_of(runner, asked); }); }},
      {"cell",
       [&](const json& asked, WorkerReports& reports) {
         return with_processes([&] { return run_cell(runner, store, asked, reports); });
       }},
      {"time",
       [&](const json& asked, WorkerReports&) {
         return with_processes([&] { return json(runner.time(cell_in(runner, asked))); });
       }},
      {"draw",
       [&](const json& asked, WorkerReports& reports) {
         return with_processes([&] {
           const CellIndex cell = cell_in(runner, asked);
           if (runner.draw(cell, observer_of(reports))) ReportMaterial::prepare(runner.pictures_of(cell));
           return json(true);
         });
       }},
  });
}

}  // namespace

void add_worker(CLI::App& app, int& code) {
  const auto request = std::make_shared<CompareRequest>();
  CLI::App* command = app.add_subcommand("worker", "take cells from the standard input; started by compare");
  command->group("");
  add_experiment_arguments(command, *request);
  command->add_option("--tuned", request->tuned, "name of the tuned variant that the experiment has");
  command->callback([request, &code] { code = worker(*request); });
}

}  // namespace marrow::cli
