// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <atomic>
#include <charconv>
#include <chrono>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <thread>

#include "command_options.hpp"
#include "compare/cell_jobs.hpp"
#include "compare/comparison_folder.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "process.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;
using compare::Experiment;

/// The chunks whose rows are all there.
struct Made {
  std::size_t chunks = 0, cells = 0;
};

/// Prints Gathered::lost as an error. Nothing if it is empty.
void say_lost(const std::string& lost) {
  if (!lost.empty()) std::fprintf(stderr, "marrow: error: %s", lost.c_str());
}

Made made_of(const std::vector<Chunk>& chunks, const std::map<std::string, bool>& files) {
  Made made;
  for (const Chunk& chunk : chunks)
    if (const auto file = files.find(chunk.name); file != files.end() && file->second) {
      ++made.chunks;
      made.cells += chunk.numbers.size();
    }
  return made;
}

std::size_t cells_of_plan(const ClusterPlan& plan) {
  std::size_t count = 0;
  for (const Chunk& chunk : plan.cells) count += chunk.numbers.size();
  return count;
}

/// "120 of 200 cells in 12 of 20 chunks"
std::string progress_of(const ClusterPlan& plan) {
  const auto [chunks, cells] = made_of(plan.cells, chunk_files(plan.folder));
  return formatted("{} of {} cells in {} of {} chunks", cells, cells_of_plan(plan), chunks, plan.cells.size());
}

using Clock = std::chrono::steady_clock;

constexpr auto kBetweenLooks = std::chrono::seconds(2);  // at the folder; at most the time between two questions
constexpr int kQuestionsOfEndedTask = 3;                 // after its rows are complete; then it is ended
constexpr int kQuestionsWithoutGather = 2;  // then it has ended: a shared folder may show its last file late
const std::set<std::string> kUsualReasons{"None", "Resources", "Priority", "Dependency", "JobArrayTaskLimit"};

class Follower {
 public:
  Follower(const ClusterPlan& plan, const ClusterProfile& profile, bool quiet)
      : plan_(plan), profile_(profile), progress_(cells_of_plan(plan), "cells", quiet) {}

  int run() {
    const std::atomic<bool>& stop = stop_on_signals();
    const std::chrono::seconds between_questions(profile_.ask_every_s);
    const auto between_looks = std::min(kBetweenLooks, between_questions);
    for (Clock::time_point next = Clock::now(); !stop; std::this_thread::sleep_for(between_looks)) {
      read();
      if (submission_.is_gathered) {
        say_lost(submission_.lost);
        return submission_.lost.empty() ? 0 : 1;
      }
      if (Clock::now() < next) continue;
      check(queue_of(submission_), stop);
      next = Clock::now() + between_questions;
    }
    read();  // it may have been submitted again
    cancel(submission_);
    std::fprintf(stderr, "marrow: %s; its tasks were cancelled; the same command goes on from here\n",
                 stopped_text().c_str());
    return 130;
  }

 private:
  void read() {
    auto submission = read_submission(plan_.folder);
    if (!submission || submission->plan != plan_.id) throw Error("another comparison was submitted from this folder");
    if (submission->gather != submission_.gather) questions_without_gather_ = 0;
    submission_ = std::move(*submission);
    files_ = chunk_files(plan_.folder);
    const auto [chunks, cells] = made_of(plan_.cells, files_);
    progress_.done(cells, formatted("{} chunks", chunks));
  }

  void check(const Queue& queue, const std::atomic<bool>& stop) {
    if (stop) return;
    check_answer(queue);
    if (!queue.is_known) return;
    check_gather(queue);
    if (!queue.held.empty()) {
      cancel(submission_);
      throw Error("the cluster holds tasks back (" + queue.held + "), so they were cancelled; can " +
                  plan_.folder.string() +
                  " be written to, or is its disk full? What is done counts: the same command goes on from here");
    }
    say_reasons(queue);
    end_forgotten(queue);
  }

  void say_reasons(const Queue& queue) {
    for (const std::string& reason : queue.reasons)
      if (!kUsualReasons.contains(reason) && said_reasons_.insert(reason).second)
        std::fprintf(stderr, "marrow: tasks wait on the cluster: %s\n", printable(reason).c_str());
  }

