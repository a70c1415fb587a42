// SPDX-License-Identifier: Apache-2.0
#include "pool.hpp"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <deque>
#include <fstream>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <utility>

#include "marrow/domain/error.hpp"

namespace marrow::cli {
namespace {

using Clock = std::chrono::steady_clock;

/// A child process that reads lines and writes lines.
class Worker {
 public:
  explicit Worker(const std::vector<std::string>& command) {
    int to[2], from[2];
    if (pipe2(to, O_CLOEXEC) || pipe2(from, O_CLOEXEC)) throw Error(std::string("cannot start a worker: ") + std::strerror(errno));
    process_ = fork();
    if (process_ < 0) throw Error(std::string("cannot start a worker: ") + std::strerror(errno));
    if (process_ == 0) {
      prctl(PR_SET_PDEATHSIG, SIGKILL);  // a worker does not outlive the comparison, however that ends
      dup2(to[0], STDIN_FILENO);
      dup2(from[1], STDOUT_FILENO);
      std::vector<char*> arguments;
      for (const std::string& part : command) arguments.push_back(const_cast<char*>(part.c_str()));
      arguments.push_back(nullptr);
      execv(arguments[0], arguments.data());
      _exit(127);
    }
    close(to[0]);
    close(from[1]);
    input_ = to[1];
    output_ = from[0];
  }
  ~Worker() {
    if (input_ >= 0) close(input_);
    close(output_);
    if (process_ > 0) {
      if (job) kill(process_, SIGKILL);
      waitpid(process_, nullptr, 0);
    }
  }
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  void start(Job next) {
    job = std::move(next);
    ++job->tries;
    at_.clear();
    started_ = Clock::now();
    const std::string line = job->line + "\n";
    if (write(input_, line.data(), line.size()) < 0) close(std::exchange(input_, -1));  // it has ended, which the next read shows
  }

  int output() const { return output_; }
  double seconds() const { return std::chrono::duration<double>(Clock::now() - started_).count(); }
  double memory_mb() const {
    std::ifstream stream("/proc/" + std::to_string(process_) + "/statm");
    double total = 0, resident = 0;
    stream >> total >> resident;
    return resident * double(sysconf(_SC_PAGESIZE)) / 1e6;
  }

  /// Reads what is there. True when the job's answer is complete or the process has ended; `end` says which.
  bool read_some(JobEnd& end) {
    char buffer[65536];
    const ssize_t count = read(output_, buffer, sizeof buffer);
    if (count <= 0) {
      end.failed = death();
      return true;
    }
    text_.append(buffer, std::size_t(count));
    for (std::size_t newline; (newline = text_.find('\n')) != std::string::npos;) {
      const std::string line = text_.substr(0, newline);
      text_.erase(0, newline + 1);
      if (line.starts_with("at ")) at_ = line.substr(3);
      if (!line.starts_with("end ")) continue;
      end.answer = line.substr(4);
      return true;
    }
    return false;
  }

  void stop() {
    kill(process_, SIGKILL);
    waitpid(process_, nullptr, 0);
    process_ = -1;
  }
  bool is_dead() const { return process_ < 0; }
  std::string where() const { return at_.empty() ? "" : " in " + at_; }

  std::optional<Job> job;

 private:
  std::string death() {
    int status = 0;
    waitpid(process_, &status, 0);
    process_ = -1;
    if (WIFSIGNALED(status)) return std::string("crashed") + where() + ": " + strsignal(WTERMSIG(status));
    return "ended" + where() + " with exit code " + std::to_string(WEXITSTATUS(status));
  }

  pid_t process_ = -1;
  int input_ = -1, output_ = -1;
  std::string text_, at_;
  Clock::time_point started_;
};

/// What is still to do, by groups, and who is at it.
class Pool {
 public:
  Pool(std::vector<Job> jobs, const PoolSettings& settings, const std::function<void(const Job&, const JobEnd&)>& ended)
      : waiting_(std::make_move_iterator(jobs.begin()), std::make_move_iterator(jobs.end())), settings_(settings), ended_(ended) {}

