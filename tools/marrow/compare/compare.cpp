// SPDX-License-Identifier: Apache-2.0
#include <yaml-cpp/yaml.h>
#include <cstdio>

#include "cluster/cluster.hpp"
#include "command_options.hpp"
#include "compare/comparison_folder.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/base/text_file.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"
#include "marrow/runtime/run/place_of_results.hpp"
#include "marrow/runtime/store/shared_store.hpp"
#include "process.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;
using compare::CellIndex;
using compare::CellRow;
using compare::CellRunner;
using compare::Experiment;

/// Reads the experiment. If it has faults, prints all of them and returns false.
bool load_experiment(const CompareRequest& request, const Catalogue& catalogue, Experiment& experiment,
                     std::size_t more_cases) {
  expect_given(request.file, Wanted::experiment);
  Diagnostics diagnostics;
  experiment = compare::read_experiment(request.file, catalogue, diagnostics, more_cases);
  if (diagnostics.empty()) return true;
  print_faults(diagnostics);
  return false;
}

fs::path folder_of(const CompareRequest& request, const Experiment& experiment) {
  return request.folder.empty() ? fs::path("runs") / "compare" / experiment.name : request.folder;
}

/// All files of a case's folder count as its content. A file that is written there would change the case while its
/// cells run.
void expect_outside_cases(const Experiment& experiment, const fs::path& folder, bool no_cache) {
  std::vector<fs::path> cases;
  for (const compare::ExperimentCase& one : experiment.cases)
    if (!one.folder.empty()) cases.push_back(one.folder);
  const auto expect = [&](const std::string& what, const fs::path& place, const std::string& advice) {
    if (const auto holder = folder_that_holds(cases, place))
      throw Error(what + " " + place.string() + " lies in the case " + holder->string() +
                  ", which would change while its cells run; " + advice);
  };
  expect("the output folder", folder, "choose another with --out");
  const Store store;
  if (!no_cache && store.fault().empty())
    expect("the store of results", store.folder(), "set MARROW_CACHE to another folder, or give --no-cache");
  if (!no_cache && store.shared())
    expect("the shared store of results", store.shared()->folder(),
           "set MARROW_SHARED_CACHE to another folder, or give --no-cache");
}

/// A message if a part of a cell's name is unknown to the experiment, with the nearest known name. Otherwise empty.
template <class Named>
std::string fault_of_part(const std::string& what, const std::string& part, const std::vector<Named>& all) {
  const std::vector<std::string> names = names_of(all);
  if (contains(names, part)) return "";
  return "no " + what + " '" + part + "'; " + suggestion(part, names);
}

std::string fault_of_id(const Experiment& experiment, const std::string& id) {
  const std::size_t first = id.find('/'), second = id.find('/', first + 1);
  if (first == std::string::npos || second == std::string::npos)
    return "write it as VARIANT/CASE/START, for example " + compare::cell_id(experiment, {0, 0, 0});
  std::string fault = fault_of_part("variant", id.substr(0, first), experiment.variants);
  if (fault.empty()) fault = fault_of_part("case", id.substr(first + 1, second - first - 1), experiment.cases);
  if (fault.empty()) fault = fault_of_part("start", id.substr(second + 1), experiment.starts);
  return "there is " + fault;
}

void say(const std::vector<std::string>& notes) {
  for (const std::string& note : notes) say_note(note);
}

/// Returns 0 if the comparison can run, else the exit code. Looks at the cases of the file.
int check_before_it_runs(CompareRequest request, const ClusterRequest& cluster, const Catalogue& catalogue,
                         const Experiment& experiment) {
  if (request.gather || cluster.status || cluster.cancel) return 0;
  request.more_cases = 0;
  const Store store;
  const bool is_kept = !request.no_cache && store.fault().empty();
  return check_items(request, catalogue, experiment, folder_of(request, experiment), is_kept ? &store : nullptr,
                     is_kept && !cluster.is_given());
}

void say_what_is_tuned(const Experiment& experiment) {
  const compare::TuneRule& rule = *experiment.tune;
  std::printf(
      "tuning: at most %zu points of %zu options on %zu training cases, which are at most %zu further cells; the "
      "following counts each variant of the file on each case, and no tuned one\n",
      rule.points, rule.options.size(), rule.training_cases,
      rule.points * rule.training_cases * experiment.starts.size());
}

