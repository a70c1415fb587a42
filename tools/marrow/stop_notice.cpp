// SPDX-License-Identifier: Apache-2.0
#include "stop_notice.hpp"

#include <chrono>
#include <cstdio>

#include "marrow/domain/printable.hpp"

namespace marrow::cli {
namespace {

constexpr std::chrono::milliseconds kBetweenLooks(100), kPatience(500);

}  // namespace

StopNotice::StopNotice(const std::atomic<bool>& stopped) : stopped_(stopped), thread_([this] { wait_and_say(); }) {}

StopNotice::~StopNotice() {
  {
    const std::scoped_lock lock(mutex_);
    is_over_ = true;
  }
  end_.notify_all();
  thread_.join();
}

void StopNotice::operator()(const RunEvent& event) {
  const std::string where = event.item.empty() ? event.node : event.node + " (" + event.item + ")";
  const std::scoped_lock lock(mutex_);
  if (event.kind == RunEvent::Kind::started) running_.insert(where);
  if (event.kind != RunEvent::Kind::finished && event.kind != RunEvent::Kind::failed) return;
  if (const auto found = running_.find(where); found != running_.end()) running_.erase(found);
}

void StopNotice::wait_and_say() {
  std::unique_lock lock(mutex_);
  const auto is_over = [this] { return is_over_; };
  while (!stopped_)
    if (end_.wait_for(lock, kBetweenLooks, is_over)) return;
  if (end_.wait_for(lock, kPatience, is_over)) return;
  std::string names;
  for (const std::string& one : running_) names += (names.empty() ? "" : ", ") + one;
  std::fprintf(stderr, "\nmarrow: stopping; it waits for what is running: %s. A second Ctrl-C ends it at once\n",
               names.empty() ? "its results are being written" : printable(names).c_str());
}

}  // namespace marrow::cli