  bool run() {
    signal(SIGPIPE, SIG_IGN);
    while (!waiting_.empty() || !again_.empty() || is_busy()) {
      if (settings_.cancelled && settings_.cancelled->load()) return false;
      give_work();
      std::vector<pollfd> polled;
      for (const auto& worker : workers_) polled.push_back({worker->output(), POLLIN, 0});
      poll(polled.data(), nfds_t(polled.size()), 50);
      for (std::size_t i = 0; i < polled.size(); ++i) look_after(*workers_[i], polled[i].revents != 0);
      std::erase_if(workers_, [](const auto& worker) { return worker->is_dead(); });
    }
    return true;
  }

 private:
  bool is_busy() const {
    for (const auto& worker : workers_)
      if (worker->job) return true;
    return false;
  }

  void give_work() {
    // What failed by its process is tried again when nothing else runs that could have been the cause, or suffer from it.
    const bool alone = waiting_.empty();
    if (alone && is_busy()) return;
    std::deque<Job>& source = alone ? again_ : waiting_;
    const std::size_t most = alone ? 1 : std::size_t(std::max(1, settings_.workers));
    while (!source.empty()) {
      Worker* free = nullptr;
      for (const auto& worker : workers_)
        if (!worker->job) free = worker.get();
      if (alone && is_busy()) return;
      if (!free) {
        if (workers_.size() >= most) return;
        free = workers_.emplace_back(std::make_unique<Worker>(settings_.command)).get();
      }
      std::optional<Job> next = next_for(*free, source);
      if (!next) return;
      free->start(std::move(*next));
    }
  }

  /// A job of the group that the worker was at; else of one that no other worker is at; else of one whose first job is done:
  /// until then the others would only make once more what the group has in common.
  std::optional<Job> next_for(Worker& worker, std::deque<Job>& source) {
    std::string& mine = groups_[&worker];
    auto chosen = std::find_if(source.begin(), source.end(), [&](const Job& job) { return job.group == mine && may_start(job); });
    if (chosen == source.end()) chosen = std::find_if(source.begin(), source.end(), [&](const Job& job) { return !is_at_work(job.group); });
    if (chosen == source.end()) chosen = std::find_if(source.begin(), source.end(), [&](const Job& job) { return may_start(job); });
    if (chosen == source.end()) return std::nullopt;
    Job job = std::move(*chosen);
    source.erase(chosen);
    mine = job.group;
    return job;
  }

  bool may_start(const Job& job) const { return begun_.contains(job.group) || !is_at_work(job.group); }
  bool is_at_work(const std::string& group) const {
    return std::any_of(workers_.begin(), workers_.end(), [&](const auto& worker) { return worker->job && worker->job->group == group; });
  }

  void look_after(Worker& worker, bool can_read) {
    JobEnd end;
    bool over = can_read && worker.read_some(end);
    if (!over && worker.job) {
      if (worker.seconds() > settings_.time_limit_s) {
        char text[80];
        std::snprintf(text, sizeof text, " took longer than %g s", settings_.time_limit_s);
        end.failed = "its process" + worker.where() + text;
      } else if (worker.memory_mb() > settings_.memory_limit_mb) {
        char text[80];
        std::snprintf(text, sizeof text, " used more than %g MB of memory", settings_.memory_limit_mb);
        end.failed = "its process" + worker.where() + text;
      }
      if (!end.failed.empty()) {
        worker.stop();
        over = true;
      }
    }
    if (!over || !worker.job) return;
    Job job = std::move(*worker.job);
    worker.job.reset();
    end.tries = job.tries;
    begun_.insert(job.group);
    if (!end.failed.empty() && job.tries < 2) again_.push_back(std::move(job));
    else ended_(job, end);
  }

  std::deque<Job> waiting_, again_;
  const PoolSettings& settings_;
  const std::function<void(const Job&, const JobEnd&)>& ended_;
  std::vector<std::unique_ptr<Worker>> workers_;
  std::map<const Worker*, std::string> groups_;
  std::set<std::string> begun_;  ///< groups of which a job has ended
};

}  // namespace

bool run_jobs(std::vector<Job> jobs, const PoolSettings& settings, const std::function<void(const Job&, const JobEnd&)>& ended) {
  return Pool(std::move(jobs), settings, ended).run();
}

}  // namespace marrow::cli
