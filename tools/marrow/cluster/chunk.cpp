// SPDX-License-Identifier: Apache-2.0
// `marrow chunk`: a task of a cluster does its part of a comparison. Its rows go to the comparison's folder; everything
// else is written to a folder on this host, which is removed at the end.
#include <cstdio>
#include <cstdlib>
#include <set>

#include "cluster/chunk_rows.hpp"
#include "cluster/plan.hpp"
#include "command_options.hpp"
#include "commands.hpp"
#include "compare/cell_jobs.hpp"
#include "compare/progress.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/base/remove_tree.hpp"
#include "marrow/base/temporary_folder.hpp"
#include "marrow/runtime/run/keys.hpp"
#include "process.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;
using compare::CellRow;
using compare::Experiment;

struct ChunkRequest {
  fs::path plan;
  std::string name;
  int jobs = 0;
  bool quiet = false;
};

struct Task {
  const ClusterPlan& plan;
  const Experiment& experiment;
  const Catalogue& catalogue;
  CompareRequest request;
};

CompareRequest request_of(const ClusterPlan& plan, const ChunkRequest& asked) {
  CompareRequest request;
  request.file = plan.file;
  request.folder = plan.folder;
  request.jobs = asked.jobs;
  request.threads = plan.threads;
  request.time_limit_s = plan.time_limit_s;
  request.memory_limit_mb = plan.memory_limit_mb;
  request.no_cache = plan.no_cache;
  request.file_limits = plan.file_limits;
  request.quiet = asked.quiet;
  return request;
}

/// Makes the cases. `faults` gets why one cannot be made. Returns false if it was stopped.
bool make_cases(const Task& task, const CellJobs& cells, const std::vector<std::size_t>& numbers,
                const fs::path& scratch, std::map<std::size_t, std::string>& faults) {
  const std::vector<Job> jobs = cells.cases_of(numbers);
  Progress progress(jobs.size(), "cases", task.request.quiet);
  return run_jobs(jobs, pool_of(task.request, scratch, task.request.threads), [&](const Job& job, const JobEnd& end) {
    if (std::string fault = cells.fault_of_case(job, end); !fault.empty()) faults[job.number] = std::move(fault);
    progress.add("case " + task.experiment.cases[job.number].name);
  });
}

void expect_same_cases(const Task& task, const std::set<std::size_t>& cases) {
  for (const std::size_t number : cases) {
    const compare::ExperimentCase& one = task.experiment.cases[number];
    const auto planned = task.plan.case_digests.find(one.name);
    if (planned != task.plan.case_digests.end() && path_digest(one.folder).hex() != planned->second)
      throw Error("the case " + one.folder.string() +
                  " is not what it was when the plan was made; give the command that made the plan again");
  }
}

/// Runs the cells that have no row yet, and writes the rows of all. Returns false if it was stopped.
bool make_rows(const Task& task, const Chunk& chunk) {
  const TemporaryFolder scratch(new_temporary_folder("chunk"));
  const Store store;
  compare::CellRunner runner(task.experiment, task.catalogue, task.request.no_cache ? nullptr : &store, scratch.path(),
                             task.request.threads, task.request.file_limits);
  runner.keep_dependencies();
  CellJobs cells(task.experiment, runner);
  std::set<std::size_t> cases;
  std::set<std::string> names;
  for (const std::size_t number : chunk.numbers) {
    cases.insert(cells.cell(number).case_index);
    names.insert(compare::cell_id(task.experiment, cells.cell(number)));
  }
  expect_same_cases(task, cases);
  std::map<std::size_t, std::string> faults;
  if (!make_cases(task, cells, {cases.begin(), cases.end()}, scratch.path(), faults)) return false;

  const RowsOfChunks known(task.plan.folder, task.experiment, task.plan.id, std::move(names));
  ChunkFile file(task.plan.folder, chunk.name);
  std::vector<Job> jobs;
  for (const std::size_t number : chunk.numbers) {
    const compare::CellIndex& cell = cells.cell(number);
    if (const auto fault = faults.find(cell.case_index); fault != faults.end())
      file.add(compare::failed_row(task.experiment, cell, fault->second, 1));
    else if (const auto row = known.done(cell, cells.take_key(number)))
      file.add(*row);
    else
      jobs.push_back(cells.job_of("cell", number, task.experiment.cases[cell.case_index].name));
  }
  Progress progress(jobs.size(), "cells", task.request.quiet);
  if (!run_jobs(jobs, pool_of(task.request, scratch.path(), task.request.threads),
                [&](const Job& job, const JobEnd& end) {
                  const CellRow row = cells.row_of(job, end);
                  file.add(row);
                  std::error_code ignored;
                  fs::remove_all(runner.folder_of(cells.cell(job.number)), ignored);
                  if (!task.request.no_cache) store.tidy(&stop_on_signals());
                  progress.add(row.id + (row.failed.empty() ? "" : " failed: " + row.failed));
                }))
    return false;
  file.finish();
  return true;
}

