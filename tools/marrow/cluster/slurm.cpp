// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <atomic>
#include <chrono>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "cluster/cluster.hpp"
#include "marrow/base/json_text.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"
#include "process.hpp"
#include "report/report.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr auto kLongestAnswer = std::chrono::seconds(60);
constexpr std::size_t kMostSaidBytes = 300;

std::string without_end_of_line(const std::string& text) { return text.substr(0, text.find_last_not_of("\n") + 1); }

/// The output of a Slurm program. Throws Error if it fails.
std::string said_by(const std::vector<std::string>& command) {
  const ChildEnd end = run_child(
      command, [] { return false; }, Said::kept);
  if (end.code != 0)
    throw Error(formatted("{} failed (exit code {}): {}", command[0], end.code, without_end_of_line(end.said)));
  return end.said;
}

/// Runs a Slurm program that only asks. Ends it if it takes too long, and after Ctrl-C.
ChildEnd ask(const std::vector<std::string>& command) {
  const auto asked_at = std::chrono::steady_clock::now();
  const std::atomic<bool>& stop = stop_on_signals();
  return run_child(
      command, [&] { return stop || std::chrono::steady_clock::now() - asked_at > kLongestAnswer; }, Said::kept);
}

std::vector<std::string> arrays_of(const Submission& submission) {
  std::vector<std::string> jobs;
  for (const Submission::Array& array : submission.arrays) jobs.push_back(array.job);
  return jobs;
}

// Names of a plan's jobs. A cluster may forget jobs and use their numbers again; the names tell them apart.
std::string name_of_arrays(const std::string& plan) { return "marrow-" + plan; }
std::string name_of_gather(const std::string& plan) { return "marrow-gather-" + plan; }

/// The path of a job's log. Slurm replaces %j, %A and %a in it, but not in a path with a backslash.
std::string place_of_log(const ClusterPlan& plan, const std::string& name) {
  std::string place;
  for (const char c : plan.folder.string()) place += c == '%' ? "%%" : std::string(1, c);
  return place + "/log/" + name;
}

void expect_place_of_logs(const ClusterPlan& plan) {
  if (plan.folder.native().find('\\') != std::string::npos)
    throw Error("Slurm writes no logs into a folder with '\\' in its name, " + plan.folder.string() +
                "; choose another with --out");
}

std::string first_word(const std::string& text) {
  const std::size_t begin = text.find_first_not_of(" \n");
  return begin == std::string::npos ? "" : text.substr(begin, text.find_first_of(" ;\n", begin) - begin);
}

std::vector<std::string> sbatch(const ClusterPlan& plan, const ClusterProfile& profile, bool is_array) {
  std::vector<std::string> command{"sbatch", "--parsable", "--export=ALL",
                                   "--job-name=" + (is_array ? name_of_arrays(plan.id) : name_of_gather(plan.id))};
  const auto add = [&](const std::string& option, const std::string& value) {
    if (!value.empty() && value != "0") command.push_back(option + "=" + value);
  };
  add("--partition", profile.partition);
  add("--account", profile.account);
  add("--cpus-per-task", formatted("{}", profile.processors));
  add("--mem", formatted("{}", profile.memory_mb));
  add("--time", formatted("{}", profile.minutes));
  add("--output", place_of_log(plan, is_array ? "%A_%a.txt" : "%j.txt"));
  command.insert(command.end(), profile.options.begin(), profile.options.end());
  return command;
}

/// The script of an array: task N does the chunk on line N + 1 of a list.
fs::path write_array_script(const ClusterPlan& plan, const ClusterProfile& profile) {
  const fs::path file = plan.folder / "plans" / (plan.id + "-array.sh");
  write_text_file(file,
                  "#!/bin/sh\n# A task of a Slurm array. The first argument is a list of chunks.\n"
                  "chunk=$(sed -n \"$((SLURM_ARRAY_TASK_ID + 1))p\" \"$1\")\n"
                  "exec " +
                      script_word(write_chunk_script(plan, profile).string()) +
                      " \"$chunk\" --quiet --jobs \"${SLURM_CPUS_PER_TASK:-${SLURM_CPUS_ON_NODE:-1}}\"\n");
  return file;
}

class Submitter {
 public:
  Submitter(const ClusterPlan& plan, const ClusterProfile& profile) : plan_(plan), profile_(profile) {
    std::error_code error;
    fs::create_directories(plan.folder / "log", error);
    script_ = write_array_script(plan, profile);
  }

