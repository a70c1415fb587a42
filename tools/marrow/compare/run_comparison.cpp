// SPDX-License-Identifier: Apache-2.0
// Runs a comparison, or continues an interrupted one, up to its report.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <numeric>
#include <set>
#include <thread>

#include "commands.hpp"
#include "compare/cell_jobs.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/base/temporary_folder.hpp"
#include "process.hpp"
#include "report/report.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;
using compare::CellIndex;
using compare::CellRow;
using compare::CellRunner;
using compare::Experiment;

constexpr std::size_t kMostNamed = 20;  // cells with a reason

/// Ends a comparison early if it names figures that do not exist. The declarations of nodes do not name all figures and
/// items, so only the first cells show it. add() must get each row, made now or before.
class FirstCells {
 public:
  explicit FirstCells(const Experiment& experiment) : experiment_(experiment) {}
  /// Throws Error if no cell is done, and all variants lack a figure in all cases so far. There must be two such cases
  /// if the experiment has two: a single case may be the cause.
  void add(const CellIndex& cell, const CellRow& row) {
    any_done_ |= row.failed.empty();
    if (any_done_ || !row.lacks_figure) return;
    variants_.insert(cell.variant);
    cases_.insert(cell.case_index);
    if (variants_.size() < experiment_.variants.size() ||
        cases_.size() < std::min<std::size_t>(2, experiment_.cases.size()))
      return;
    throw Error(row.failed +
                "; this is so in the first cells of all variants, so the others were not run; name another figure in " +
                experiment_.file.string());
  }

 private:
  const Experiment& experiment_;
  bool any_done_ = false;
  std::set<std::size_t> variants_, cases_;  ///< with a cell that lacks a figure
};

/// A sentence about cases whose folders have the same content: copies, or simulations that do not use the seed. Each
/// counts as a separate case, so one observation would count several times. Empty if there are none. The runner must
/// keep its dependencies and have the keys of the cells.
std::string doubled_cases_text(const Experiment& experiment, const CellRunner& runner) {
  std::map<std::string, std::string> first;  // case, by the digest of its content
  std::size_t doubled = 0;
  std::string example;
  for (std::size_t i = 0; i < experiment.cases.size(); ++i) {
    const fs::path place = runner.case_place(i);
    if (place.empty()) continue;
    const auto content = runner.dependencies().contents.find(fs::absolute(place).string());
    if (content == runner.dependencies().contents.end()) continue;
    const auto [known, is_new] = first.emplace(content->second, experiment.cases[i].name);
    if (is_new) continue;
    if (!doubled++) example = "'" + known->second + "' and '" + experiment.cases[i].name + "'";
  }
  if (!doubled) return "";
  return formatted(
      "{}{} the same content as another one, such as {}; each counts as a case of its own, so intervals are too narrow "
      "and p too small: leave the copies out{}",
      doubled, doubled > 1 ? " cases have" : " case has", example,
      experiment.simulation.pipeline.empty() ? "" : ", or let the simulation take the seed (seed_input)");
}

class Comparison {
 public:
  Comparison(const CompareRequest& request, const Catalogue& catalogue, const Experiment& experiment,
             const fs::path& folder, const LostCells& reasons)
      : request_(request),
        reasons_(reasons),
        experiment_(experiment),
        folder_(folder),
        runner_(experiment, catalogue, request.no_cache ? nullptr : &store_, folder_, request.threads),
        cells_(experiment, runner_),
        rows_(cells_.count()) {
    runner_.keep_dependencies();
  }

  std::size_t found() const { return found_; }
  const CallCounts& calls() const { return calls_; }
  const compare::Dependencies& dependencies() const { return runner_.dependencies(); }

  /// The rows of all cells; nothing if it was interrupted.
  std::optional<std::vector<CellRow>> make_rows() {
    if (!make_cases() || !make_cells()) return std::nullopt;
    std::vector<CellRow> rows;
    for (auto& row : rows_) rows.push_back(std::move(*row));
    return rows;
  }

  int run() {
    std::optional<std::vector<CellRow>> made = make_rows();
    if (!made) return stopped();
    std::vector<CellRow>& rows = *made;
    TimedCells timed(experiment_, rows);
    if (!measure_times(timed, rows)) return stopped();
    Answer answer = answer_of(experiment_, rows);
    answer.tuning = request_.tuning;
    answer.times = timed.sentence(!request_.no_cache);
    write_tables(experiment_, rows, answer, folder_);
    const std::vector<CellIndex> shown = cells_to_show(experiment_, rows, request_.shown);
    if (!draw(shown)) return stopped();
    if (const std::string untidy = tidy(); !untidy.empty())
      say_note("the store of results is not tidied up: " + untidy);
    write_report(experiment_, rows, answer, runner_, shown, request_, folder_);
    print_counts(rows);
    std::printf("\n%s", table_text(experiment_, answer).c_str());
    if (experiment_.timed_cells) std::printf("\n%s\n", printable(answer.times).c_str());
    print_failures(rows);
    std::printf("\ntables in %s: cells.csv, cells.jsonl, poses.csv, poses.jsonl, comparison.json\nreport: %s\n",
                printable(folder_.string()).c_str(),
                printable(fs::absolute(folder_ / "report.html").lexically_normal().string()).c_str());
    return lost_.empty() ? 0 : 1;
  }

