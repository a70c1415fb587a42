// SPDX-License-Identifier: Apache-2.0
#pragma once
// Work that takes longer than a request. It runs in its own thread, and the page asks for its progress.
#include <atomic>
#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>

namespace marrow::workbench {

/// The reports of a running job. Methods may be called from several threads.
class Job {
 public:
  Job(std::string title, std::string command) : title_(std::move(title)), command_(std::move(command)) {}

  /// Set when the user wants it to stop.
  const std::atomic<bool>& stopped() const { return stopped_; }
  void stop() { stopped_ = true; }
  /// Adds an event for the page, such as {"event": "finished", "node": "edges"}.
  void tell(nlohmann::json event);
  /// "done" with a result, "failed" with a text, or "stopped".
  void end(const std::string& state, nlohmann::json result, const std::string& error);
  /// {title, command, state, events, next, result, error} with the events from number `since` on. Waits until there is
  /// something new, but at most `wait_ms`.
  nlohmann::json state(std::size_t since, int wait_ms) const;

 private:
  const std::string title_, command_;
  std::atomic<bool> stopped_ = false;
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  std::vector<nlohmann::json> events_;
  std::string state_ = "running", error_;
  nlohmann::json result_;
};

class Jobs {
 public:
  /// Stops all jobs and waits for them.
  ~Jobs();
  /// Starts a job in its own thread and returns its name. What `work` returns is the job's result; an exception makes
  /// it fail. `command` does the same in a shell, or is empty. Throws Error if too many jobs are running.
  std::string start(const std::string& title, const std::string& command, std::function<nlohmann::json(Job&)> work);
  /// Throws Error if there is no such job.
  std::shared_ptr<Job> find(const std::string& name) const;

 private:
  struct Running {
    std::shared_ptr<Job> job;
    std::thread thread;
    std::shared_ptr<std::atomic<bool>> is_over;
  };
  mutable std::mutex mutex_;
  std::map<std::string, Running> jobs_;
  int count_ = 0;
};

}  // namespace marrow::workbench
