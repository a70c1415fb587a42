// SPDX-License-Identifier: Apache-2.0
#include "compare/cell_jobs.hpp"

#include <poll.h>
#include <unistd.h>
#include <cstdio>
#include <deque>
#include <thread>

#include "cell_jobs.hpp"
#include "commands.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/base/temporary_folder.hpp"
#include "marrow/base/text_file.hpp"
#include "marrow/runtime/process/worker.hpp"
#include "process.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;
using compare::CellRow;

/// Removes what an earlier run left of a cell in this folder. If that is not possible, says so.
void remove_old_outputs(const compare::CellRunner& runner, const compare::CellIndex& cell) {
  try {
    const fs::path folder = runner.folder_of(cell);
    if (fs::exists(folder)) remove_tree(folder);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "marrow: outputs of an earlier run stay: %s\n", printable(error.what()).c_str());
  }
}

[[noreturn]] void refuse(const std::string& what) {
  throw Error(what +
              " was changed while the comparison ran: its tables may mix the old with the new; give the same "
              "command again, which runs again what that concerns");
}

/// The folder or the seed of each case, by its name.
std::map<std::string, std::string> cases_of(const compare::Experiment& experiment) {
  std::map<std::string, std::string> cases;
  for (const compare::ExperimentCase& one : experiment.cases)
    cases[one.name] = formatted("{} {}", one.folder.string(), one.seed);
  return cases;
}

/// The first case in which the two experiments differ. Empty if there is none.
std::string difference(const compare::Experiment& before, const compare::Experiment& now) {
  const auto old_cases = cases_of(before), new_cases = cases_of(now);
  for (const auto& one : old_cases)
    if (!new_cases.contains(one.first) || *new_cases.find(one.first) != one)
      return "'" + one.first + "' is another, or gone";
  for (const auto& one : new_cases)
    if (!old_cases.contains(one.first)) return "'" + one.first + "' is new";
  return "";
}

constexpr int kMostRefused = 3;  // number of tries, because another program may be about to end

/// A worker and its current job.
struct Member {
  explicit Member(const std::vector<std::string>& command) : worker({command}) {}
  void start(Job next, bool no_other) {
    job = std::move(next);
    is_alone = no_other;
    ++job->tries;
    worker.ask(job->request);
  }

  Worker worker;
  std::optional<Job> job;
  bool is_alone = false;  ///< no other worker existed during its job
};

/// The jobs to do, in groups, and the workers that do them.
class Pool {
 public:
  Pool(std::vector<Job> jobs, const PoolSettings& settings, const std::function<void(const Job&, const JobEnd&)>& ended)
      : waiting_(std::make_move_iterator(jobs.begin()), std::make_move_iterator(jobs.end())),
        settings_(settings),
        ended_(ended),
        most_(std::size_t(std::max(1, settings.workers))) {}

  bool run() {
    while (!waiting_.empty() || !again_.empty() || is_busy()) {
      if (settings_.cancelled && settings_.cancelled->load()) return false;
      give_work();
      std::vector<pollfd> polled;
      for (const auto& member : members_) polled.push_back({member->worker.descriptor(), POLLIN, 0});
      poll(polled.data(), nfds_t(polled.size()), 50);
      for (const auto& member : members_) look_after(*member);
      std::erase_if(members_, [](const auto& member) { return member->worker.is_dead(); });
    }
    return true;
  }

 private:
  bool is_busy() const {
    for (const auto& member : members_)
      if (member->job) return true;
    return false;
  }

  void give_work() {
    // A job whose process failed is tried again alone. So no other job can be the cause, and none is disturbed.
    const bool alone = waiting_.empty();
    if (alone && is_busy()) return;
    std::deque<Job>& source = alone ? again_ : waiting_;
    if (alone && members_.size() > 1) members_.resize(1);  // idle workers use memory and threads too
    const std::size_t most = alone ? 1 : most_;
    while (!source.empty()) {
      Member* free = nullptr;
      for (const auto& member : members_)
        if (!member->job) free = member.get();
      if (alone && is_busy()) return;
      if (!free) {
        if (members_.size() >= most) return;
        free = new_member();
        if (!free) return;
      }
      std::optional<Job> next = next_for(*free, source);
      if (!next) return;
      free->start(std::move(*next), members_.size() == 1);
    }
  }

  /// nullptr if the system gives no further process. Then the existing workers do all jobs.
  Member* new_member() {
    try {
      members_.push_back(std::make_unique<Member>(settings_.command));
      for (const auto& member : members_) member->is_alone = members_.size() == 1;
      return members_.back().get();
    } catch (const NoProcess&) {
      if (members_.empty()) throw;
      most_ = members_.size();
      return nullptr;
    }
  }

  /// The system gave the worker no process. The job is done again, with fewer workers.
  void lacks_process(Member& member, Job job, const std::string& why) {
    if (member.is_alone && ++job.refused == kMostRefused) throw NoProcess(why);
    most_ = std::max<std::size_t>(1, members_.size() - 1);
    member.worker.close();
    --job.tries;
    waiting_.push_front(std::move(job));
  }

  /// The next job for a worker: one of its last group; else one of a group without a worker; else one of a group whose
  /// first job is done. Before that, a second worker would only compute the group's shared results again.
  std::optional<Job> next_for(const Member& member, std::deque<Job>& source) {
    std::string& mine = groups_[&member];
    auto chosen =
        std::find_if(source.begin(), source.end(), [&](const Job& job) { return job.group == mine && may_start(job); });
    if (chosen == source.end())
      chosen = std::find_if(source.begin(), source.end(), [&](const Job& job) { return !is_at_work(job.group); });
    if (chosen == source.end())
      chosen = std::find_if(source.begin(), source.end(), [&](const Job& job) { return may_start(job); });
    if (chosen == source.end()) return std::nullopt;
    Job job = std::move(*chosen);
    source.erase(chosen);
    mine = job.group;
    return job;
  }

