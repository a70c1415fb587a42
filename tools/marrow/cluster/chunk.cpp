// SPDX-License-Identifier: Apache-2.0
// `marrow chunk`: a task of a cluster does its part of a comparison. Its rows go to the comparison's folder; everything
// else is written to a folder on this host, which is removed at the end.
#include <fcntl.h>
#include <unistd.h>
#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <string_view>

#include "command_options.hpp"
#include "compare/cell_jobs.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/base/process_tree.hpp"
#include "marrow/base/temporary_folder.hpp"
#include "marrow/base/text_file.hpp"
#include "marrow/runtime/run/keys.hpp"
#include "process.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;
using compare::CellRow;
using compare::Experiment;

/// Writes the rows of one chunk.
class ChunkFile {
 public:
  /// Throws Error if the file cannot be made.
  ChunkFile(const std::filesystem::path& folder, const std::string& chunk);

  /// Throws Error if the row cannot be written.
  void add(const compare::CellRow& row);
  /// All rows are there: the file gets its final name. Throws Error if that fails.
  void finish();

 private:
  void expect_good(bool is_good) const;

  std::filesystem::path final_, part_;
  Descriptor descriptor_;
};

constexpr std::size_t kMostFaultBytes = 2000;

fs::path rows_folder(const fs::path& folder) { return folder / "rows"; }

fs::path fault_file(const fs::path& folder, const std::string& chunk) {
  return rows_folder(folder) / (chunk + ".fault");
}

/// The result in a row, without what differs each time the cell runs.
std::string result_of(CellRow row) {
  row.tries = 1;
  row.seconds.reset();
  row.nodes.clear();
  row.key.clear();
  return compare::to_json(row);
}

/// Writes FOLDER/rows/CHUNK.fault: why a task could not do its chunk, in one sentence. The task's output may be on
/// another host. If the file cannot be written, that is ignored: the task prints the sentence, too.
void leave_fault_of_chunk(const fs::path& folder, const std::string& chunk, const std::string& fault) {
  const fs::path file = fault_file(folder, chunk);
  std::error_code ignored;
  fs::create_directories(file.parent_path(), ignored);
  try {
    write_text_file(file, cut(printable(fault), kMostFaultBytes));
  } catch (const Error&) {
  }
}

/// Call this when the chunk is done.
void remove_fault_of_chunk(const fs::path& folder, const std::string& chunk) {
  std::error_code ignored;
  fs::remove(fault_file(folder, chunk), ignored);
}

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

ChunkFile::ChunkFile(const fs::path& folder, const std::string& chunk)
    : final_(rows_folder(folder) / (chunk + ".jsonl")),
      part_(rows_folder(folder) / (chunk + "." + this_process() + ".part")) {
  std::error_code error;
  fs::create_directories(rows_folder(folder), error);
  descriptor_ = Descriptor(open(part_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_APPEND | O_CLOEXEC | O_NOFOLLOW, 0666));
  expect_good(descriptor_.is_open());
}

void ChunkFile::expect_good(bool is_good) const {
  if (!is_good) throw Error("cannot write " + part_.string() + ": " + std::strerror(errno));
}

void ChunkFile::add(const CellRow& row) { expect_good(write_all(descriptor_, compare::to_json(row) + "\n")); }

void ChunkFile::finish() {
  expect_good(fsync(descriptor_) == 0);
  expect_good(descriptor_.close());  // a full disk may be noticed only here
  expect_good(rename(part_.c_str(), final_.c_str()) == 0);
}

std::map<std::string, bool> chunk_files(const fs::path& folder) {
  std::map<std::string, bool> chunks;
  std::error_code error;
  for (fs::directory_iterator at(rows_folder(folder), error), end; !error && at != end; at.increment(error)) {
    const fs::path name = at->path().filename();
    if (name.extension() == ".jsonl") chunks[name.stem().string()] = true;
    if (name.extension() == ".part") chunks.emplace(name.native().substr(0, name.native().find('.')), false);
  }
  return chunks;
}

