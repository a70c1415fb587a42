// SPDX-License-Identifier: Apache-2.0
#include "run_event.hpp"

#include "marrow/runtime/run/run_log.hpp"

namespace marrow::cli {

nlohmann::json json_of(const RunEvent& event) {
  using Kind = RunEvent::Kind;
  static constexpr const char* kNames[] = {"started", "progress", "finished", "failed",  "skipped",
                                           "message", "warning",  "cached",   "waiting", "waited"};
  nlohmann::json j = {{"event", kNames[int(event.kind)]}, {"node", event.node}};
  if (!event.item.empty()) j["item"] = event.item;
  if (!event.text.empty()) j["text"] = event.text;
  if (event.kind == Kind::message || event.kind == Kind::warning || event.kind == Kind::failed)
    j["level"] = level_name(event.level);
  if (event.kind == Kind::progress) j["fraction"] = event.fraction;
  if (event.kind == Kind::finished || event.kind == Kind::cached) j["seconds"] = event.seconds;
  return j;
}

}  // namespace marrow::cli
