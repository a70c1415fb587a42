// SPDX-License-Identifier: Apache-2.0
// A worker process of a comparison. It makes cases, says what is in them, and runs, times and draws cells.
#include <algorithm>
#include <cstdio>
#include <set>
#include <tuple>

#include "command_options.hpp"
#include "compare/cell_jobs.hpp"
#include "marrow/base/plain_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"
#include "marrow/runtime/process/worker.hpp"
#include "report/report.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;
using compare::CellIndex;
using compare::CellRunner;
using compare::Experiment;
using compare::NamedItem;
using nlohmann::json;

class ItemCheck {
 public:
  ItemCheck(const CompareRequest& request, const Experiment& experiment, const CellRunner& runner,
            const fs::path& folder, bool makes_cases)
      : request_(request), experiment_(experiment), runner_(runner), folder_(folder), makes_cases_(makes_cases) {}

  int run(std::vector<NamedItem> open) {
    for (const std::size_t one : {std::size_t(0), experiment_.cases.size() - 1}) {
      if (open.empty() || contains(cases_, experiment_.cases[one].name)) break;
      if (!learn(one, open)) return stopped();
      if (!why_not_.empty()) {
        if (!request_.quiet) say_note("whether there are the items that figures name is not checked: " + why_not_);
        return 0;
      }
      cases_.push_back(experiment_.cases[one].name);
      std::erase_if(open, [&](const NamedItem& item) {
        return names_[from(item)].empty() || contains(names_[from(item)], item.item);
      });
    }
    if (open.empty()) return 0;
    print(open);
    return 2;
  }

 private:
  /// Figures that name items along the same axis of the same output ask the same.
  using Source = std::tuple<std::size_t, std::string, int, std::string>;
  static Source from(const NamedItem& item) { return {item.variant, item.node, item.output, item.axis}; }

  /// Adds the names of a case. Returns false if it was interrupted. If a node fails, why_not_ says why.
  bool learn(std::size_t case_number, const std::vector<NamedItem>& items) {
    const std::string& name = experiment_.cases[case_number].name;
    const fs::path place = runner_.case_place(case_number);
    if (!place.empty() && !fs::exists(place)) {
      if (!makes_cases_) why_not_ = "case '" + name + "' is not made yet";
      if (!makes_cases_) return true;
    }
    if (!request_.quiet)
      std::fprintf(stderr, "  %s case %s, to see which items it has\n",
                   place.empty() || fs::exists(place) ? "looking at" : "making", printable(name).c_str());
    std::vector<Job> jobs;
    std::set<Source> asked;
    for (std::size_t i = 0; i < items.size(); ++i)
      if (asked.insert(from(items[i])).second)
        jobs.push_back({{{"do", "items"},
                         {"cell", compare::cell_id(experiment_, {items[i].variant, case_number, 0})},
                         {"node", items[i].node},
                         {"output", items[i].output},
                         {"axis", items[i].axis}},
                        "items",
                        i});
    return run_jobs(jobs, pool_of(request_, folder_, request_.threads), [&](const Job& job, const JobEnd& end) {
      std::vector<std::string>& names = names_[from(items[job.number])];
      if (!end.failed.empty()) why_not_ = end.failed;
      if (end.failed.empty())
        for (const std::string name : end.answer)
          if (!contains(names, name)) names.push_back(name);
    });
  }

  void print(const std::vector<NamedItem>& items) {
    Diagnostics found;
    found.remember(experiment_.file.string(), plain_text(experiment_.text));
    const std::string in = (cases_.size() > 1 ? " in the cases '" : " in case '") + joined(cases_, "' and '") + "'";
    for (const NamedItem& item : items) {
      Diagnostics one;
      one.add(item.place, "'" + item.path + "': there is no " + item.axis + " '" + item.item + "'" + in,
              suggestion(item.item, names_[from(item)]));
      found.add_all(one);  // several variants may have the same fault
    }
    print_faults(found);
  }

  const CompareRequest& request_;
  const Experiment& experiment_;
  const CellRunner& runner_;
  const fs::path& folder_;
  bool makes_cases_;
  std::vector<std::string> cases_;  ///< that were looked at
  std::map<Source, std::vector<std::string>> names_;
  std::string why_not_;
};

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

int check_items(const CompareRequest& request, const Catalogue& catalogue, const Experiment& experiment,
                const fs::path& folder, const Store* store, bool makes_cases) {
  CellRunner runner(experiment, catalogue, store, folder, request.threads, request.file_limits);
  std::vector<NamedItem> open = experiment.named_items;
  const fs::path place = open.empty() ? fs::path() : runner.case_place(0);
  if (place.empty() || fs::exists(place))
    std::erase_if(open, [&](const NamedItem& item) {
      const compare::CellIndex first{item.variant, 0, 0};
      return runner.finished(first, runner.key_of(first)).has_value();
    });
  return ItemCheck(request, experiment, runner, folder, makes_cases).run(open);
}

void add_worker(CLI::App& app, int& code) {
  const auto request = std::make_shared<CompareRequest>();
  CLI::App* command = app.add_subcommand("worker", "take cells from the standard input; started by compare");
  command->group("");
  add_experiment_arguments(command, *request);
  command->add_option("--tuned", request->tuned, "name of the tuned variant that the experiment has");
  command->callback([request, &code] { code = worker(*request); });
}

}  // namespace marrow::cli