  void check_answer(const Queue& queue) {
    const Clock::time_point now = Clock::now();
    if (queue.is_known) {
      answered_at_ = now;
      is_silence_said_ = false;
      return;
    }
    if (now - answered_at_ > std::chrono::seconds(profile_.silence_s))
      throw Error(
          formatted("the cluster has not answered for {} s ({}), so it is no longer waited for; its tasks may go on: "
                    "see --status. What is done counts: --gather makes tables and report of it, and the command "
                    "without --on does the rest here",
                    profile_.silence_s, queue.fault));
    if (!is_silence_said_)
      std::fprintf(stderr, "marrow: the cluster does not answer (%s); it is asked again for %lld s\n",
                   printable(queue.fault).c_str(), static_cast<long long>(profile_.silence_s));
    is_silence_said_ = true;
  }

  void check_gather(const Queue& queue) {
    questions_without_gather_ = queue.has_gather ? 0 : questions_without_gather_ + 1;
    if (questions_without_gather_ < kQuestionsWithoutGather) return;
    throw Error("the job that gathers, " + submission_.gather + ", ended without a report; see " +
                (plan_.folder / "log" / (submission_.gather + ".txt")).string() +
                ". What is done counts: the same command goes on from here");
  }

  /// After a controller was killed, it may believe that ended tasks still run, and hold back what waits for them.
  void end_forgotten(const Queue& queue) {
    const std::chrono::seconds end_of_task(kQuestionsOfEndedTask * profile_.ask_every_s);
    for (const std::string& task : queue.running) {
      const auto file = files_.find(chunk_of(task));
      if (file == files_.end() || !file->second) continue;
      const auto [first, is_new] = made_but_running_.emplace(task, Clock::now());
      if (is_new || Clock::now() - first->second < end_of_task) continue;
      std::fprintf(stderr, "marrow: the cluster takes task %s for running, but its rows are there; it is ended\n",
                   printable(task).c_str());
      end_task(submission_, task);
      made_but_running_.erase(first);
    }
  }

  /// The name of the chunk that "JOB_TASK" does. Empty if it is not known.
  std::string chunk_of(const std::string& task) const {
    const std::size_t line = std::min(task.find('_'), task.size() - 1);
    std::size_t number = 0;
    if (std::from_chars(task.data() + line + 1, task.data() + task.size(), number).ec != std::errc()) return "";
    for (const Submission::Array& array : submission_.arrays)
      if (task.substr(0, line) == array.job && number < array.chunks.size()) return array.chunks[number];
    return "";
  }

  const ClusterPlan& plan_;
  const ClusterProfile& profile_;
  Progress progress_;
  Submission submission_;
  std::map<std::string, bool> files_;
  std::map<std::string, Clock::time_point> made_but_running_;  ///< since when, by the task
  Clock::time_point answered_at_ = Clock::now();
  bool is_silence_said_ = false;
  std::set<std::string> said_reasons_;
  int questions_without_gather_ = 0;
};

/// Follows what was submitted until its report is made. Ctrl-C ends it on the cluster, too. Ends tasks that the cluster
/// believes to be running although all their rows were written long ago. Throws Error if the report will not be made:
/// the job that makes it has ended or is forgotten, tasks are held back, or the cluster does not answer for
/// `silence_s`. Returns the exit code: 1 if cells are lost, 130 after Ctrl-C.
int follow(const ClusterPlan& plan, const ClusterProfile& profile, bool quiet) {
  return Follower(plan, profile, quiet).run();
}

nlohmann::json status_json(const ClusterPlan& plan, const std::optional<Submission>& submission) {
  const std::map<std::string, bool> files = chunk_files(plan.folder);
  const auto told = [](const Made& made, std::size_t chunks) {
    return nlohmann::json{{"chunks", chunks}, {"chunks_done", made.chunks}};
  };
  const Made cells = made_of(plan.cells, files);
  nlohmann::json j = {{"plan", plan.id},
                      {"cells", told(cells, plan.cells.size())},
                      {"cases_to_make", told(made_of(plan.cases, files), plan.cases.size())},
                      {"submitted", submission.has_value()}};
  j["cells"].update({{"cells", cells_of_plan(plan)}, {"cells_done", cells.cells}});
  if (!submission) return j;
  std::map<std::string, std::size_t> tasks;
  for (const auto& [task, state] : states_of(*submission)) ++tasks[state];
  j.update({{"tasks", tasks},
            {"gathered", submission->is_gathered},
            {"tries", submission->tries},
            {"lost", submission->lost}});
  return j;
}

/// What was submitted of this plan.
std::optional<Submission> submission_of(const fs::path& folder, const ClusterPlan& plan) {
  auto submission = read_submission(folder);
  return submission && submission->plan == plan.id ? submission : std::nullopt;
}