  /// As Gathered::lost.
  const std::string& lost_text() const { return lost_text_; }

 private:
  std::string tidy() const { return request_.no_cache ? "" : store_.tidy(&stop_on_signals()); }

  bool make_cases() {
    std::vector<std::size_t> all(experiment_.cases.size());
    std::iota(all.begin(), all.end(), std::size_t(0));
    const std::vector<Job> jobs = cells_.cases_of(all);
    Progress progress(jobs.size(), "cases", request_.quiet);
    return run_jobs(jobs, pool_of(request_, folder_, request_.threads), [&](const Job& job, const JobEnd& end) {
      if (std::string fault = cells_.fault_of_case(job, end); !fault.empty())
        case_faults_[job.number] = std::move(fault);
      progress.add("case " + experiment_.cases[job.number].name);
    });
  }

  bool make_cells() {
    KnownRows known(experiment_, runner_, folder_, request_.gather ? latest_plan(folder_).id : "");
    std::vector<Job> jobs;
    FirstCells first(experiment_);
    for (std::size_t i = 0; i < cells_.count(); ++i) {
      rows_[i] = row_there_is(i, known);
      if (rows_[i]) first.add(cells_.cell(i), *rows_[i]);
      if (!rows_[i]) jobs.push_back(cells_.job_of("cell", i, experiment_.cases[cells_.cell(i).case_index].name));
    }
    known.say_doubts();
    if (const std::string text = doubled_cases_text(experiment_, runner_); !text.empty()) say_note(text);
    Progress progress(jobs.size(), "cells", request_.quiet);
    return run_jobs(jobs, pool_of(request_, folder_, request_.threads), [&](const Job& job, const JobEnd& end) {
      CellRow row = cells_.row_of(job, end);
      calls_.add(row);
      runner_.write(cells_.cell(job.number), row);
      first.add(cells_.cell(job.number), row);
      tidy();  // thousands of cells would fill the disk before the end; a fault is said there
      progress.add(row.id + (row.failed.empty() ? "" : " failed: " + row.failed) +
                   (row.absent.empty() ? "" : ": " + row.absent));
      rows_[job.number] = std::move(row);
    });
  }

  /// A row that was made before, here or by a task of a cluster, or one that says why the cell cannot run.
  std::optional<CellRow> row_there_is(std::size_t number, KnownRows& known) {
    const CellIndex& cell = cells_.cell(number);
    if (const auto fault = case_faults_.find(cell.case_index); fault != case_faults_.end())
      return compare::failed_row(experiment_, cell, fault->second, 1);
    const std::string& key = cells_.take_key(number);
    std::optional<CellRow> row = known.done(cell, key);
    if (const auto failed = request_.failed_before.find(compare::cell_id(experiment_, cell));
        !row && failed != request_.failed_before.end())
      row = failed->second;
    found_ += row.has_value();
    if (row || !request_.gather) return row;
    if ((row = known.failed(cell))) return row;
    const auto reason = reasons_.find(number);
    lost_.insert(number);
    return compare::failed_row(experiment_, cell, reason == reasons_.end() ? "no task left its row" : reason->second,
                               1);
  }

  /// One run at a time uses all threads.
  bool measure_times(TimedCells& timed, std::vector<CellRow>& rows) {
    std::vector<Job> jobs;
    for (const std::size_t number : timed.numbers()) jobs.push_back(cells_.job_of("time", number, "times"));
    PoolSettings alone = pool_of(request_, folder_, int(std::thread::hardware_concurrency()));
    alone.workers = 1;
    alone.time_limit_s *= 2;  // the cell runs twice
    Progress progress(jobs.size(), "timed runs", request_.quiet);
    const bool is_whole = run_jobs(jobs, alone, [&](const Job& job, const JobEnd& end) {
      CellRow& row = rows[job.number];
      if (end.answer.is_number()) row.seconds = end.answer.get<double>();
      progress.add("time of " + row.id + (end.failed.empty() ? "" : " failed: " + end.failed));
    });
    timed.keep_complete(rows);
    return is_whole;
  }

