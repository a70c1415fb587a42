// SPDX-License-Identifier: Apache-2.0
// Writes a profile in the trace event format of Chrome: Duca and Sinclair, "Trace Event Format", 2016.
#include <unistd.h>

#include <algorithm>

#include "marrow/base/number_text.hpp"
#include "marrow/runtime/run/profile_record.hpp"

namespace marrow {
namespace {

using nlohmann::json;

std::string json_string(const std::string& text) {
  return json(text).dump(-1, ' ', false, json::error_handler_t::replace);
}

/// The format's times are in microseconds.
std::string microseconds(std::int64_t ns) {
  return formatted("{}{}.{:03}", ns < 0 ? "-" : "", std::abs(ns) / 1000, std::abs(ns) % 1000);
}

const char* name_of_kind(Profile::Kind kind) {
  static constexpr const char* kNames[] = {"node", "cached", "pass", "function", "store", "output"};
  return kNames[int(kind)];
}

std::string title_of(const std::string& node, const std::string& what) {
  if (node.empty() || what.empty()) return node + what;
  return node + ": " + what;
}

std::string metadata(const char* name, pid_t row, const std::string& arguments) {
  return formatted(R"({{"ph":"M","pid":{},"tid":{},"name":"{}","args":{{{}}}}})", ::getpid(), row, name, arguments);
}

}  // namespace

/// The main thread only waits, so the others are counted.
std::map<pid_t, std::string> Profile::Record::names_of_rows() const {
  std::map<pid_t, std::string> result{{::getpid(), "main thread"}};
  for (const pid_t thread : threads) result.try_emplace(thread, formatted("thread {}", result.size()));
  for (const Sample& sample : samples)
    for (const auto& [thread, ns] : sample.thread_ns)
      if (ns > 0) result.try_emplace(thread, formatted("thread {}", result.size()));
  return result;
}

std::string Profile::Record::text(const std::string& title) const {
  const std::scoped_lock lock(mutex);
  std::map<pid_t, std::string> row_names = names_of_rows();
  std::string text = "{\"displayTimeUnit\":\"ms\",\"traceEvents\":[\n";
  text += metadata("process_name", ::getpid(), "\"name\":" + json_string("marrow run " + title));
  for (const auto& [row, number] : rows) row_names.try_emplace(number, row);
  for (const auto& [row, name] : row_names)
    text += ",\n" + metadata("thread_name", row, "\"name\":" + json_string(name));

  std::vector<Kept> sorted = bars;
  std::sort(sorted.begin(), sorted.end(), [](const Kept& a, const Kept& b) {
    return std::tuple(a.row, a.begin_ns, -a.length_ns) < std::tuple(b.row, b.begin_ns, -b.length_ns);
  });
  for (const Kept& bar : sorted) {
    const Name& name = names[bar.name];
    const std::string shown = title_of(name.node, name.what) + (bar.item ? " (" + items[bar.item] + ")" : "");
    text += formatted(
        ",\n"
        R"({{"ph":"X","pid":{},"tid":{},"ts":{},"dur":{},)",
        ::getpid(), bar.row, microseconds(bar.begin_ns), microseconds(bar.length_ns));
    if (name.kind != Kind::pass) text += formatted(R"("tdur":{},)", microseconds(bar.thread_ns));
    text += formatted(R"("cat":"{}","name":{},"args":{{"node":{},"item":{}}}}})", name_of_kind(name.kind),
                      json_string(shown), json_string(name.node), json_string(items[bar.item]));
  }
  for (std::size_t i = 1; i < samples.size(); ++i) {
    std::string busy;
    for (const auto& [thread, ns] : samples[i].thread_ns) {
      const auto before = samples[i - 1].thread_ns.find(thread);
      const std::int64_t used = ns - (before == samples[i - 1].thread_ns.end() ? 0 : before->second);
      if (!row_names.contains(thread)) continue;
      busy += (busy.empty() ? "" : ",") + json_string(row_names.at(thread)) + ":" +
              fixed_number(double(used) / double(samples[i].at_ns - samples[i - 1].at_ns), 3);
    }
    text += formatted(
        ",\n"
        R"({{"ph":"C","pid":{},"tid":0,"ts":{},"name":"processors","args":{{{}}}}})",
        ::getpid(), microseconds(samples[i - 1].at_ns), busy);
  }
  text += "\n],\"marrow\":{\"sums\":[";
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (sums[i].calls == 0) continue;
    text += formatted(
        "{}\n"
        R"({{"kind":"{}","node":{},"what":{},"calls":{},"us":{},"own_us":{},"own_thread_us":{},)",
        text.ends_with('[') ? "" : ",", name_of_kind(names[i].kind), json_string(names[i].node),
        json_string(names[i].what), sums[i].calls, microseconds(sums[i].length_ns), microseconds(sums[i].own_ns),
        microseconds(sums[i].own_thread_ns));
    text += formatted(R"("process_us":{}}})", microseconds(sums[i].process_ns));
  }
  return text + formatted("\n],\"left_out\":{},\"us\":{}}}}}\n", missing_bars, microseconds(now_ns()));
}

}  // namespace marrow
