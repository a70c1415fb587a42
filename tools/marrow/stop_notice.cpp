// SPDX-License-Identifier: Apache-2.0
#include "stop_notice.hpp"

#include "marrow/base/printable.hpp"
#include "process.hpp"

namespace marrow::cli {

StopNotice::~StopNotice() { say_when_stopped(""); }

void StopNotice::operator()(const RunEvent& event) {
  const std::string where = event.item.empty() ? event.node : event.node + " (" + event.item + ")";
  const bool has_ended = event.kind == RunEvent::Kind::finished || event.kind == RunEvent::Kind::failed;
  if (event.kind != RunEvent::Kind::started && !has_ended) return;
  const std::scoped_lock lock(mutex_);
  if (!has_ended)
    running_.insert(where);
  else if (const auto found = running_.find(where); found != running_.end())
    running_.erase(found);
  std::string names;
  for (const std::string& one : running_) names += (names.empty() ? "" : ", ") + one;
  say_when_stopped(names.empty() ? ""
                                 : "marrow: stopping; it waits for what is running: " + printable(names) +
                                       ". A second Ctrl-C ends it at once");
}

}  // namespace marrow::cli