// Inputs on the command line of `marrow compare`. They become an experiment file of their own, which extends the given
// one. So the cells, a cluster's tasks and the next command all read the same experiment.
/// The experiment file of the request; with inputs a new one, runs/compare/NAME.yaml, which extends it. Throws Error if
/// there is no such experiment, or if another file has this name.
fs::path experiment_with_inputs(const CompareRequest& request) {
  if (request.inputs.empty()) return request.file;
  std::error_code failure;
  if (!fs::is_regular_file(request.file, failure))
    throw Error(printable(request.file.string()) + ": there is no such experiment");
  YAML::Emitter text;
  text.SetSeqFormat(YAML::Flow);
  text << YAML::Comment("The experiment that it extends, with inputs of a command line.") << YAML::BeginMap;
  text << YAML::Key << "experiment" << YAML::Value << 1;
  text << YAML::Key << "extends" << YAML::Value << fs::canonical(request.file).string();
  text << YAML::Key << "inputs" << YAML::Value << YAML::BeginMap;
  for (const auto& [name, value] : pairs_of(request.inputs, "name=value")) {
    // A path of the command line starts here, one of an experiment at the folder of its file.
    const bool is_here = !value.empty() && fs::exists(value, failure);
    text << YAML::Key << name << YAML::Value << (is_here ? fs::absolute(value).lexically_normal().string() : value);
  }
  text << YAML::EndMap << YAML::EndMap;
  const std::string whole = std::string(text.c_str()) + "\n";
  const fs::path file = fs::path("runs") / "compare" / (request.file.stem().string() + ".yaml");
  if (fs::exists(file, failure)) {
    if (read_text_file(file, kMostSourceBytes) == whole) return file;
    throw Error(
        printable(file.string()) +
        ": holds this experiment with other inputs; go on with that file, or remove it and its folder of results");
  }
  fs::create_directories(file.parent_path(), failure);
  write_text_file(file, whole);
  if (!request.quiet) say_note("the experiment with these inputs is " + printable(file.string()));
  return file;
}

int compare_variants(const CompareRequest& asked, const ClusterRequest& cluster) {
  CompareRequest request = asked;
  stop_on_signals();
  expect_given(request.file, Wanted::experiment);
  request.file = experiment_with_inputs(request);
  const Catalogue catalogue;
  Experiment experiment;
  if (!load_experiment(request, catalogue, experiment, 0)) return 2;
  if (!request.quiet) say(experiment.notes);
  const bool by_tasks = cluster.is_given() || request.gather;
  if (request.more_cases && by_tasks)
    throw Error(
        "--more-cases looks at each batch of cases before the next one, so it runs here; leave the options for a "
        "cluster out");
  if (experiment.tune && request.more_cases)
    throw Error("--more-cases goes with a rule under 'stop', not with 'tune'; name more cases in the file");
  if (experiment.tune && by_tasks)
    throw Error(
        "'tune' looks at each point before it chooses the next one, so it runs here; leave the options for a cluster "
        "out");
  if (!request.differences.empty() && !request.dry_run)
    throw Error("--difference says how many cases a difference takes, without running any; add --dry-run");
  const fs::path folder = folder_of(request, experiment);
  if (!request.dry_run) expect_outside_cases(experiment, folder, request.no_cache);
  if (const int code = check_before_it_runs(request, cluster, catalogue, experiment)) return code;
  if (request.dry_run) {
    if (request.more_cases) experiment = largest_experiment(request, catalogue, experiment);
    const Store store;
    can_keep_results(store.fault(), request.no_cache);
    say_if_not_shared(store, request.no_cache);
    say(compare::notes_of(experiment));
    if (experiment.tune) say_what_is_tuned(experiment);
    print_plan(experiment, catalogue, request.no_cache ? nullptr : &store, folder);
    CellRunner runner(experiment, catalogue, request.no_cache ? nullptr : &store, folder, request.threads);
    std::printf("%s", needed_cases_text(experiment, runner, request.differences).c_str());
    return 0;
  }
  if (by_tasks) return compare_on_cluster(request, cluster, catalogue, experiment, folder);
  const ComparisonFolder kept(folder, experiment, ComparisonFolder::Use::alone);
  const Store store;
  request.no_cache = request.no_cache || !can_keep_results(store.prepare(), request.quiet);
  say_if_not_shared(store, request.no_cache || request.quiet);
  if (!request.quiet) say(compare::notes_of(experiment));
  if (experiment.tune) return run_tuning(request, catalogue, experiment, folder);
  return request.more_cases ? run_more_cases(request, catalogue, experiment, folder)
                            : run_comparison(request, catalogue, experiment, folder);
}