  bool draw(const std::vector<CellIndex>& cells) {
    std::vector<Job> jobs;
    for (const CellIndex& cell : cells)
      jobs.push_back(cells_.job_of("draw", cells_.number_of(cell), experiment_.cases[cell.case_index].name));
    Progress progress(jobs.size(), "cells with pictures", request_.quiet);
    return run_jobs(jobs, pool_of(request_, folder_, request_.threads), [&](const Job& job, const JobEnd& end) {
      const std::string id = compare::cell_id(experiment_, cells_.cell(job.number));
      if (!end.failed.empty())
        std::fprintf(stderr, "marrow: no pictures of %s: %s\n", printable(id).c_str(), printable(end.failed).c_str());
      if (!end.failed.empty()) remove_old_pictures(cells_.cell(job.number));
      progress.add("pictures of " + id);
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

  void print_counts(const std::vector<CellRow>& rows) const {
    std::printf("\n%zu cells: %zu variants, %zu cases, %zu starts; %zu were there already\n", rows.size(),
                experiment_.variants.size(), experiment_.cases.size(), experiment_.starts.size(),
                found_ - std::min(found_, request_.made_before));
    CallCounts calls = request_.calls_before;
    calls.add(calls_);
    std::printf("calls of nodes: %ld made, %ld shared or read back\n", calls.made, calls.cached);
  }

  void print_failures(const std::vector<CellRow>& rows) {
    std::vector<const CellRow*> tried, lost;
    for (std::size_t i = 0; i < rows.size(); ++i) (lost_.contains(i) ? lost : tried).push_back(&rows[i]);
    if (const std::string text = reasons_text(tried, &CellRow::failed); !text.empty())
      std::printf("\nfailed cells\n%s", text.c_str());
    if (const std::string text = reasons_text(tried, &CellRow::absent); !text.empty())
      std::printf("\ncells in which a node failed that may fail\n%s", text.c_str());
    if (lost.empty()) return;
    lost_text_ = formatted(
        "{} of {} cells are lost: no task left a row of them, and they count as failed. The command that made the plan "
        "goes on with them.\n{}",
        lost.size(), rows.size(), reasons_text(lost, &CellRow::failed));
  }

  /// The first of the rows that have a reason, one on each line.
  static std::string reasons_text(const std::vector<const CellRow*>& rows, std::string CellRow::*reason) {
    std::size_t count = 0;
    std::string text;
    for (const CellRow* row : rows)
      if (!(row->*reason).empty() && ++count <= kMostNamed)
        text += "  " + printable(row->id) + ": " + printable(row->*reason) + "\n";
    if (count > kMostNamed) text += formatted("  and {} more, in cells.csv\n", count - kMostNamed);
    return text;
  }

  const CompareRequest& request_;
  const LostCells& reasons_;
  const Experiment& experiment_;
  fs::path folder_;
  Store store_;
  CellRunner runner_;
  CellJobs cells_;
  std::vector<std::optional<CellRow>> rows_;
  std::map<std::size_t, std::string> case_faults_;
  std::set<std::size_t> lost_;  ///< cells without a row
  std::string lost_text_;
  std::size_t found_ = 0;
  CallCounts calls_;
};

}  // namespace

void CallCounts::add(const CellRow& row) {
  for (const auto& [name, calls] : row.nodes) {
    made += calls.made;
    cached += calls.cached;
  }
}

void CallCounts::add(const CallCounts& others) {
  made += others.made;
  cached += others.cached;
}

int stopped() {
  std::fprintf(stderr, "marrow: %s; the same command goes on from here\n", stopped_text().c_str());
  return 130;
}

Gathered gather_comparison(const CompareRequest& request, const Catalogue& catalogue, const Experiment& experiment,
                           const fs::path& folder, const LostCells& reasons) {
  const Unchanged unchanged(experiment);
  Comparison comparison(request, catalogue, experiment, folder, reasons);
  const int code = comparison.run();
  unchanged.check(comparison.dependencies());
  return {code, comparison.lost_text()};
}

int run_comparison(const CompareRequest& request, const Catalogue& catalogue, const Experiment& experiment,
                   const fs::path& folder) {
  return gather_comparison(request, catalogue, experiment, folder, {}).code;
}

std::optional<CellRows> run_cells(const CompareRequest& request, const Catalogue& catalogue,
                                  const Experiment& experiment, const fs::path& folder) {
  const LostCells none;
  Comparison comparison(request, catalogue, experiment, folder, none);
  std::optional<std::vector<CellRow>> rows = comparison.make_rows();
  if (!rows) return std::nullopt;
  const std::size_t made = rows->size() - comparison.found();
  return CellRows{std::move(*rows), made, comparison.calls(), comparison.dependencies()};
}

}  // namespace marrow::cli