  bool may_start(const Job& job) const { return begun_.contains(job.group) || !is_at_work(job.group); }
  bool is_at_work(const std::string& group) const {
    return std::any_of(members_.begin(), members_.end(),
                       [&](const auto& member) { return member->job && member->job->group == group; });
  }

  void look_after(Member& member) {
    auto end = member.worker.take([&](const nlohmann::json& report) {
      if (report["say"] == "waits long" && settings_.waits && member.job)
        settings_.waits(*member.job, member.worker.at());
    });
    if (!end) end = member.worker.check({settings_.time_limit_s, settings_.memory_limit_mb});
    if (!end || !member.job) return;
    Job job = std::move(*std::exchange(member.job, std::nullopt));
    if (end->answer.is_object() && end->answer.contains(kNoProcess))
      return lacks_process(member, std::move(job), end->answer[kNoProcess].get<std::string>());
    begun_.insert(job.group);
    if (end->died && job.tries < 2)
      again_.push_back(std::move(job));
    else
      ended_(job, {std::move(end->answer), end->failed, job.tries});
  }

  std::deque<Job> waiting_, again_;
  const PoolSettings& settings_;
  const std::function<void(const Job&, const JobEnd&)>& ended_;
  std::vector<std::unique_ptr<Member>> members_;
  std::map<const Member*, std::string> groups_;
  std::size_t most_;             ///< largest number of workers at once
  std::set<std::string> begun_;  ///< groups in which a job has ended
};

}  // namespace

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

void KnownRows::Remark::add(const std::string& what) {
  if (!cells++) first = what;
}

std::optional<CellRow> KnownRows::done(const compare::CellIndex& cell, const std::string& key) {
  std::optional<CellRow> row = runner_.finished(cell, key);
  if (!row) {
    if (const std::string fault = runner_.fault_of_row(cell); !fault.empty())
      changed_.add((runner_.folder_of(cell) / "cell.json").string() + ": " + fault);
    row = chunks_.done(cell, key);
    if (row) remove_old_outputs(runner_, cell);
  }
  if (row && chunks_.contradicts(cell, *row)) contradicting_.add(row->id);
  return row;
}

std::optional<CellRow> KnownRows::failed(const compare::CellIndex& cell) const {
  remove_old_outputs(runner_, cell);
  return chunks_.failed(cell);
}

void KnownRows::say_doubts() const {
  if (changed_.cells)
    say_note(changed_.cells == 1
                 ? "1 row is not as marrow wrote it, so it does not count: " + changed_.first
                 : formatted("{} rows are not as marrow wrote them, so they do not count: {}, and others",
                             changed_.cells, changed_.first));
  if (contradicting_.cells)
    say_note(
        formatted("{} rows with different results, from several hosts or times, such as {}. A row from a machine like "
                  "this one is taken, or else the first in the order of their texts",
                  counted(contradicting_.cells, "cell has", "cells have"), contradicting_.first));
}

Unchanged::Unchanged(const compare::Experiment& experiment, Cases cases)
    : experiment_(experiment), cases_(cases), texts_{{experiment.file, experiment.text}} {
  for (const fs::path& file : experiment.files)
    if (file != experiment.file) texts_[file] = read_text_file(file, kMostSourceBytes);
}

void Unchanged::check(const compare::Dependencies& dependencies) const {
  for (const auto& [file, text] : texts_)
    if (read_text_file(file, kMostSourceBytes) != text) refuse(file.string());
  const Catalogue catalogue;
  const std::string change = compare::first_change(dependencies, catalogue);
  if (!change.empty()) refuse(change);
  Diagnostics diagnostics;
  compare::Experiment now = compare::read_experiment(experiment_.file, catalogue, diagnostics, experiment_.more_cases);
  if (!diagnostics.empty()) refuse("what " + experiment_.file.string() + " names (" + diagnostics.text() + ")");
  if (now.tune && cases_ == Cases::held_out) keep_held_out_cases(now);
  if (const std::string other = difference(experiment_, now); !other.empty())
    refuse("the list of cases (" + other + ")");
}

bool run_jobs(std::vector<Job> jobs, const PoolSettings& settings,
              const std::function<void(const Job&, const JobEnd&)>& ended) {
  return Pool(std::move(jobs), settings, ended).run();
}

Progress::Progress(std::size_t all, const std::string& what, bool quiet)
    : all_(all), quiet_(quiet), is_terminal_(isatty(STDERR_FILENO)) {
  if (!quiet_ && all_) std::fprintf(stderr, "  0 of %zu %s%s", all_, what.c_str(), is_terminal_ ? "" : "\n");
}

void Progress::done(std::size_t number, const std::string& what) {
  number_ = number;
  const auto now = std::chrono::steady_clock::now();
  if (quiet_ || (number < all_ &&
                 now - last_ < (is_terminal_ ? std::chrono::milliseconds(100) : std::chrono::milliseconds(5000))))
    return;
  last_ = now;
  const double seconds = std::chrono::duration<double>(now - start_).count();
  std::fprintf(stderr, "%s  %zu of %zu, %.0f s", is_terminal_ ? "\r\033[K" : "", number, all_, seconds);
  if (number) std::fprintf(stderr, ", about %.0f s to go", seconds * double(all_ - number) / double(number));
  std::fprintf(stderr, ": %s%s", printable(what).c_str(), is_terminal_ && number < all_ ? "" : "\n");
}

}  // namespace marrow::cli
