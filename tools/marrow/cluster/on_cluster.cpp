// SPDX-License-Identifier: Apache-2.0
#include "cluster/on_cluster.hpp"

#include <chrono>
#include <cstdio>
#include <thread>

#include "cluster/chunk_rows.hpp"
#include "cluster/scripts.hpp"
#include "cluster/slurm.hpp"
#include "command_options.hpp"
#include "compare/comparison_folder.hpp"
#include "compare/progress.hpp"
#include "marrow/domain/error.hpp"
#include "marrow/domain/printable.hpp"
#include "process.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;
using compare::Experiment;

constexpr auto kBetweenLooks = std::chrono::seconds(2);

/// The chunks whose rows are all there.
struct Made {
  std::size_t chunks = 0, cells = 0;
};
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
  return std::to_string(cells) + " of " + std::to_string(cells_of_plan(plan)) + " cells in " + std::to_string(chunks) +
         " of " + std::to_string(plan.cells.size()) + " chunks";
}

int print_status(const fs::path& folder) {
  const ClusterPlan plan = latest_plan(folder);
  std::printf("plan %s: %s\n", plan.id.c_str(), progress_of(plan).c_str());
  if (!plan.cases.empty())
    std::printf("cases to make first: %zu of %zu chunks\n", made_of(plan.cases, chunk_files(plan.folder)).chunks,
                plan.cases.size());
  const auto submission = read_submission(folder);
  if (!submission || submission->plan != plan.id) return 0;
  std::map<std::string, std::size_t> counts;
  for (const auto& [task, state] : states_of(*submission)) ++counts[state];
  for (const auto& [state, count] : counts) std::printf("  %zu tasks %s\n", count, printable(state).c_str());
  std::printf("%s; submitted %lld times\n", submission->is_gathered ? "tables and report are made" : "not gathered yet",
              static_cast<long long>(submission->tries));
  return 0;
}

/// Follows what was submitted. Ctrl-C ends it on the cluster, too.
int follow(const ClusterPlan& plan, bool quiet) {
  const std::atomic<bool>& stop = stop_on_signals();
  Progress progress(cells_of_plan(plan), quiet);
  std::optional<Submission> submission;
  while (!stop) {
    submission = read_submission(plan.folder);
    if (!submission || submission->plan != plan.id) throw Error("another comparison was submitted from this folder");
    const auto [chunks, cells] = made_of(plan.cells, chunk_files(plan.folder));
    progress.done(cells, std::to_string(chunks) + " chunks");
    if (submission->is_gathered) break;
    if (is_alive(submission->gather) == std::optional(false)) {
      // it may have submitted again, or ended in order, since the file was read
      const auto again = read_submission(plan.folder);
      if (again && !again->is_gathered && again->gather == submission->gather)
        throw Error("the job that gathers, " + submission->gather + ", ended without a report; see " +
                    (plan.folder / "log" / (submission->gather + ".txt")).string());
    }
    if (const std::string reason = held_back(*submission); !reason.empty()) {
      cancel(*submission);
      throw Error("the cluster holds tasks back (" + reason + "), so they were cancelled; can " + plan.folder.string() +
                  " be written to, or is its disk full? What is done counts: the same command goes on from here");
    }
    std::this_thread::sleep_for(kBetweenLooks);
  }
  if (!stop) return 0;
  cancel(*submission);
  std::fprintf(stderr, "marrow: %s; its tasks were cancelled; the same command goes on from here\n",
               stopped_text().c_str());
  return 130;
}

bool load_profile(const ClusterRequest& cluster, ClusterProfile& profile) {
  if (cluster.profile.empty()) return true;
  Diagnostics diagnostics;
  profile = read_profile(cluster.profile, diagnostics);
  if (!diagnostics.empty()) print_faults(diagnostics);
  return diagnostics.empty();
}

/// Cells of the chunks that left no rows, with the reason.
LostCells lost_cells(const ClusterPlan& plan, const std::map<std::string, std::string>& reasons) {
  LostCells lost;
  for (const Chunk& chunk : plan.cells)
    if (const auto reason = reasons.find(chunk.name); reason != reasons.end())
      for (const std::size_t number : chunk.numbers) lost[number] = reason->second;
  return lost;
}

/// The job that gathers: submits again what left no rows, as often as the profile says; else makes tables and report.
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
  const LostCells lost = is_whole ? LostCells{} : lost_cells(plan, reasons_of(*submission));
  const int code = run_comparison(request, catalogue, experiment, folder, lost);
  submission->is_gathered = code == 0;
  write_submission(folder, *submission);
  return code;
}

int gather(const CompareRequest& request, const ClusterRequest& cluster, const ClusterProfile& profile,
           const Catalogue& catalogue, const Experiment& experiment, const fs::path& folder) {
  const ComparisonFolder kept(folder, experiment, ComparisonFolder::Use::alone);
  if (cluster.on == "slurm") return gather_on_slurm(request, cluster, profile, catalogue, experiment, folder);
  return run_comparison(request, catalogue, experiment, folder);
}

int submit_or_emit(const CompareRequest& request, const ClusterRequest& cluster, const ClusterProfile& profile,
                   const Catalogue& catalogue, const Experiment& experiment, const fs::path& folder) {
  ChunkRule rule = cluster.rule;
  rule.most_tasks = std::size_t(profile.most_tasks);
  ClusterPlan plan;
  {
    const ComparisonFolder kept(folder, experiment, ComparisonFolder::Use::alone);
    if (const auto before = cluster.on.empty() ? std::nullopt : read_submission(folder))
      if (!before->is_gathered && is_alive(before->gather) != std::optional(false))
        throw Error("what was submitted from " + folder.string() +
                    " has not ended; see --status, or end it with --cancel");
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
  return cluster.wait ? follow(plan, request.quiet) : 0;
}

}  // namespace

void add_cluster_options(CLI::App* command, CompareRequest& request, ClusterRequest& cluster) {
  command->add_option("--on", cluster.on, "submit what is left to a cluster: slurm")->check(CLI::IsMember({"slurm"}));
  command->add_option("--emit", cluster.emit, "write what is left for another program: snakemake, parallel")
      ->check(CLI::IsMember({"snakemake", "parallel"}))
      ->excludes("--on");
  command->add_option("--profile", cluster.profile, "what the cluster wants to be told (YAML)");
  show_default(add_amount(command, "--chunk-minutes", cluster.rule.least_minutes, "minutes",
                          "minutes that a task takes at least, as estimated from earlier runs"),
               cluster.rule.least_minutes);
  command->add_flag("--wait", cluster.wait, "follow what was submitted; Ctrl-C ends it on the cluster, too");
  command->add_flag("--status", cluster.status, "say how far the tasks are");
  command->add_flag("--cancel", cluster.cancel, "end what was submitted");
  command->add_flag("--gather", request.gather, "run no cell: make tables and report from the rows that are there");
}

int compare_on_cluster(const CompareRequest& asked, const ClusterRequest& cluster, const Catalogue& catalogue,
                       const Experiment& experiment, const fs::path& folder) {
  if (cluster.status) return print_status(folder);
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