/// Makes cases before others need them. The file without rows says that this chunk is done.
bool make_cases_only(const Task& task, const Chunk& chunk) {
  const TemporaryFolder scratch(new_temporary_folder("chunk"));
  const Store store;
  compare::CellRunner runner(task.experiment, task.catalogue, task.request.no_cache ? nullptr : &store, scratch.path(),
                             task.request.threads, task.request.file_limits);
  const CellJobs cells(task.experiment, runner);
  ChunkFile file(task.plan.folder, chunk.name);
  std::map<std::size_t, std::string> faults;
  if (!make_cases(task, cells, chunk.numbers, scratch.path(), faults)) return false;
  for (const auto& [number, fault] : faults) std::fprintf(stderr, "marrow: %s\n", printable(fault).c_str());
  file.finish();
  return true;
}

const Chunk* chunk_named(const std::vector<Chunk>& chunks, const std::string& name) {
  for (const Chunk& chunk : chunks)
    if (chunk.name == name) return &chunk;
  return nullptr;
}

/// Returns false if it was stopped.
bool do_chunk(const ClusterPlan& plan, const Chunk& chunk, bool is_of_cases, const ChunkRequest& asked) {
  const Catalogue catalogue;
  Diagnostics diagnostics;
  const Experiment experiment = compare::read_experiment(plan.file, catalogue, diagnostics);
  if (!diagnostics.empty()) {
    print_faults(diagnostics);
    const Diagnostic first = diagnostics.sorted().front();
    throw Error(formatted("the experiment has faults here; the first: {}:{}: {}", first.place.file, first.place.line,
                          first.message));
  }
  expect_as_planned(plan, catalogue, experiment);
  Task task{plan, experiment, catalogue, request_of(plan, asked)};
  task.request.no_cache = plan.no_cache || !can_keep_results(Store().prepare(), asked.quiet);
  return is_of_cases ? make_cases_only(task, chunk) : make_rows(task, chunk);
}

int run_chunk(const ChunkRequest& asked) {
  stop_on_signals();
  const ClusterPlan plan = read_plan(asked.plan);
  const Chunk* of_cases = chunk_named(plan.cases, asked.name);
  const Chunk* chunk = of_cases ? of_cases : chunk_named(plan.cells, asked.name);
  if (!chunk)
    throw Error("the plan has no chunk '" + asked.name + "'; its chunks are " + plan.cells.front().name + " to " +
                plan.cells.back().name);
  try {
    if (do_chunk(plan, *chunk, chunk == of_cases, asked)) {
      remove_fault_of_chunk(plan.folder, chunk->name);
      return 0;
    }
  } catch (const std::exception& error) {
    leave_fault_of_chunk(plan.folder, chunk->name, error.what());
    throw;
  }
  return stopped();
}

}  // namespace

void add_chunk(CLI::App& app, int& code) {
  const auto request = std::make_shared<ChunkRequest>();
  CLI::App* command = app.add_subcommand("chunk", "run one chunk of a comparison's plan, as a task of a cluster does");
  command->add_option("plan", request->plan, "file of the plan, which --on or --emit of 'marrow compare' wrote")
      ->required();
  command->add_option("name", request->name, "the chunk")->required();
  add_whole_number(command, "-j,--jobs", request->jobs,
                   "cells at once (default: the number of cores, divided by the threads of a cell)", 1, 1024);
  command->add_flag("-q,--quiet", request->quiet, "no progress");
  command->callback([request, &code] { code = run_chunk(*request); });
}

}  // namespace marrow::cli
