// SPDX-License-Identifier: Apache-2.0
// What commands print: events, notes, verdicts and the most important results.
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "commands.hpp"
#include "marrow/base/json_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/runtime/node/types.hpp"
#include "marrow/runtime/store/shared_store.hpp"

namespace marrow::cli {
namespace {

void print_pose(const std::string& name, const Pose& pose) {
  const RigidTransform& t = pose.world_from_model;
  std::printf("%s: %s_from_%s\n", printable(name).c_str(), printable(t.target).c_str(), printable(t.source).c_str());
  for (int row = 0; row < 3; ++row)
    std::printf("    %10.6f %10.6f %10.6f   %10.4f mm\n", t.rotation(row, 0), t.rotation(row, 1), t.rotation(row, 2),
                t.translation_mm[row]);
  if (pose.covariance) {
    const Vector6d sd = pose.covariance->diagonal().cwiseSqrt();
    std::printf("    predicted standard deviation about and along the %s axes: %.3f %.3f %.3f deg, %.3f %.3f %.3f mm\n",
                pose.frame.is_anatomical ? "frontal, lateral and long" : "x, y and z", degrees(sd[0]), degrees(sd[1]),
                degrees(sd[2]), sd[3], sd[4], sd[5]);
  }
  for (const std::string& warning : pose.warnings) std::printf("    warning: %s\n", printable_lines(warning).c_str());
}

/// One row per figure, one column per item. So the stages of a registration are side by side.
void print_metrics(const std::string& name, const std::vector<std::string>& columns,
                   const std::vector<const Metrics*>& items) {
  std::vector<const Metric*> rows;  // the first metric of each name
  for (const Metrics* item : items)
    for (const Metric& metric : item->items)
      if (std::none_of(rows.begin(), rows.end(), [&](const Metric* row) { return row->name == metric.name; }))
        rows.push_back(&metric);
  std::printf("%-34s", (printable(name) + ":").c_str());
  for (const std::string& column : columns) std::printf(" %10s", printable(column).c_str());
  std::printf("\n");
  for (const Metric* row : rows) {
    std::printf("    %-30s", printable(row->name).c_str());
    for (const Metrics* item : items) {
      const auto found = std::find_if(item->items.begin(), item->items.end(),
                                      [&](const Metric& metric) { return metric.name == row->name; });
      if (found == item->items.end())
        std::printf(" %10s", "");
      else
        std::printf(" %10.4f", found->value);
    }
    std::printf(" %s\n", printable(row->unit).c_str());
  }
}

void say_note_in_lines(const std::string& text) {
  if (!text.empty()) std::fprintf(stderr, "marrow: note: %s\n", printable_lines(text).c_str());
}

}  // namespace

std::string place_of(const RunEvent& event) {
  return event.item.empty() ? event.node : event.node + " (" + event.item + ")";
}

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

bool can_keep_results(const std::string& fault_of_store, bool quiet) {
  if (!fault_of_store.empty() && !quiet)
    std::fprintf(stderr, "marrow: note: results are not kept: %s\n", printable_lines(fault_of_store).c_str());
  return fault_of_store.empty();
}

void say_if_not_shared(const Store& store, bool quiet) {
  const std::string fault = store.shared() && !quiet ? store.shared()->fault() : "";
  if (!fault.empty()) say_note_in_lines("the shared store is not used: " + fault);
}

void say_complaint(const Store& store) {
  if (store.shared()) say_note_in_lines(store.shared()->complaint());
}

void say_note(const std::string& text) { std::fprintf(stderr, "marrow: note: %s\n", printable(text).c_str()); }

void print_as_json(const nlohmann::json& value, int indent) { std::printf("%s\n", json_text(value, indent).c_str()); }

void print_verdicts(const std::vector<NamedVerdict>& verdicts) {
  static constexpr const char* kColours[] = {"\033[32m", "\033[33m", "\033[31m"};  // green, yellow, red
  const bool is_terminal = isatty(STDOUT_FILENO);
  for (const NamedVerdict& one : verdicts) {
    std::string judgement = name_of(one.verdict.judgement);
    for (char& c : judgement) c = char(std::toupper(static_cast<unsigned char>(c)));
    std::printf("%s%s: %s%s%s (failure %s)\n", printable(one.output).c_str(),
                one.item.empty() ? "" : ("  " + printable(one.item)).c_str(),
                is_terminal ? kColours[int(one.verdict.judgement)] : "", judgement.c_str(),
                is_terminal ? "\033[0m" : "", probability_text(one.verdict.failure_probability).c_str());
    for (const std::string& reason : one.verdict.reasons) std::printf("    %s\n", printable_lines(reason).c_str());
    for (const std::string& remedy : one.verdict.remedies)
      std::printf("    would settle it: %s\n", printable_lines(remedy).c_str());
  }
  if (!verdicts.empty()) std::printf("\n");
}

void print_value(const std::string& name, const Value& value) {
  std::vector<const Metrics*> metrics;
  std::vector<std::string> columns;
  for (std::size_t i = 0; i < value.items.size(); ++i) {
    if (value.items[i].data && value.type == TypeInfo::of<Metrics>()) {
      metrics.push_back(&value.items[i].as<Metrics>());
      columns.push_back(value.names[i]);
    } else {
      print_value(name + " " + value.names[i], value.items[i]);
    }
  }
  if (!metrics.empty()) print_metrics(name, columns, metrics);
  if (!value.data) return;
  if (value.type == TypeInfo::of<Pose>()) print_pose(name, value.as<Pose>());
  if (value.type == TypeInfo::of<Metrics>()) print_metrics(name, {""}, {&value.as<Metrics>()});
}

void print_results(const Pipeline& pipeline, const RunResult& result) {
  for (const PipelineOutput& output : pipeline.outputs) print_value(output.name, value_of(result, output.source));
  std::printf("\n");
}

}  // namespace marrow::cli
