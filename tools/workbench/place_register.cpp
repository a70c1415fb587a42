// SPDX-License-Identifier: Apache-2.0
// "From here" of the page "Place": a registration that starts from the present poses. They are written as pose files,
// so that the command line can do the same.
#include <algorithm>
#include <cmath>

#include "marrow/base/file_names.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/runtime/node/types.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"
#include "marrow/runtime/run/verdicts.hpp"
#include "marrow/toolbox/files/atomic_write.hpp"
#include "marrow/toolbox/files/yaml_text.hpp"
#include "new/templates.hpp"
#include "report/report.hpp"
#include "workbench/place.hpp"

namespace fs = std::filesystem;

namespace marrow::workbench {
namespace {

using nlohmann::json;

/// The option of a node that reads a case: it takes other starts.
constexpr const char* kStarts = "starts";

/// The node that reads the case and takes other starts; "" if there is none.
std::string node_with_starts(const Pipeline& pipeline) {
  for (const PipelineNode& node : pipeline.nodes)
    for (const OptionInfo& option : node.info.options)
      if (option.name == kStarts) return node.id;
  return "";
}

/// The names of the outputs that have this type and an item for each fragment.
std::vector<std::string> outputs_of_type(const Pipeline& pipeline, const TypeInfo& type) {
  std::vector<std::string> names;
  for (const PipelineOutput& output : pipeline.outputs) {
    if (pipeline.output_of(output.source).type == type &&
        pipeline.axes_of(output.source) == std::vector<std::string>{"fragment"})
      names.push_back(output.name);
  }
  return names;
}

/// Reads a pipeline for a case. Throws Error with the pipeline's faults.
Pipeline read_for_case(const Workbench& workbench, const fs::path& file, const std::string& case_folder) {
  PipelineArguments arguments;
  arguments.inputs = {{"case", case_folder}};
  Diagnostics diagnostics;
  Pipeline pipeline = read_pipeline(file, arguments, workbench.catalogue, diagnostics);
  if (!diagnostics.empty()) throw Error(diagnostics.text());
  return pipeline;
}

json deviations_of(const Pose& pose) {
  if (!pose.covariance || !pose.covariance->allFinite()) return nullptr;
  const auto deviation = [&](int i) { return std::sqrt((*pose.covariance)(i, i)); };
  json deviations;
  static constexpr const char* kAxes[] = {"frontal", "lateral", "long"};
  for (int i = 0; i < 3; ++i)
    deviations[kAxes[i]] = {{"rotation_deg", degrees(deviation(i))}, {"shift_mm", deviation(3 + i)}};
  return deviations;
}

/// A path for a command line in the opened folder.
std::string shown_path(const OpenedFolder& folder, const fs::path& path) {
  const std::string relative = path.lexically_relative(folder.path()).generic_string();
  return relative.empty() || relative.starts_with("..") ? path.string() : relative;
}

/// Whether the files of a folder are exactly these. Folders in it do not count.
bool holds_only(const fs::path& folder, const std::map<std::string, std::string>& texts) {
  std::size_t count = 0;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) count += entry.is_regular_file();
  return count == texts.size() && std::all_of(texts.begin(), texts.end(), [&](const auto& one) {
           const fs::path file = folder / one.first;
           return fs::exists(file) && fs::file_size(file) == one.second.size() &&
                  read_text_file(file, one.second.size()) == one.second;
         });
}

}  // namespace

std::map<std::string, std::string> start_files(const PlacedCase& placed,
                                               const std::map<std::string, RigidTransform>& poses) {
  std::map<std::string, std::string> texts;
  for (const PlacedBone& bone : placed.bones) {
    const auto found = poses.find(bone.name);
    if (found == poses.end()) throw Error("the request lacks the pose of " + in_quotes(printable(bone.name)));
    Pose pose;
    pose.world_from_model = found->second;
    pose.frame = bone.frame;
    texts[file_name_of(bone.name) + ".yaml"] = files::pose(pose);
  }
  return texts;
}

