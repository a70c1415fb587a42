// SPDX-License-Identifier: Apache-2.0
#include "cluster/follow.hpp"

#include <algorithm>
#include <atomic>
#include <charconv>
#include <chrono>
#include <cstdio>
#include <set>
#include <thread>

#include "cluster/chunk_rows.hpp"
#include "cluster/slurm.hpp"
#include "compare/progress.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "process.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;
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

}  // namespace

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

std::string progress_of(const ClusterPlan& plan) {
  const auto [chunks, cells] = made_of(plan.cells, chunk_files(plan.folder));
  return formatted("{} of {} cells in {} of {} chunks", cells, cells_of_plan(plan), chunks, plan.cells.size());
}

int follow(const ClusterPlan& plan, const ClusterProfile& profile, bool quiet) {
  return Follower(plan, profile, quiet).run();
}

}  // namespace marrow::cli
