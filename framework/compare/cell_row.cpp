// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <nlohmann/json.hpp>

#include "marrow/compare/cell.hpp"

namespace marrow::compare {
namespace {

using nlohmann::json;

json of(const std::optional<double>& value) { return value ? json(*value) : json(); }
std::optional<double> number(const json& j) { return j.is_number() ? std::optional(j.get<double>()) : std::nullopt; }

}  // namespace

bool CellRow::is_success(const Experiment& experiment) const {
  if (!failed.empty()) return false;
  for (std::size_t i = 0; i < experiment.metrics.size() && i < values.size(); ++i)
    if (const MetricChoice& metric = experiment.metrics[i]; metric.limit)
      if (!values[i] || !(metric.higher_is_better() ? *values[i] > *metric.limit : *values[i] < *metric.limit)) return false;
  return true;
}

std::string to_json(const CellRow& row) {
  json j = {{"id", row.id}, {"variant", row.variant}, {"case", row.case_name}, {"start", row.start}, {"status", row.failed.empty() ? "done" : "failed"},
            {"tries", row.tries}, {"values", json::array()}, {"units", row.units}, {"initial_error", of(row.initial_error)},
            {"seconds", of(row.seconds)}, {"evaluations", row.evaluations}, {"nodes", json::object()}, {"key", row.key}};
  if (!row.failed.empty()) j["reason"] = row.failed;
  for (const auto& value : row.values) j["values"].push_back(of(value));
  for (const auto& [name, calls] : row.nodes) j["nodes"][name] = {{"made", calls.made}, {"cached", calls.cached}, {"seconds", calls.seconds}};
  return j.dump(-1, ' ', false, json::error_handler_t::replace);
}

CellRow row_from_json(const std::string& text) {
  try {
    const json j = json::parse(text);
    CellRow row;
    row.id = j.at("id");
    row.variant = j.at("variant");
    row.case_name = j.at("case");
    row.start = j.at("start");
    row.failed = j.value("reason", "");
    row.tries = j.at("tries");
    for (const json& value : j.at("values")) row.values.push_back(number(value));
    row.units = j.at("units").get<std::vector<std::string>>();
    row.initial_error = number(j.at("initial_error"));
    row.seconds = number(j.at("seconds"));
    row.evaluations = j.at("evaluations");
    for (const auto& [name, calls] : j.at("nodes").items()) row.nodes[name] = {calls.at("made"), calls.at("cached"), calls.at("seconds")};
    row.key = j.at("key");
    return row;
  } catch (const json::exception& error) {
    throw Error(std::string("not a cell's row: ") + error.what());
  }
}

}  // namespace marrow::compare
