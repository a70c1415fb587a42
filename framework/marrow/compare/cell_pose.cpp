// SPDX-License-Identifier: Apache-2.0
#include "marrow/compare/cell_pose.hpp"

#include <algorithm>
#include <cmath>

#include "cell_parts.hpp"
#include "marrow/base/error.hpp"
#include "marrow/runtime/node/types.hpp"
#include "marrow/runtime/run/output_items.hpp"

namespace marrow::compare {
namespace {

using nlohmann::json;

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
