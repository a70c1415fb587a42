// SPDX-License-Identifier: Apache-2.0
// A worker process of a comparison: makes cases and runs, times and draws cells, which it is asked for by their indices.
#include "compare/comparison.hpp"
#include "marrow/domain/error.hpp"
#include "marrow/runtime/worker.hpp"
#include "report/report.hpp"

namespace marrow::cli {
namespace {

using compare::CellIndex;
using compare::CellRunner;
using compare::Experiment;
using nlohmann::json;

/// An index that must be below a count.
std::size_t index_in(const json& request, const char* name, std::size_t count) {
  const auto index = request.at(name).get<std::size_t>();
  if (index >= count) throw Error(std::string("the experiment has no ") + name + " " + std::to_string(index) + " any more");
  return index;
}

CellIndex cell_in(const Experiment& experiment, const json& request) {
  return {index_in(request, "variant", experiment.variants.size()), index_in(request, "case", experiment.cases.size()),
          index_in(request, "start", experiment.starts.size())};
}

/// Tells where a run is, and when it waits for another one.
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

}  // namespace

int worker(const CompareRequest& request) {
  const Catalogue catalogue;
  Diagnostics diagnostics;
  const Experiment experiment = compare::read_experiment(request.file, catalogue, diagnostics);
  if (!diagnostics.empty()) throw Error("the experiment has faults:\n" + diagnostics.text());
  const Store store;
  CellRunner runner(experiment, catalogue, request.no_cache ? nullptr : &store, request.folder, request.threads, request.file_limits);
  return serve_worker({
      {"case",
       [&](const json& asked, WorkerReports&) {
         runner.case_folder(index_in(asked, "case", experiment.cases.size()));
         return json(true);
       }},
      {"cell",
       [&](const json& asked, WorkerReports& reports) {
         return json::parse(compare::to_json(runner.run(cell_in(experiment, asked), observer_of(reports))));
       }},
      {"time",
       [&](const json& asked, WorkerReports&) { return json(runner.time(cell_in(experiment, asked))); }},
      {"draw",
       [&](const json& asked, WorkerReports& reports) {
         const CellIndex cell = cell_in(experiment, asked);
         if (runner.draw(cell, observer_of(reports))) ReportMaterial::prepare(runner.pictures_of(cell));
         return json(true);
       }},
  });
}

}  // namespace marrow::cli
