// SPDX-License-Identifier: Apache-2.0
#include <cstdio>

#include "commands.hpp"
#include "marrow/runtime/types.hpp"

namespace marrow::cli {
namespace {

void print_pose(const std::string& name, const Pose& pose) {
  const RigidTransform& t = pose.world_from_model;
  std::printf("%s: %s_from_%s\n", name.c_str(), t.target.c_str(), t.source.c_str());
  for (int row = 0; row < 3; ++row)
    std::printf("    %10.6f %10.6f %10.6f   %10.4f mm\n", t.rotation(row, 0), t.rotation(row, 1), t.rotation(row, 2), t.translation_mm[row]);
  if (pose.covariance) {
    const Vector6d sd = pose.covariance->diagonal().cwiseMax(0).cwiseSqrt();
    std::printf("    predicted standard deviation about and along the frontal, lateral and long axes: %.3f %.3f %.3f deg, %.3f %.3f %.3f mm\n",
                degrees(sd[0]), degrees(sd[1]), degrees(sd[2]), sd[3], sd[4], sd[5]);
  }
  for (const std::string& warning : pose.warnings) std::printf("    warning: %s\n", warning.c_str());
}

void print_metrics(const std::string& name, const Metrics& metrics) {
  std::printf("%s:\n", name.c_str());
  for (const Metric& metric : metrics.items) std::printf("    %-34s %10.4f %s\n", metric.name.c_str(), metric.value, metric.unit.c_str());
}

void print_value(const std::string& name, const Value& value) {
  for (std::size_t i = 0; i < value.items.size(); ++i) print_value(name + " " + value.names[i], value.items[i]);
  if (!value.data) return;
  if (value.type == TypeInfo::of<Pose>()) print_pose(name, value.as<Pose>());
  if (value.type == TypeInfo::of<Metrics>()) print_metrics(name, value.as<Metrics>());
}

}  // namespace

void print_results(const Pipeline& pipeline, const RunResult& result) {
  for (const PipelineOutput& output : pipeline.outputs) print_value(output.name, value_of(result, output.source));
  std::printf("\n");
}

}  // namespace marrow::cli
