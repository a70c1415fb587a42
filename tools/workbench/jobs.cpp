// SPDX-License-Identifier: Apache-2.0
#include "workbench/jobs.hpp"

#include <algorithm>
#include <chrono>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/base/reason_of_exception.hpp"

namespace marrow::workbench {
namespace {

using nlohmann::json;

constexpr std::size_t kMostEvents = 5000;  // later ones are dropped; only long sequences have so many
constexpr std::size_t kMostRunning = 8, kMostKept = 200;

}  // namespace

void Job::tell(json event) {
  const std::lock_guard lock(mutex_);
  if (events_.size() < kMostEvents) events_.push_back(std::move(event));
  changed_.notify_all();
}

void Job::end(const std::string& state, json result, const std::string& error) {
  const std::lock_guard lock(mutex_);
  state_ = state;
  result_ = std::move(result);
  error_ = error;
  changed_.notify_all();
}

json Job::state(std::size_t since, int wait_ms) const {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, std::chrono::milliseconds(wait_ms),
                    [&] { return state_ != "running" || events_.size() > since; });
  since = std::min(since, events_.size());
  return {
      {"title", title_},        {"command", command_},
      {"state", state_},        {"events", std::vector<json>(events_.begin() + std::ptrdiff_t(since), events_.end())},
      {"next", events_.size()}, {"result", result_},
      {"error", error_}};
}

Jobs::~Jobs() {
  for (auto& [name, running] : jobs_) running.job->stop();
  for (auto& [name, running] : jobs_) running.thread.join();
}

std::string Jobs::start(const std::string& title, const std::string& command, std::function<json(Job&)> work) {
  const std::lock_guard lock(mutex_);
  const auto running = std::count_if(jobs_.begin(), jobs_.end(), [](const auto& one) { return !*one.second.is_over; });
  if (std::size_t(running) >= kMostRunning) throw Error("too many jobs are running; stop one, or wait");
  for (auto one = jobs_.begin(); jobs_.size() >= kMostKept && one != jobs_.end();)
    if (*one->second.is_over) {
      one->second.thread.join();
      one = jobs_.erase(one);
    } else {
      ++one;
    }
  const auto job = std::make_shared<Job>(title, command);
  const auto is_over = std::make_shared<std::atomic<bool>>(false);
  const std::string name = formatted("{}", ++count_);
  std::thread thread([job, is_over, work = std::move(work)] {
    try {
      json result = work(*job);
      job->end(job->stopped() ? "stopped" : "done", std::move(result), "");
    } catch (...) {
      job->end(job->stopped() ? "stopped" : "failed", nullptr, printable_lines(reason_of_exception()));
    }
    *is_over = true;
  });
  jobs_.emplace(name, Running{job, std::move(thread), is_over});
  return name;
}

std::shared_ptr<Job> Jobs::find(const std::string& name) const {
  const std::lock_guard lock(mutex_);
  const auto found = jobs_.find(name);
  if (found == jobs_.end()) throw Error("there is no job " + in_quotes(printable(name)));
  return found->second.job;
}

}  // namespace marrow::workbench