std::string fault_of_chunk(const fs::path& folder, const std::string& chunk) {
  try {
    return printable(read_text_file(fault_file(folder, chunk), kMostFaultBytes));
  } catch (const Error&) {
    return "";
  }
}

RowsOfChunks::RowsOfChunks(const fs::path& folder, const compare::Experiment& experiment, const std::string& plan,
                           std::set<std::string> cells)
    : experiment_(experiment), cells_(std::move(cells)) {
  std::error_code error;
  for (fs::directory_iterator at(rows_folder(folder), error), end; !error && at != end; at.increment(error))
    if (const fs::path extension = at->path().extension(); extension == ".jsonl" || extension == ".part")
      add_file(at->path(), !plan.empty() && at->path().filename().native().starts_with(plan + "-"));
}

void RowsOfChunks::add_file(const fs::path& file, bool is_of_plan) {
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) try {
      if (is_wanted(line)) add_line(line, is_of_plan);
    } catch (const std::exception&) {  // the last line of a killed task, or another experiment's
    }
}

/// Looks only at the first "id" of the line. A name with an escaped letter is always wanted.
bool RowsOfChunks::is_wanted(const std::string& line) const {
  constexpr std::string_view kId = R"("id":")";
  const std::size_t at = cells_.empty() ? std::string::npos : line.find(kId);
  if (at == std::string::npos) return true;
  const std::string name = line.substr(at + kId.size(), line.find('"', at + kId.size()) - at - kId.size());
  return name.find('\\') != std::string::npos || cells_.contains(name);
}

void RowsOfChunks::add_line(const std::string& line, bool is_of_plan) {
  CellRow row = compare::row_from_json(line, experiment_);
  const std::string id = nlohmann::json::parse(line).at("id");
  if (row.failed.empty())
    done_[id].push_back(std::move(row));
  else if (is_of_plan)
    if (const auto [known, is_new] = failed_.emplace(id, row); !is_new && to_json(row) < to_json(known->second))
      known->second = std::move(row);
}

/// The rows with this key, except for the machine. Nothing here depends on the order of the files: first those of this
/// machine, then by their texts.
std::vector<CellRow> RowsOfChunks::rows_of(const compare::CellIndex& cell, const std::string& key) const {
  std::vector<CellRow> rows;
  const auto found = done_.find(compare::cell_id(experiment_, cell));
  if (found == done_.end() || key.empty()) return rows;
  for (const CellRow& row : found->second)
    if (compare::key_without_machine(row.key) == compare::key_without_machine(key)) rows.push_back(row);
  if (rows.size() > 1)
    std::sort(rows.begin(), rows.end(), [&](const CellRow& a, const CellRow& b) {
      if ((a.key == key) != (b.key == key)) return a.key == key;
      return to_json(a) < to_json(b);
    });
  for (CellRow& row : rows) compare::name_row(row, experiment_, cell);
  return rows;
}

std::optional<CellRow> RowsOfChunks::done(const compare::CellIndex& cell, const std::string& key) const {
  const std::vector<CellRow> rows = rows_of(cell, key);
  return rows.empty() ? std::nullopt : std::optional(rows.front());
}

bool RowsOfChunks::contradicts(const compare::CellIndex& cell, const CellRow& taken) const {
  const std::vector<CellRow> rows = rows_of(cell, taken.key);
  return std::any_of(rows.begin(), rows.end(),
                     [result = result_of(taken)](const CellRow& row) { return result_of(row) != result; });
}

std::optional<CellRow> RowsOfChunks::failed(const compare::CellIndex& cell) const {
  const auto found = failed_.find(compare::cell_id(experiment_, cell));
  if (found == failed_.end()) return std::nullopt;
  CellRow row = found->second;
  compare::name_row(row, experiment_, cell);
  return row;
}

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
