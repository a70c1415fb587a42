// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <climits>
#include <cmath>

#include "cell_parts.hpp"
#include "marrow/base/json_text.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/runtime/node/types.hpp"

namespace marrow::compare {
namespace {

using nlohmann::json;

json of(const std::optional<double>& value) { return value ? json(*value) : json(); }

/// A number, or nothing for null. Throws Error for anything else, and for a number that is not finite.
std::optional<double> number(const json& j, const std::string& what) {
  if (j.is_null()) return std::nullopt;
  if (!j.is_number() || !std::isfinite(j.get<double>())) throw Error(what + " is no number");
  return j.get<double>();
}

int count(const json& j, const std::string& what) { return int(integer_of(j, 0, INT_MAX, what)); }

const json& list_of(const json& row, const char* key, std::size_t size) {
  const json& list = row.at(key);
  if (!list.is_array() || list.size() != size) throw Error(formatted("'{}' must be a list of {}", key, size));
  return list;
}

std::string json_line(const json& j) { return j.dump(-1, ' ', false, json::error_handler_t::replace); }

/// Reads a row that has its own digest. The digest is left out of the result.
json written_row(const std::string& text) {
  json j = parse_json(text, "a cell's row");
  if (!j.is_object() || !j.contains("digest")) throw Error("it has no digest of itself");
  const json digest = std::move(j["digest"]);
  j.erase("digest");
  const std::string line = json_line(j);
  if (digest != hash_of_bytes(line.data(), line.size()).hex())
    throw Error("it is not what its digest is of: it was changed or damaged");
  return j;
}

void read_verdict(const json& j, CellRow& row) {
  const std::string name = j.at("verdict");
  row.verdict = judgement_named(name);
  if (!row.verdict || !row.failed.empty()) throw Error("'verdict' is no judgement, or of a cell that failed");
  row.failure_probability = number(j.at("failure_probability"), "'failure_probability'");
  if (row.failure_probability && !(*row.failure_probability >= 0 && *row.failure_probability <= 1))
    throw Error("'failure_probability' is not from 0 to 1");
  for (const auto& [place, figures] : j.at("verdict_figures").items()) {
    CellRow::Figures& read = row.verdict_figures[place];
    for (const auto& [name, value] : figures.items()) read[name] = number(value, "'" + name + "' of 'verdict_figures'");
  }
}

std::optional<double> if_finite(double value) { return std::isfinite(value) ? std::optional(value) : std::nullopt; }

void judge(CellPose& pose, const std::vector<NamedVerdict>& verdicts) {
  std::vector<NamedVerdict> own;
  for (const NamedVerdict& one : verdicts)
    if (one.item == pose.item || one.item.empty()) own.push_back(one);
  if (own.empty()) return;
  const Verdict worst = worst_of(own);
  pose.verdict = worst.judgement;
  pose.failure_probability = if_finite(worst.failure_probability);
}

CellPose cell_pose(const Pose& pose, const std::string& output, const std::string& item) {
  const RigidTransform& transform = pose.world_from_model;
  CellPose made{output, item, transform.target, transform.source, {}, {}, {}, {}, pose.frame.is_anatomical};
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column)
      made.matrix[std::size_t(4 * row + column)] = transform.rotation(row, column);
    made.matrix[std::size_t(4 * row + 3)] = transform.translation_mm[row];
  }
  for (int i = 0; pose.covariance && i < 6; ++i) {
    const double deviation = std::sqrt((*pose.covariance)(i, i));
    made.deviations.push_back(if_finite(i < 3 ? degrees(deviation) : deviation));
  }
  return made;
}

json number_or_null(const std::optional<double>& value) { return value ? json(*value) : json(); }

double finite_number(const json& j) {
  if (!j.is_number() || !std::isfinite(j.get<double>())) throw Error("a number of 'poses' is none");
  return j.get<double>();
}

std::optional<double> finite_or_null(const json& j) {
  return j.is_null() ? std::nullopt : std::optional(finite_number(j));
}

}  // namespace

bool CellRow::is_success(const Experiment& experiment) const {
  if (!failed.empty()) return false;
  for (std::size_t i = 0; i < experiment.metrics.size() && i < values.size(); ++i)
    if (const MetricChoice& metric = experiment.metrics[i]; metric.limit)
      if (!values[i] || !(metric.higher_is_better() ? *values[i] > *metric.limit : *values[i] < *metric.limit))
        return false;
  return true;
}

std::string to_json(const CellRow& row) {
  json j = {{"id", row.id},
            {"variant", row.variant},
            {"case", row.case_name},
            {"start", row.start},
            {"status", row.failed.empty() ? "done" : "failed"},
            {"tries", row.tries},
            {"values", json::array()},
            {"units", row.units},
            {"initial_error", of(row.initial_error)},
            {"initial_error_unit", row.initial_error_unit},
            {"seconds", of(row.seconds)},
            {"evaluations", row.evaluations},
            {"nodes", json::object()},
            {"key", row.key}};
  if (!row.failed.empty()) j["reason"] = row.failed;
  if (row.lacks_figure) j["lacks_figure"] = true;
  if (!row.absent.empty()) j["absent"] = row.absent;
  if (row.verdict) j["verdict"] = name_of(*row.verdict);
  if (row.verdict) j["failure_probability"] = of(row.failure_probability);
  if (row.verdict) j["verdict_figures"] = json::object();
  for (const auto& [place, figures] : row.verdict_figures) {
    json& written = j["verdict_figures"][place] = json::object();
    for (const auto& [name, value] : figures) written[name] = of(value);
  }
  j["poses"] = poses_json(row.poses);
  for (const auto& value : row.values) j["values"].push_back(of(value));
  for (const auto& [name, calls] : row.nodes)
    j["nodes"][name] = {{"made", calls.made}, {"cached", calls.cached}, {"seconds", calls.seconds}};
  const std::string line = json_line(j);
  j["digest"] = hash_of_bytes(line.data(), line.size()).hex();
  return json_line(j);
}