  /// An array of the chunks, which begins when `after` has ended. Arrays have at most most_tasks tasks.
  void add_arrays(const std::vector<Chunk>& chunks, const std::string& what, const std::vector<std::string>& after) {
    for (std::size_t begin = 0; begin < chunks.size(); begin += std::size_t(profile_.most_tasks)) {
      const std::vector<Chunk> part(
          chunks.begin() + std::ptrdiff_t(begin),
          chunks.begin() + std::ptrdiff_t(std::min(chunks.size(), begin + std::size_t(profile_.most_tasks))));
      const fs::path list = plan_.folder / "plans" / (formatted("{}-{}-{}.txt", plan_.id, what, done_.arrays.size()));
      write_list(list, part);
      std::vector<std::string> command = sbatch(plan_, profile_, true);
      std::string range = formatted("--array=0-{}", part.size() - 1);
      if (profile_.most_at_once) range += formatted("%{}", profile_.most_at_once);
      command.push_back(range);
      add_dependency(command, after);
      command.insert(command.end(), {script_.string(), list.string()});
      Submission::Array array{first_word(said_by(command)), {}};
      for (const Chunk& chunk : part) array.chunks.push_back(chunk.name);
      done_.arrays.push_back(std::move(array));
    }
  }

  void add_gather(const fs::path& profile_file) {
    std::vector<std::string> more{"--on", "slurm"};
    if (!profile_file.empty()) more.insert(more.end(), {"--profile", fs::absolute(profile_file).string()});
    const fs::path file = write_gather_script(plan_, more);
    std::vector<std::string> command = sbatch(plan_, profile_, false);
    add_dependency(command, arrays_of(done_));
    command.push_back(file.string());
    done_.gather = first_word(said_by(command));
  }

  /// Ends what was submitted.
  void take_back() const {
    std::vector<std::string> command{"scancel"};
    if (!done_.gather.empty()) command.push_back(done_.gather);
    for (const std::string& job : arrays_of(done_)) command.push_back(job);
    if (command.size() > 1) ask(command);
  }

  Submission& done() { return done_; }

 private:
  static void add_dependency(std::vector<std::string>& command, const std::vector<std::string>& after) {
    if (after.empty()) return;
    command.push_back("--dependency=afterany:" + joined(after, ":"));
  }

  const ClusterPlan& plan_;
  const ClusterProfile& profile_;
  fs::path script_;
  Submission done_;
};

std::vector<Chunk> without_rows(const std::vector<Chunk>& chunks, const std::map<std::string, bool>& files) {
  std::vector<Chunk> left;
  for (const Chunk& chunk : chunks)
    if (const auto file = files.find(chunk.name); file == files.end() || !file->second) left.push_back(chunk);
  return left;
}

