// SPDX-License-Identifier: Apache-2.0
// The poses of all cells: poses.csv and poses.jsonl.
#include <array>
#include <nlohmann/json.hpp>

#include "compare/comparison.hpp"
#include "compare/csv.hpp"
#include "marrow/base/json_text.hpp"
#include "marrow/base/number_text.hpp"

namespace marrow::cli {
namespace {

using compare::CellPose;
using compare::CellRow;
using compare::Experiment;
using nlohmann::json;

constexpr std::array kRotations{"frontal", "lateral", "axial"};
constexpr std::array kTranslations{"along_frontal", "along_lateral", "along"};

/// Seeds of the cases that have one, by the case's name.
std::map<std::string, std::uint64_t> seeds_of(const Experiment& experiment) {
  std::map<std::string, std::uint64_t> seeds;
  for (const compare::ExperimentCase& one : experiment.cases)
    if (one.is_simulated || one.folder.empty()) seeds[one.name] = one.seed;
  return seeds;
}

std::string head() {
  std::string text = "cell,case,variant,start,seed,output,item,target,source";
  for (const char row : {'1', '2', '3'})
    for (const char* end : {"1", "2", "3", "4_mm"}) text += std::string(",m") + row + end;
  text += ",verdict,failure_probability,axes";
  for (const char* axis : kRotations) text += std::string(",predicted_") + axis + "_deg";
  for (const char* axis : kTranslations) text += std::string(",predicted_") + axis + "_mm";
  return text + "\n";
}

const char* axes_of(const CellPose& pose) {
  return pose.deviations.empty() ? "" : pose.has_bone_axes ? "bone" : "model";
}

}  // namespace

std::string poses_csv(const Experiment& experiment, const std::vector<CellRow>& rows) {
  const auto seeds = seeds_of(experiment);
  std::string text = head();
  for (const CellRow& row : rows)
    for (const CellPose& pose : row.poses) {
      const auto seed = seeds.find(row.case_name);
      text += csv_field(row.id) + "," + csv_field(row.case_name) + "," + csv_field(row.variant) + "," +
              csv_field(row.start) + "," + (seed == seeds.end() ? "" : formatted("{}", seed->second));
      for (const std::string& name : {pose.output, pose.item, pose.target, pose.source}) text += "," + csv_field(name);
      for (const double number : pose.matrix) text += "," + exact_number(number);
      text += formatted(",{},{},{}", pose.verdict ? name_of(*pose.verdict) : "", csv_number(pose.failure_probability),
                        axes_of(pose));
      for (std::size_t i = 0; i < 6; ++i)
        text += "," + (i < pose.deviations.size() ? csv_number(pose.deviations[i]) : std::string());
      text += "\n";
    }
  return text;
}

std::string poses_jsonl(const Experiment& experiment, const std::vector<CellRow>& rows) {
  const auto seeds = seeds_of(experiment);
  const auto of = [](const std::optional<double>& value) { return value ? json(*value) : json(); };
  std::string text;
  for (const CellRow& row : rows)
    for (const CellPose& pose : row.poses) {
      const auto seed = seeds.find(row.case_name);
      json matrix = json::array(), predicted;
      for (std::size_t r = 0; r < 3; ++r)
        matrix.push_back(std::vector<double>(pose.matrix.begin() + std::ptrdiff_t(4 * r),
                                             pose.matrix.begin() + std::ptrdiff_t(4 * r + 4)));
      matrix.push_back({0, 0, 0, 1});
      for (std::size_t i = 0; i < pose.deviations.size(); ++i)
        predicted[i < 3 ? "rotation_deg" : "translation_mm"].push_back(of(pose.deviations[i]));
      if (!predicted.is_null()) predicted["axes"] = axes_of(pose);
      text += json_text({{"cell", row.id},
                         {"case", row.case_name},
                         {"variant", row.variant},
                         {"start", row.start},
                         {"seed", seed == seeds.end() ? json() : json(seed->second)},
                         {"output", pose.output},
                         {"item", pose.item},
                         {"target", pose.target},
                         {"source", pose.source},
                         {"matrix", matrix},
                         {"verdict", pose.verdict ? json(name_of(*pose.verdict)) : json()},
                         {"failure_probability", of(pose.failure_probability)},
                         {"predicted_deviation", predicted}}) +
              "\n";
    }
  return text;
}

}  // namespace marrow::cli