std::string fault_of_written_row(const std::string& text) {
  try {
    written_row(text);
    return "";
  } catch (const std::exception& error) {
    return error.what();
  }
}

CellRow row_from_json(const std::string& text, const Experiment& experiment) {
  try {
    const json j = written_row(text);
    const std::size_t metrics = experiment.metrics.size();
    CellRow row;
    if (j.contains("reason")) row.failed = j.at("reason");
    if (j.contains("lacks_figure")) row.lacks_figure = j.at("lacks_figure");
    if (j.contains("absent")) row.absent = j.at("absent");
    if (row.failed.empty() != (j.at("status") == "done")) throw Error("'status' and 'reason' do not agree");
    row.tries = count(j.at("tries"), "'tries'");
    for (const json& value : list_of(j, "values", metrics)) {
      row.values.push_back(number(value, "an item of 'values'"));
      if (row.values.back() ? !row.failed.empty() : row.failed.empty() && row.absent.empty())
        throw Error("a cell that is done has all values, one that failed has none");
    }
    for (const json& unit : list_of(j, "units", metrics)) row.units.push_back(unit);
    row.initial_error = number(j.at("initial_error"), "'initial_error'");
    const bool is_as_wanted = row.initial_error.has_value() != experiment.initial_error.empty();
    if (row.failed.empty() && !is_as_wanted && (row.initial_error || row.absent.empty()))
      throw Error("'initial_error' is there where the experiment has none, or is not there");
    row.initial_error_unit = j.at("initial_error_unit");
    row.seconds = number(j.at("seconds"), "'seconds'");
    row.evaluations = count(j.at("evaluations"), "'evaluations'");
    for (const auto& [name, calls] : j.at("nodes").items())
      row.nodes[name] = {count(calls.at("made"), "'made'"), count(calls.at("cached"), "'cached'"),
                         number(calls.at("seconds"), "'seconds'").value_or(0)};
    if (j.contains("verdict")) read_verdict(j, row);
    row.poses = poses_from_json(j.at("poses"));
    row.key = j.at("key");
    return row;
  } catch (const std::exception& error) {
    throw Error(std::string("not a cell's row: ") + error.what());
  }
}

void name_row(CellRow& row, const Experiment& experiment, const CellIndex& cell) {
  row.id = cell_id(experiment, cell);
  row.variant = experiment.variants[cell.variant].name;
  row.case_name = experiment.cases[cell.case_index].name;
  row.start = experiment.starts[cell.start].name;
}

CellRow failed_row(const Experiment& experiment, const CellIndex& cell, const std::string& reason, int tries) {
  CellRow row;
  name_row(row, experiment, cell);
  row.failed = reason;
  row.tries = tries;
  row.values.resize(experiment.metrics.size());
  row.units.resize(experiment.metrics.size());
  return row;
}

std::vector<CellPose> poses_of(const Pipeline& pipeline, const RunResult& result,
                               const std::vector<NamedVerdict>& verdicts) {
  std::vector<CellPose> poses;
  for_each_item(pipeline, result, TypeInfo::of<Pose>(),
                [&](const std::string& output, const std::string& item, const Value& value) {
                  poses.push_back(cell_pose(value.as<Pose>(), output, item));
                });
  for (CellPose& pose : poses) judge(pose, verdicts);
  return poses;
}

json poses_json(const std::vector<CellPose>& poses) {
  json all = json::array();
  for (const CellPose& pose : poses) {
    json deviations = json::array();
    for (const auto& deviation : pose.deviations) deviations.push_back(number_or_null(deviation));
    all.push_back({{"output", pose.output},
                   {"item", pose.item},
                   {"target", pose.target},
                   {"source", pose.source},
                   {"matrix", pose.matrix},
                   {"verdict", pose.verdict ? json(name_of(*pose.verdict)) : json()},
                   {"failure_probability", number_or_null(pose.failure_probability)},
                   {"deviations", deviations},
                   {"has_bone_axes", pose.has_bone_axes}});
  }
  return all;
}

std::vector<CellPose> poses_from_json(const json& all) {
  if (!all.is_array()) throw Error("'poses' must be a list");
  std::vector<CellPose> poses;
  for (const json& one : all) {
    CellPose& pose = poses.emplace_back();
    pose.output = one.at("output");
    pose.item = one.at("item");
    pose.target = one.at("target");
    pose.source = one.at("source");
    const json& matrix = one.at("matrix");
    if (!matrix.is_array() || matrix.size() != pose.matrix.size())
      throw Error("a matrix of 'poses' has not 12 numbers");
    std::transform(matrix.begin(), matrix.end(), pose.matrix.begin(), finite_number);
    if (!one.at("verdict").is_null() && !(pose.verdict = judgement_named(one.at("verdict").get<std::string>())))
      throw Error("a verdict of 'poses' is no judgement");
    pose.failure_probability = finite_or_null(one.at("failure_probability"));
    for (const json& deviation : one.at("deviations")) pose.deviations.push_back(finite_or_null(deviation));
    if (!pose.deviations.empty() && pose.deviations.size() != 6)
      throw Error("the deviations of a pose are not 6 numbers");
    pose.has_bone_axes = one.at("has_bone_axes");
  }
  return poses;
}

}  // namespace marrow::compare
