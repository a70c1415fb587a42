// SPDX-License-Identifier: Apache-2.0
#include "marrow/run/metrics_file.hpp"

#include <nlohmann/json.hpp>

#include "marrow/base/error.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/toolbox/files/input_file.hpp"

namespace marrow::run {
namespace {

using nlohmann::ordered_json;

constexpr std::uint64_t kMostBytes = 10'000'000;

[[noreturn]] void refuse(const std::filesystem::path& file, const std::string& why) {
  throw Error(file.filename().string() + " " + why +
              R"(; expected figures as {"name": 1.5} or {"name": {"value": 1.5, "unit": "mm"}})");
}

}  // namespace

std::string metrics_text(const Metrics& metrics) {
  ordered_json all = ordered_json::object();
  for (const Metric& metric : metrics.items) all[metric.name] = {{"value", metric.value}, {"unit", metric.unit}};
  return all.dump(1, ' ', false, ordered_json::error_handler_t::replace) + "\n";
}

Metrics read_metrics(const std::filesystem::path& file) {
  const ordered_json all = ordered_json::parse(files::read_text(file, kMostBytes), nullptr, false);
  if (!all.is_object()) refuse(file, "holds no JSON object");
  Metrics metrics;
  for (const auto& [name, given] : all.items()) {
    const bool has_unit = given.is_object() && given.contains("value");
    const ordered_json& value = has_unit ? given["value"] : given;
    const ordered_json unit = has_unit && given.contains("unit") ? given["unit"] : ordered_json("");
    if (name.empty() || !value.is_number() || !unit.is_string()) refuse(file, "has no number for " + in_quotes(name));
    metrics.items.push_back({name, value.get<double>(), unit.get<std::string>()});
  }
  if (metrics.items.empty()) refuse(file, "holds no figure");
  return metrics;
}

}  // namespace marrow::run