int run_cell(const CompareRequest& request, const std::string& id) {
  const Catalogue catalogue;
  Experiment experiment;
  if (!load_experiment(request, catalogue, experiment, request.more_cases)) return 2;
  add_tuned(experiment, id.substr(0, id.find('/')));
  const auto cell = compare::cell_of(experiment, id);
  if (!cell) {
    std::fprintf(stderr, "marrow: error: the experiment has no cell '%s': %s\n", printable(id).c_str(),
                 printable(fault_of_id(experiment, id)).c_str());
    return 2;
  }
  const fs::path folder = folder_of(request, experiment);
  expect_outside_cases(experiment, folder, request.no_cache);
  ComparisonFolder kept(folder, experiment, ComparisonFolder::Use::with_others);
  kept.take_cell(id);
  const Store store;
  const bool is_kept = !request.no_cache && can_keep_results(store.prepare(), false);
  say_if_not_shared(store, !is_kept);
  CellRunner runner(experiment, catalogue, is_kept ? &store : nullptr, folder, request.threads, request.file_limits);
  const long without_process = calls_without_process();
  CellRow row = runner.run(*cell);
  if (!row.failed.empty() && calls_without_process() != without_process)
    throw Error(row.failed);  // the cell itself did not fail
  runner.write(*cell, row);
  say_complaint(store);
  std::printf("%s\n", compare::to_json(row).c_str());
  if (!row.failed.empty()) return 1;
  try {
    runner.draw(*cell);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "marrow: no pictures of %s: %s\n", printable(id).c_str(),
                 printable_lines(error.what()).c_str());
  }
  return 0;
}

}  // namespace

void add_experiment_arguments(CLI::App* command, CompareRequest& request) {
  command->add_option("experiment", request.file, "experiment file (YAML)")->required()->type_name("FILE");
  command
      ->add_option("-o,--out", request.folder,
                   "folder of the comparison, new or to be continued (default: runs/compare/NAME)")
      ->type_name("FOLDER");
  show_default(add_whole_number(command, "--threads", request.threads, "threads of each cell", 1, 1024),
               request.threads);
  command->add_flag("--no-cache", request.no_cache, "neither read nor keep results of nodes");
  add_whole_number(command, "--more-cases", request.more_cases,
                   command->get_name() == "compare"
                       ? "add at most this number of cases, with further seeds, until the rule under 'stop' is met"
                       : "number of further seeds of the experiment, as in the comparison that added them",
                   1, 100000);
  add_shared_cache(command);
  add_file_limits(command, request.file_limits);
}

void add_compare(CLI::App& app, int& code) {
  const auto request = std::make_shared<CompareRequest>();
  CLI::App* command =
      app.add_subcommand("compare", "run an experiment: variants of a pipeline on the same cases, and which is better");
  add_experiment_arguments(command, *request);
  command->add_option("inputs", request->inputs, "values of the pipeline's inputs, as name=value")
      ->type_name("NAME=VALUE");
  add_whole_number(command, "-j,--jobs", request->jobs,
                   "cells at once (default: the number of cores, divided by the threads of a cell)", 1, 1024);
  show_default(add_amount(command, "--time-limit", request->time_limit_s, "seconds", "seconds that one cell may take"),
               request->time_limit_s);
  show_default(
      add_amount(command, "--memory-limit", request->memory_limit_mb, "megabytes", "megabytes that one cell may use"),
      request->memory_limit_mb);
  show_default(add_whole_number(command, "--shown", request->shown,
                                "cases and starts whose pictures go into the report", 0, 10000),
               request->shown);
  show_default(add_amount(command, "--page-mb", request->page_mb, "megabytes",
                          "megabytes that report.html may have; pictures that do not fit go to the folder report/"),
               request->page_mb);
  command->add_flag("-n,--dry-run", request->dry_run, "say what is left to do, and how long it took in earlier runs");
  command
      ->add_option_function<std::vector<std::string>>(
          "--difference",
          [request](const std::vector<std::string>& texts) {
            for (const std::string& text : texts) request->differences.push_back(wanted_difference(text));
          },
          "with --dry-run: say how many cases it takes to show this difference, as AMOUNT or FIGURE=AMOUNT")
      ->expected(1)
      ->take_all()
      ->type_name("AMOUNT");
  command->add_flag("-q,--quiet", request->quiet, "no progress");
  const auto cluster = std::make_shared<ClusterRequest>();
  add_cluster_options(command, *request, *cluster);
  command->callback([request, cluster, &code] { code = compare_variants(*request, *cluster); });
}

void add_cell(CLI::App& app, int& code) {
  const auto request = std::make_shared<CompareRequest>();
  const auto id = std::make_shared<std::string>();
  CLI::App* command = app.add_subcommand("cell", "run one cell of an experiment, as VARIANT/CASE/START");
  add_experiment_arguments(command, *request);
  command->add_option("id", *id, "the cell")->required();
  command->callback([request, id, &code] { code = run_cell(*request, *id); });
}

}  // namespace marrow::cli