int print_status(const fs::path& folder, bool as_json) {
  const ClusterPlan plan = latest_plan(folder);
  const std::optional<Submission> submission = submission_of(folder, plan);
  if (as_json) {
    print_as_json(status_json(plan, submission));
    return 0;
  }
  std::printf("plan %s: %s\n", plan.id.c_str(), progress_of(plan).c_str());
  if (!plan.cases.empty())
    std::printf("cases to make first: %zu of %zu chunks\n", made_of(plan.cases, chunk_files(plan.folder)).chunks,
                plan.cases.size());
  if (!submission) return 0;
  std::map<std::string, std::size_t> counts;
  for (const auto& [task, state] : states_of(*submission)) ++counts[state];
  for (const auto& [state, count] : counts) std::printf("  %zu tasks %s\n", count, printable(state).c_str());
  std::printf("%s; submitted %lld times\n", submission->is_gathered ? "tables and report are made" : "not gathered yet",
              static_cast<long long>(submission->tries));
  if (!submission->lost.empty()) std::printf("%s", submission->lost.c_str());
  return 0;
}

bool load_profile(const ClusterRequest& cluster, ClusterProfile& profile) {
  if (cluster.profile.empty()) return true;
  Diagnostics diagnostics;
  profile = read_profile(cluster.profile, diagnostics);
  if (!diagnostics.empty()) print_faults(diagnostics);
  return diagnostics.empty();
}

/// Why a chunk has no good row of a cell, if the cluster does not say why.
std::string reason_of(const ClusterPlan& plan, const std::string& chunk, const std::map<std::string, bool>& files) {
  const auto file = files.find(chunk);
  if (file != files.end() && file->second)
    return "rows/" + chunk + ".jsonl has no undamaged row of it with its case and plugins as they are now";
  const std::string fault = fault_of_chunk(plan.folder, chunk);
  if (!fault.empty()) return "no task left its row: " + fault;
  return file == files.end() ? "no task left its row" : "its task ended before it left its row, or it runs still";
}

/// Why cells of the plan may have no row. `of_cluster`: the cluster's reasons, by the chunk's name.
LostCells lost_cells(const ClusterPlan& plan, const std::map<std::string, std::string>& of_cluster) {
  const std::map<std::string, bool> files = chunk_files(plan.folder);
  LostCells lost;
  for (const Chunk& chunk : plan.cells) {
    const auto file = files.find(chunk.name);
    const auto reason = file == files.end() || !file->second ? of_cluster.find(chunk.name) : of_cluster.end();
    const std::string words = reason == of_cluster.end() ? reason_of(plan, chunk.name, files) : reason->second;
    for (const std::size_t number : chunk.numbers) lost[number] = words;
  }
  return lost;
}

/// The job that gathers. Submits chunks without rows again, as often as the profile allows. Then makes tables and
/// report.
int gather_on_slurm(const CompareRequest& request, const ClusterRequest& cluster, const ClusterProfile& profile,
                    const Catalogue& catalogue, const Experiment& experiment, const fs::path& folder) {
  const ClusterPlan plan = latest_plan(folder);
  auto submission = read_submission(folder);
  if (!submission || submission->plan != plan.id) throw Error("nothing was submitted from " + folder.string());
  const bool is_whole = made_of(plan.cells, chunk_files(folder)).chunks == plan.cells.size();
  if (!is_whole && submission->tries < profile.tries) {
    const Submission again = submit(plan, profile, cluster.profile, submission->tries);
    std::printf("%s; submitted again, try %lld of %lld\n", progress_of(plan).c_str(),
                static_cast<long long>(again.tries), static_cast<long long>(profile.tries));
    return 0;
  }
  const auto of_cluster = is_whole ? std::map<std::string, std::string>() : reasons_of(plan, *submission);
  const Gathered gathered = gather_comparison(request, catalogue, experiment, folder, lost_cells(plan, of_cluster));
  submission->is_gathered = gathered.code == 0 || !gathered.lost.empty();
  submission->lost = gathered.lost;
  write_submission(folder, *submission);
  say_lost(gathered.lost);
  return gathered.code;
}

