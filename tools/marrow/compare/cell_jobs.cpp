// SPDX-License-Identifier: Apache-2.0
#include "compare/cell_jobs.hpp"

#include <cstdio>
#include <thread>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/runtime/process/worker.hpp"
#include "process.hpp"

namespace marrow::cli {

namespace fs = std::filesystem;

PoolSettings pool_of(const CompareRequest& request, const fs::path& folder, int threads) {
  PoolSettings pool;
  // All cells together have as many threads as there are cores.
  const int cores = int(std::thread::hardware_concurrency());
  pool.workers = request.jobs > 0 ? request.jobs : std::max(1, cores / std::max(1, threads));
  pool.time_limit_s = request.time_limit_s;
  pool.memory_limit_mb = request.memory_limit_mb;
  pool.cancelled = &stop_on_signals();
  pool.waits = [](const Job&, const std::string& where) {
    std::fprintf(stderr, "  %s waits for another run that is making the same result\n",
                 where.empty() ? "a cell" : printable(where).c_str());
  };
  pool.command = {
      this_program().string(), "worker", fs::absolute(request.file).string(), "--out", folder.string(), "--threads",
      formatted("{}", threads)};
  if (request.no_cache) pool.command.push_back("--no-cache");
  if (!request.tuned.empty()) pool.command.insert(pool.command.end(), {"--tuned", request.tuned});
  if (request.more_cases)
    pool.command.insert(pool.command.end(), {"--more-cases", formatted("{}", request.more_cases)});
  for (const auto& [name, value] :
       {std::pair("--file-memory", request.file_limits.memory_mb), {"--file-seconds", request.file_limits.seconds}})
    if (value > 0) pool.command.insert(pool.command.end(), {name, exact_number(value)});
  return pool;
}

CellJobs::CellJobs(const compare::Experiment& experiment, compare::CellRunner& runner)
    : experiment_(experiment), runner_(runner), cells_(compare::cells_of(experiment)), keys_(cells_.size()) {}

std::size_t CellJobs::number_of(const compare::CellIndex& cell) const {
  return (cell.case_index * experiment_.starts.size() + cell.start) * experiment_.variants.size() + cell.variant;
}

const std::string& CellJobs::take_key(std::size_t number) { return keys_[number] = runner_.key_of(cells_[number]); }

Job CellJobs::job_of(const char* what, std::size_t number, std::string group) const {
  return {{{"do", what}, {"cell", compare::cell_id(experiment_, cells_[number])}, {"key", keys_[number]}},
          std::move(group),
          number};
}

std::vector<Job> CellJobs::cases_of(const std::vector<std::size_t>& case_numbers) const {
  std::vector<Job> jobs;
  for (const std::size_t i : case_numbers)
    if (const compare::ExperimentCase& one = experiment_.cases[i]; one.is_simulated)
      jobs.push_back({{{"do", "case"}, {"case", one.name}, {"place", json_of_bytes(runner_.case_place(i).string())}},
                      one.name,
                      i});
  return jobs;
}

compare::CellRow CellJobs::row_of(const Job& job, const JobEnd& end) const {
  const compare::CellIndex& cell = cells_[job.number];
  if (!end.failed.empty()) return compare::failed_row(experiment_, cell, end.failed, end.tries);
  try {
    compare::CellRow row = compare::row_from_json(end.answer.dump(), experiment_);
    const std::string id = compare::cell_id(experiment_, cell);
    if (end.answer.at("id") != id || (row.failed.empty() && row.key != keys_[job.number]))
      throw Error("what it depends on changed while the comparison ran; run it again");
    compare::name_row(row, experiment_, cell);
    row.tries = end.tries;
    return row;
  } catch (const std::exception& error) {
    return compare::failed_row(experiment_, cell, error.what(), end.tries);
  }
}

std::string CellJobs::fault_of_case(const Job& job, const JobEnd& end) const {
  if (end.failed.empty() || end.failed.starts_with("case '")) return end.failed;
  return "case '" + experiment_.cases[job.number].name + "' cannot be made: " + end.failed;
}

}  // namespace marrow::cli