std::string write_placement(const OpenedFolder& folder, const std::string& into, const PlacedCase& placed,
                            const std::map<std::string, std::string>& texts) {
  constexpr int kMost = 100'000;
  const std::string all = into + "/" + file_name_of(placed.path);
  for (int number = 1; number < kMost; ++number) {
    const std::string name = formatted("{}/{}", all, number);
    const fs::path place = folder.inside(name);
    std::error_code error;
    if (fs::exists(place)) {
      if (holds_only(place, texts)) return name;
      continue;
    }
    fs::create_directories(place.parent_path(), error);
    const bool is_made = !error && fs::create_directory(place, error);
    if (error) throw Error("the poses cannot be written to " + printable(place.string()) + ": " + error.message());
    if (!is_made) continue;  // another request has just made it, and writes its own poses there
    for (const auto& [file, text] : texts) files::write_text(place / file, text);
    return name;
  }
  throw Error("there are too many folders in " + printable(folder.inside(all).string()) + "; remove some");
}

json pipelines_from_starts(const Workbench& workbench) {
  std::vector<fs::path> files{workbench_pipeline("register")};
  std::vector<fs::path> shipped;
  // Those of the families, which have a folder each.
  for (const fs::directory_entry& family : fs::directory_iterator(cli::shared_files("pipelines"))) {
    if (!family.is_directory() || family.path().filename() == "workbench") continue;
    for (const fs::directory_entry& entry : fs::directory_iterator(family))
      if (entry.path().extension() == ".yaml") shipped.push_back(entry.path());
  }
  std::sort(shipped.begin(), shipped.end());
  files.insert(files.end(), shipped.begin(), shipped.end());
  for (const auto& own : workbench.folder.contents()["pipelines"])
    files.push_back(workbench.folder.inside(own.get<std::string>()));
  json found = json::array();
  for (const fs::path& file : files) {
    try {
      const Pipeline pipeline = read_for_case(workbench, file, workbench.folder.path().string());
      if (node_with_starts(pipeline).empty() || outputs_of_type(pipeline, TypeInfo::of<Pose>()).empty()) continue;
      found.push_back(
          {{"file", shown_path(workbench.folder, file)}, {"name", file.stem().string()}, {"help", pipeline.help}});
    } catch (const std::exception&) {  // it takes no case or has faults, so it is not offered
    }
  }
  return found;
}

std::string command_from_starts(const Workbench& workbench, const std::string& pipeline, const std::string& case_path,
                                const std::string& starts) {
  const Pipeline read =
      read_for_case(workbench, workbench.folder.path() / pipeline, workbench.folder.inside(case_path).string());
  const std::string node = node_with_starts(read);
  if (node.empty())
    throw Error(in_quotes(printable(pipeline)) + " takes no starts from a case; choose another pipeline");
  return "marrow run " + cli::shell_path(pipeline) + " " +
         cli::shell_word("case=" + (case_path.empty() ? "." : case_path)) + " --set " +
         cli::shell_word(node + "." + kStarts + "=" + starts);
}

json run_from_starts(const Workbench& workbench, const fs::path& pipeline, const std::string& case_path,
                     const std::string& starts, Job& job) {
  PipelineCall call{pipeline};
  const std::string folder = workbench.folder.inside(case_path).string();
  const Pipeline read = read_for_case(workbench, pipeline, folder);
  const auto poses = outputs_of_type(read, TypeInfo::of<Pose>());
  const auto verdicts = outputs_of_type(read, TypeInfo::of<Verdict>());
  call.arguments.inputs = {{"case", folder}};
  call.arguments.overrides = {{node_with_starts(read) + "." + kStarts, workbench.folder.inside(starts).string()}};
  // The output 'pose' is the result. Without one, the first output is.
  if (!poses.empty()) call.only.push_back(contains(poses, "pose") ? "pose" : poses.front());
  if (!verdicts.empty()) call.only.push_back(verdicts.front());
  json result = {{"poses", json::object()}, {"verdicts", json::object()}};
  for (const auto& [name, value] : outputs_of(call, workbench, job))
    for (std::size_t i = 0; i < value.items.size(); ++i) {
      if (!value.items[i].data) continue;  // a node may fail for one of the bones
      if (value.type == TypeInfo::of<Verdict>()) {
        result["verdicts"][value.names[i]] = json_of(NamedVerdict{name, value.names[i], value.items[i].as<Verdict>()});
        continue;
      }
      const Pose& pose = value.items[i].as<Pose>();
      result["poses"][value.names[i]] = {
          {"matrix", json_of(pose.world_from_model)}, {"deviations", deviations_of(pose)}, {"warnings", pose.warnings}};
    }
  return result;
}

}  // namespace marrow::workbench