int gather(const CompareRequest& request, const ClusterRequest& cluster, const ClusterProfile& profile,
           const Catalogue& catalogue, const Experiment& experiment, const fs::path& folder) {
  const ComparisonFolder kept(folder, experiment, ComparisonFolder::Use::alone);
  if (cluster.on == "slurm") return gather_on_slurm(request, cluster, profile, catalogue, experiment, folder);
  const Gathered gathered =
      gather_comparison(request, catalogue, experiment, folder, lost_cells(latest_plan(folder), {}));
  say_lost(gathered.lost);
  return gathered.code;
}

void expect_ended(const Submission& before, const fs::path& folder) {
  const Queue queue = queue_of(before);
  if (!queue.is_known)
    throw Error("the cluster does not say whether what was submitted from " + folder.string() +
                " has ended: " + queue.fault);
  if (queue.has_gather)
    throw Error("what was submitted from " + folder.string() + " has not ended; see --status, or end it with --cancel");
}

int submit_or_emit(const CompareRequest& request, const ClusterRequest& cluster, const ClusterProfile& profile,
                   const Catalogue& catalogue, const Experiment& experiment, const fs::path& folder) {
  ChunkRule rule = cluster.rule;
  rule.most_tasks = std::size_t(profile.most_tasks);
  ClusterPlan plan;
  {
    const ComparisonFolder kept(folder, experiment, ComparisonFolder::Use::alone);
    if (const auto before = cluster.on.empty() ? std::nullopt : read_submission(folder))
      if (!before->is_gathered) expect_ended(*before, folder);
    plan = make_plan(request, catalogue, experiment, folder, rule);
  }
  if (plan.cells.empty()) {
    std::printf("no cell is left; give the command without --on and --emit for tables and report\n");
    return 0;
  }
  std::printf("%zu cells are left, in %zu chunks; plan: %s\n", cells_of_plan(plan), plan.cells.size(),
              printable(plan.place().string()).c_str());
  if (!cluster.emit.empty()) {
    const std::string command = cluster.emit == "parallel" ? emit_parallel(plan) : emit_snakemake(plan, profile);
    std::printf("run them by\n\n    %s\n\n", printable(command).c_str());
    return 0;
  }
  const Submission submission = submit(plan, profile, cluster.profile, 0);
  std::printf("submitted as %s, gathered by %s; see --status, end them with --cancel\n",
              submission.arrays.back().job.c_str(), submission.gather.c_str());
  return cluster.wait ? follow(plan, profile, request.quiet) : 0;
}

}  // namespace

void add_cluster_options(CLI::App* command, CompareRequest& request, ClusterRequest& cluster) {
  command->add_option("--on", cluster.on, "submit what is left to a cluster: slurm")->check(CLI::IsMember({"slurm"}));
  command->add_option("--emit", cluster.emit, "write what is left for another program: snakemake, parallel")
      ->check(CLI::IsMember({"snakemake", "parallel"}))
      ->excludes("--on");
  command->add_option("--profile", cluster.profile, "settings for the cluster (YAML)")->type_name("FILE");
  show_default(add_amount(command, "--chunk-minutes", cluster.rule.least_minutes, "minutes",
                          "minutes that a task takes at least, as estimated from earlier runs"),
               cluster.rule.least_minutes);
  command->add_flag("--wait", cluster.wait, "follow what was submitted; Ctrl-C ends it on the cluster, too");
  CLI::Option* status = command->add_flag("--status", cluster.status, "say how many tasks are done");
  command->add_flag("--json", cluster.as_json, "the status as JSON")->needs(status);
  command->add_flag("--cancel", cluster.cancel, "end what was submitted");
  command->add_flag("--gather", request.gather, "run no cell: make tables and report from the existing rows");
}

int compare_on_cluster(const CompareRequest& asked, const ClusterRequest& cluster, const Catalogue& catalogue,
                       const Experiment& experiment, const fs::path& folder) {
  if (cluster.status) return print_status(folder, cluster.as_json);
  CompareRequest request = asked;
  request.no_cache = asked.no_cache || !can_keep_results(Store().prepare(), asked.quiet);
  if (cluster.cancel) {
    const auto submission = read_submission(folder);
    if (!submission) throw Error("nothing was submitted from " + folder.string());
    cancel(*submission);
    std::printf("cancelled; %s\n", progress_of(latest_plan(folder)).c_str());
    return 0;
  }
  ClusterProfile profile;
  if (!load_profile(cluster, profile)) return 2;
  if (request.gather) return gather(request, cluster, profile, catalogue, experiment, folder);
  return submit_or_emit(request, cluster, profile, catalogue, experiment, folder);
}

}  // namespace marrow::cli
