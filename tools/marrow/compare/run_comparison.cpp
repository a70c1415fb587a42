// SPDX-License-Identifier: Apache-2.0
// Runs a comparison, or continues an interrupted one, up to its report.
#include <unistd.h>

#include <charconv>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <thread>

#include "compare/comparison.hpp"
#include "compare/pool.hpp"
#include "compare/unchanged.hpp"
#include "marrow/domain/error.hpp"
#include "marrow/domain/printable.hpp"
#include "marrow/runtime/worker.hpp"
#include "process.hpp"
#include "report/report.hpp"
#include "runtime/remove_tree.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;
using compare::CellIndex;
using compare::CellRow;
using compare::CellRunner;
using compare::Experiment;

class Progress {
 public:
  Progress(std::size_t all, bool quiet) : all_(all), quiet_(quiet), is_terminal_(isatty(STDERR_FILENO)) {}
  void done(std::size_t number, const std::string& what) {
    const auto now = std::chrono::steady_clock::now();
    if (quiet_ || (number < all_ &&
                   now - last_ < (is_terminal_ ? std::chrono::milliseconds(100) : std::chrono::milliseconds(5000))))
      return;
    last_ = now;
    const double seconds = std::chrono::duration<double>(now - start_).count();
    std::fprintf(stderr, "%s  %zu of %zu, %.0f s, about %.0f s to go: %s%s", is_terminal_ ? "\r\033[K" : "", number,
                 all_, seconds, number ? seconds * double(all_ - number) / double(number) : 0.0,
                 printable(what).c_str(), is_terminal_ && number < all_ ? "" : "\n");
  }

 private:
  std::size_t all_;
  bool quiet_, is_terminal_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now(), last_ = start_;
};

/// The shortest text that gives exactly this number when it is read.
std::string exact_text(double value) {
  char text[40];
  return {text, std::to_chars(text, text + sizeof text, value).ptr};
}

PoolSettings pool_of(const CompareRequest& request, const fs::path& folder, int threads) {
  PoolSettings pool;
  pool.workers = request.jobs > 0 ? request.jobs : int(std::max(1u, std::thread::hardware_concurrency()));
  pool.time_limit_s = request.time_limit_s;
  pool.memory_limit_mb = request.memory_limit_mb;
  pool.cancelled = &stop_on_signals();
  pool.waits = [](const Job&, const std::string& where) {
    std::fprintf(stderr, "  %s waits for another run that is making the same result\n",
                 where.empty() ? "a cell" : printable(where).c_str());
  };
  pool.command = {
      this_program().string(), "worker", fs::absolute(request.file).string(), "--out", folder.string(), "--threads",
      std::to_string(threads)};
  if (request.no_cache) pool.command.push_back("--no-cache");
  for (const auto& [name, value] :
       {std::pair("--file-memory", request.file_limits.memory_mb), {"--file-seconds", request.file_limits.seconds}})
    if (value > 0) pool.command.insert(pool.command.end(), {name, exact_text(value)});
  return pool;
}

class Comparison {
 public:
  Comparison(const CompareRequest& request, const Catalogue& catalogue, const Experiment& experiment,
             const fs::path& folder)
      : request_(request),
        experiment_(experiment),
        folder_(folder),
        cells_(compare::cells_of(experiment)),
        rows_(cells_.size()),
        keys_(cells_.size()),
        runner_(experiment, catalogue, request.no_cache ? nullptr : &store_, folder_, request.threads) {
    runner_.keep_dependencies();
  }

  const compare::Dependencies& dependencies() const { return runner_.dependencies(); }

  int run() {
    if (!make_cases() || !make_cells()) return stopped();
    std::vector<CellRow> rows;
    for (auto& row : rows_) rows.push_back(std::move(*row));
    if (!measure_times(rows)) return stopped();
    const Answer answer = answer_of(experiment_, rows);
    write_tables(experiment_, rows, answer, folder_);
    const std::vector<CellIndex> shown = cells_to_show(experiment_, rows, request_.shown);
    if (!draw(shown)) return stopped();
    if (const std::string untidy = tidy(); !untidy.empty())
      std::fprintf(stderr, "marrow: note: the store of results is not tidied up: %s\n", untidy.c_str());
    write_report(experiment_, rows, answer, runner_, shown, request_, folder_);
    print_counts(rows);
    std::printf("\n%s", table_text(experiment_, answer).c_str());
    print_failures(rows);
    std::printf("\ntables in %s: cells.csv, cells.jsonl, comparison.json\nreport: %s\n",
                printable(folder_.string()).c_str(),
                printable(fs::absolute(folder_ / "report.html").lexically_normal().string()).c_str());
    return 0;
  }