/// Lines "JOB_TASK STATE" of a program of Slurm. Nothing if it fails.
void add_states(const std::vector<std::string>& command, std::map<std::string, std::string>& states) {
  const ChildEnd end = ask(command);
  if (end.code != 0) return;
  std::istringstream lines(end.said);
  for (std::string task, state; lines >> task >> state; lines.ignore(10'000, '\n')) states.emplace(task, state);
}

std::string in_words(const std::string& state) {
  if (state == "TIMEOUT") return "the cluster's time limit was reached";
  if (state == "OUT_OF_MEMORY") return "it took more memory than the cluster allows";
  if (state == "PREEMPTED") return "the cluster gave its place to another job";
  if (state == "NODE_FAIL" || state == "BOOT_FAIL") return "its host failed";
  if (state.starts_with("CANCELLED")) return "it was cancelled";
  if (state == "FAILED") return "it ended with an error";
  return "its end is not known";
}

/// Whether nobody else ended the task, so it may have said itself why it ended.
bool ended_by_itself(const std::string& state) {
  return state == "FAILED" || state == "COMPLETED" || state == "UNKNOWN";
}

/// Why the task could not continue: the fault that marrow left, else the last line that the task printed.
std::string what_task_said(const fs::path& folder, const std::string& chunk, const fs::path& log) {
  std::string last = fault_of_chunk(folder, chunk);
  std::ifstream lines(last.empty() ? log : fs::path());
  for (std::string line; std::getline(lines, line);)
    if (line.find_first_not_of(" \t\r") != std::string::npos) last = line;
  return cut(last, kMostSaidBytes);
}

}  // namespace

std::optional<Submission> read_submission(const fs::path& folder) {
  const fs::path file = folder / "slurm.json";
  if (!fs::exists(file)) return std::nullopt;
  try {
    const json j = parse_json(read_text_file(file, kMostRecordBytes), file.string());
    Submission submission{j.at("plan"), j.at("tries"), {}, j.at("gather"), j.at("gathered"), j.at("lost")};
    for (const json& array : j.at("arrays")) submission.arrays.push_back({array.at("job"), array.at("chunks")});
    return submission;
  } catch (const std::exception& error) {
    throw Error(file.string() + " does not say what was submitted: " + error.what());
  }
}

void write_submission(const fs::path& folder, const Submission& submission) {
  json j = {{"plan", submission.plan},     {"tries", submission.tries},
            {"gather", submission.gather}, {"gathered", submission.is_gathered},
            {"lost", submission.lost},     {"arrays", json::array()}};
  for (const Submission::Array& array : submission.arrays)
    j["arrays"].push_back({{"job", array.job}, {"chunks", array.chunks}});
  write_text_file(folder / "slurm.json", j.dump(1) + "\n");
}

Submission submit(const ClusterPlan& plan, const ClusterProfile& profile, const fs::path& profile_file,
                  std::int64_t tries_before) {
  expect_place_of_logs(plan);
  const std::map<std::string, bool> files = chunk_files(plan.folder);
  Submitter submitter(plan, profile);
  submitter.done().plan = plan.id;
  submitter.done().tries = tries_before + 1;
  try {
    submitter.add_arrays(without_rows(plan.cases, files), "cases", {});
    submitter.add_arrays(without_rows(plan.cells, files), "cells", arrays_of(submitter.done()));
    submitter.add_gather(profile_file);
    write_submission(plan.folder, submitter.done());
  } catch (const Error&) {
    submitter.take_back();
    throw;
  }
  return submitter.done();
}

std::map<std::string, std::string> states_of(const Submission& submission) {
  const std::string jobs = joined(arrays_of(submission), ",");
  std::map<std::string, std::string> states;
  if (jobs.empty()) return states;
  add_states({"squeue", "--noheader", "--array", "--states=all", "--jobs=" + jobs, "--format=%F_%K %T"}, states);
  add_states({"sacct", "--noheader", "--allocations", "--array", "--jobs=" + jobs, "--format=JobID%40,State%20"},
             states);
  return states;
}

std::map<std::string, std::string> reasons_of(const ClusterPlan& plan, const Submission& submission) {
  const std::map<std::string, std::string> states = states_of(submission);
  std::map<std::string, std::string> reasons;
  for (const Submission::Array& array : submission.arrays)
    for (std::size_t i = 0; i < array.chunks.size(); ++i) {
      const std::string task = formatted("{}_{}", array.job, i), log = "log/" + task + ".txt";
      const auto state = states.find(task);
      const std::string name = state == states.end() ? "UNKNOWN" : state->second;
      const std::string said =
          ended_by_itself(name) ? what_task_said(plan.folder, array.chunks[i], plan.folder / log) : "";
      reasons[array.chunks[i]] = "task " + task + " of the cluster left no row: " + in_words(name) + " (" + name + ")" +
                                 (said.empty() ? "" : ": " + said) + "; see " + log;
    }
  return reasons;
}

Queue queue_of(const Submission& submission) {
  std::vector<std::string> jobs = arrays_of(submission);
  jobs.insert(jobs.begin(), submission.gather);
  const ChildEnd end =
      ask({"squeue", "--noheader", "--jobs=" + joined(jobs, ","),
           "--name=" + name_of_arrays(submission.plan) + "," + name_of_gather(submission.plan), "--format=%i %T %r"});
  Queue queue;
  // squeue says this if it is asked for one job only and no longer knows it.
  queue.is_known = end.code == 0 || end.said.find("Invalid job id") != std::string::npos;
  if (end.code != 0) queue.fault = end.stopped ? "squeue did not end" : without_end_of_line(end.said);
  std::istringstream lines(end.code == 0 ? end.said : "");
  for (std::string job, state, reason; lines >> job >> state && std::getline(lines >> std::ws, reason);) {
    queue.has_gather = queue.has_gather || job == submission.gather;
    if (state == "RUNNING" && job != submission.gather) queue.running.push_back(job);
    const bool is_held =
        reason.find("requeued held") != std::string::npos || reason.find("JobHeldAdmin") != std::string::npos;
    if (state == "PENDING" && is_held) queue.held = reason;
    if (state == "PENDING") queue.reasons.insert(reason);
  }
  return queue;
}

void end_task(const Submission& submission, const std::string& task) {
  ask({"scancel", "--name=" + name_of_arrays(submission.plan), task});
}

void cancel(const Submission& submission) {
  said_by({"scancel", "--name=" + name_of_gather(submission.plan)});  // first, because it would submit again
  said_by({"scancel", "--name=" + name_of_arrays(submission.plan)});
}

}  // namespace marrow::cli
