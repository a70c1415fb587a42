// SPDX-License-Identifier: Apache-2.0
#include "pool.hpp"

#include <poll.h>

#include <algorithm>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <utility>

#include "marrow/base/no_process.hpp"
#include "marrow/runtime/process/worker.hpp"

namespace marrow::cli {
namespace {

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

bool run_jobs(std::vector<Job> jobs, const PoolSettings& settings,
              const std::function<void(const Job&, const JobEnd&)>& ended) {
  return Pool(std::move(jobs), settings, ended).run();
}

}  // namespace marrow::cli