 private:
  static int stopped() {
    std::fprintf(stderr, "marrow: %s; the same command goes on from here\n", stopped_text().c_str());
    return 130;
  }

  std::string tidy() const { return request_.no_cache ? "" : store_.tidy(); }

  Job job_of(const char* what, const CellIndex& cell, std::string group) const {
    const std::size_t number = number_of(cell);
    return {{{"do", what}, {"cell", compare::cell_id(experiment_, cell)}, {"key", keys_[number]}},
            std::move(group),
            number};
  }

  bool make_cases() {
    std::vector<Job> jobs;
    for (std::size_t i = 0; i < experiment_.cases.size(); ++i)
      if (const compare::ExperimentCase& one = experiment_.cases[i]; one.is_simulated)
        jobs.push_back({{{"do", "case"}, {"case", one.name}, {"place", json_of_bytes(runner_.case_place(i).string())}},
                        one.name,
                        i});
    Progress progress(jobs.size(), request_.quiet);
    std::size_t done = 0;
    return run_jobs(jobs, pool_of(request_, folder_, request_.threads), [&](const Job& job, const JobEnd& end) {
      const std::string& name = experiment_.cases[job.number].name;
      if (!end.failed.empty())
        case_faults_[job.number] =
            end.failed.starts_with("case '") ? end.failed : "case '" + name + "' cannot be made: " + end.failed;
      progress.done(++done, "case " + name);
    });
  }

  bool make_cells() {
    std::vector<Job> jobs;
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      const CellIndex& cell = cells_[i];
      const auto fault = case_faults_.find(cell.case_index);
      if (fault != case_faults_.end())
        rows_[i] = compare::failed_row(experiment_, cell, fault->second, 1);
      else
        rows_[i] = runner_.finished(cell, keys_[i] = runner_.key_of(cell));
      found_ += rows_[i] && fault == case_faults_.end();
      if (!rows_[i]) jobs.push_back(job_of("cell", cell, experiment_.cases[cell.case_index].name));
    }
    Progress progress(jobs.size(), request_.quiet);
    std::size_t done = 0;
    return run_jobs(jobs, pool_of(request_, folder_, request_.threads), [&](const Job& job, const JobEnd& end) {
      const CellIndex& cell = cells_[job.number];
      CellRow row = row_of(cell, end);
      runner_.write(cell, row);
      tidy();  // thousands of cells would fill the disk before the end; a fault is said there
      progress.done(++done, row.id + (row.failed.empty() ? "" : " failed: " + row.failed) +
                                (row.absent.empty() ? "" : ": " + row.absent));
      rows_[job.number] = std::move(row);
    });
  }

  /// Measures times on the same cases and starts for all variants. They are spread evenly over all cases and starts.
  /// One run at a time uses all threads.
  bool measure_times(std::vector<CellRow>& rows) {
    const std::size_t variants = experiment_.variants.size(), places = rows.size() / variants,
                      count = std::min(places, experiment_.timed_cells);
    std::vector<Job> jobs;
    for (std::size_t i = 0; i < count; ++i)
      for (std::size_t v = 0; v < variants; ++v) {
        const std::size_t row = i * places / count * variants + v;
        if (rows[row].failed.empty()) jobs.push_back(job_of("time", cells_[row], "times"));
      }
    PoolSettings alone = pool_of(request_, folder_, int(std::thread::hardware_concurrency()));
    alone.workers = 1;
    Progress progress(jobs.size(), request_.quiet);
    std::size_t done = 0;
    return run_jobs(jobs, alone, [&](const Job& job, const JobEnd& end) {
      CellRow& row = rows[job.number];
      if (end.answer.is_number()) row.seconds = end.answer.get<double>();
      progress.done(++done, "time of " + row.id);
    });
  }

  bool draw(const std::vector<CellIndex>& cells) {
    std::vector<Job> jobs;
    for (const CellIndex& cell : cells) jobs.push_back(job_of("draw", cell, experiment_.cases[cell.case_index].name));
    Progress progress(jobs.size(), request_.quiet);
    std::size_t done = 0;
    return run_jobs(jobs, pool_of(request_, folder_, request_.threads), [&](const Job& job, const JobEnd& end) {
      const std::string id = compare::cell_id(experiment_, cells_[job.number]);
      if (!end.failed.empty())
        std::fprintf(stderr, "marrow: no pictures of %s: %s\n", printable(id).c_str(), printable(end.failed).c_str());
      if (!end.failed.empty()) remove_old_pictures(cells_[job.number]);
      progress.done(++done, "pictures of " + id);
    });
  }

  /// Removes old pictures of a cell that has no new ones. They may show an earlier state of its files, so the report
  /// must not use them.
  void remove_old_pictures(const CellIndex& cell) const {
    try {
      const fs::path folder = runner_.pictures_of(cell);
      if (fs::exists(folder / "key.txt")) remove_tree(folder);
    } catch (const std::exception& error) {
      std::fprintf(stderr, "marrow: old pictures stay: %s\n", printable(error.what()).c_str());
    }
  }

  std::size_t number_of(const CellIndex& cell) const {
    return (cell.case_index * experiment_.starts.size() + cell.start) * experiment_.variants.size() + cell.variant;
  }

  /// The row from a worker's answer. The answer counts only if it is about the requested cell.
  CellRow row_of(const CellIndex& cell, const JobEnd& end) const {
    if (!end.failed.empty()) return compare::failed_row(experiment_, cell, end.failed, end.tries);
    try {
      CellRow row = compare::row_from_json(end.answer.dump(), experiment_);
      const std::string id = compare::cell_id(experiment_, cell);
      if (end.answer.at("id") != id || (row.failed.empty() && row.key != keys_[number_of(cell)]))
        throw Error("what it depends on changed while the comparison ran; run it again");
      compare::name_row(row, experiment_, cell);
      row.tries = end.tries;
      return row;
    } catch (const std::exception& error) {
      return compare::failed_row(experiment_, cell, error.what(), end.tries);
    }
  }

  void print_counts(const std::vector<CellRow>& rows) const {
    long made = 0, cached = 0;
    for (const CellRow& row : rows)
      for (const auto& [name, calls] : row.nodes) {
        made += calls.made;
        cached += calls.cached;
      }
    std::printf("\n%zu cells: %zu variants, %zu cases, %zu starts; %zu were there already\n", rows.size(),
                experiment_.variants.size(), experiment_.cases.size(), experiment_.starts.size(), found_);
    std::printf("calls of nodes: %ld made, %ld shared or read back\n", made, cached);
  }

  static void print_failures(const std::vector<CellRow>& rows) {
    print_reasons(rows, "failed cells", &CellRow::failed);
    print_reasons(rows, "cells in which a node failed that may fail", &CellRow::absent);
  }

  static void print_reasons(const std::vector<CellRow>& rows, const char* title, std::string CellRow::*reason) {
    std::size_t count = 0;
    for (const CellRow& row : rows)
      if (!(row.*reason).empty() && ++count <= 20)
        std::printf("%s%s%s  %s: %s\n", count == 1 ? "\n" : "", count == 1 ? title : "", count == 1 ? "\n" : "",
                    printable(row.id).c_str(), printable(row.*reason).c_str());
    if (count > 20) std::printf("  and %zu more, in cells.csv\n", count - 20);
  }

  const CompareRequest& request_;
  const Experiment& experiment_;
  fs::path folder_;
  Store store_;
  std::vector<CellIndex> cells_;
  std::vector<std::optional<CellRow>> rows_;
  std::vector<std::string> keys_;  ///< keys of the cells at the beginning of the comparison
  std::map<std::size_t, std::string> case_faults_;
  std::size_t found_ = 0;
  CellRunner runner_;
};

}  // namespace

int run_comparison(const CompareRequest& request, const Catalogue& catalogue, const Experiment& experiment,
                   const fs::path& folder) {
  const Unchanged unchanged(experiment);
  Comparison comparison(request, catalogue, experiment, folder);
  const int code = comparison.run();
  unchanged.check(comparison.dependencies());
  return code;
}

}  // namespace marrow::cli
