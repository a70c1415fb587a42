// SPDX-License-Identifier: Apache-2.0
// Writes seeds, landmarks, poses and cameras to files: in marrow's own format, or by a pipeline for other programs.
#include "marrow/base/printable.hpp"
#include "marrow/domain/volume.hpp"
#include "marrow/toolbox/exchange/written_files.hpp"
#include "workbench/xray.hpp"

namespace fs = std::filesystem;

namespace marrow::workbench {
namespace {

using nlohmann::json;

/// The ending of a file's name, and the pipeline's output that makes the file. Marrow's own format needs no pipeline.
struct Format {
  std::string ending, output;
  std::string (*bytes)(const Value&) = nullptr;
};

template <class File>
std::string bytes_of(const Value& value) {
  return value.as<File>().bytes;
}

const std::vector<Format>& formats_of(const std::string& what) {
  using namespace exchange;
  static const std::map<std::string, std::vector<Format>> kFormats = [] {
    const Format own{".yaml", "", nullptr}, old{".yml", "", nullptr};
    const std::vector<Format> points{
        own, old, {".mrk.json", "markups", bytes_of<MarkupsFile>}, {".fcsv", "fcsv", bytes_of<FcsvFile>}};
    return std::map<std::string, std::vector<Format>>{{"seeds", points},
                                                      {"landmarks", points},
                                                      {"pose", {own, old, {".tfm", "tfm", bytes_of<ItkTransformFile>}}},
                                                      {"cameras",
                                                       {{".txt", "plastimatch", bytes_of<PlastimatchFile>},
                                                        {".xml", "rtk", bytes_of<RtkFile>},
                                                        {".h5", "xreg", bytes_of<XregFile>}}}};
  }();
  const auto found = kFormats.find(what);
  if (found == kFormats.end())
    throw Error("seeds, landmarks, a pose or cameras can be exported, not " + in_quotes(printable(what)));
  return found->second;
}

/// By the end of the file's name.
Format format_of(const std::string& what, const std::string& path) {
  std::string known;
  for (const Format& format : formats_of(what)) {
    if (path.ends_with(format.ending) && path.size() > format.ending.size()) return format;
    if (format.ending != ".yml") known += (known.empty() ? "" : ", ") + format.ending;
  }
  throw Error(in_quotes(printable(path)) + ": the name must end in one of " + known);
}

/// The place of a file in an existing folder. An existing file is replaced only with `replace`.
fs::path place_for(const Workbench& workbench, const std::string& path, bool replace) {
  const fs::path file = workbench.folder.inside(path);
  if (fs::is_directory(file)) throw Error(in_quotes(printable(path)) + " is a folder; give another name");
  if (fs::exists(file) && !replace) throw Conflict(in_quotes(printable(path)) + " is there already");
  if (!fs::is_directory(file.parent_path()))
    throw Error(in_quotes(printable(path)) + ": there is no such folder; make it first");
  return file;
}

json with_version(const std::string& key, const json& content) {
  json file = content;
  file[key] = 1;
  return file;
}

/// The text in marrow's own format. `content` is {fragments} for seeds and landmarks, and {matrix} for a pose.
std::string own_text(const std::string& what, const json& content) {
  json file;
  if (what == "pose") {
    file = with_version("marrow-pose", {{"target", "world"}, {"source", "ct"}, {"matrix", content.at("matrix")}});
  } else {
    const json fragments = content.value("fragments", json());
    if (!fragments.is_object() || fragments.empty()) throw Error("there are no " + what + " to export");
    file = with_version("marrow-" + what, {{"fragments", fragments}});
  }
  return file.dump(1) + "\n";
}

double length(const json& content, const char* name) {
  const json value = content.value(name, json());
  if (!value.is_number()) throw Error("give the size of a pixel on the detector, in mm");
  return value.get<double>();
}

std::string number_text(double value) { return json(value).dump(); }

/// The run that makes the file. Its input is a file of the user ({file} in the content), or one in .marrow/drafts.
PipelineCall call_for(const Workbench& workbench, const std::string& what, const Format& format, const json& content) {
  PipelineCall call{.file = workbench_pipeline("export-" + what), .only = {format.output}, .keep = false};
  if (what == "cameras") {
    call.arguments.inputs = {{"pixel_width_mm", number_text(length(content, "pixel_width_mm"))},
                             {"pixel_height_mm", number_text(length(content, "pixel_height_mm"))}};
    const json views = content.value("views", json::array());
    if (!views.is_array() || views.empty()) throw Error("there is no view with an image and a camera");
    call.arguments.overrides = overrides_of(workbench, views);
    return call;
  }
  const fs::path source = content.contains("file")
                              ? workbench.folder.inside(content["file"].get<std::string>())
                              : working_file(workbench.folder, what, ".yaml", own_text(what, content));
  call.arguments.inputs = {{"path", source.string()}};
  return call;
}

/// The only file. Throws Error if the pipeline made several, one for each fragment or view.
const Value& only_item(const Value& value) {
  if (!value.is_list()) return value;
  if (value.items.size() == 1) return only_item(value.items.front());
  throw Error(
      formatted("such a file holds one fragment, or one view; there are {}: choose one of them", value.items.size()));
}

json exported(const Workbench& workbench, const Request& request) {
  const std::string what = request.text("what"), path = request.text("path");
  const Format format = format_of(what, path);
  const fs::path file = place_for(workbench, path, request.body.value("replace", false));
  const json content = request.body.value("content", json::object());
  json answer = {{"path", workbench.folder.relative(file)}};
  std::string bytes;
  if (format.bytes) {
    const PipelineCall call = call_for(workbench, what, format, content);
    const Ran ran = run(call, workbench);
    bytes = format.bytes(only_item(ran.outputs.at(format.output)));
    answer["command"] = command_of(call);
  } else {
    bytes = own_text(what, content);
  }
  files::write_text(file, bytes);
  return answer;
}

/// By fragment: [[x, y, z], ...].
json json_of_seeds(const List<Seeds>& seeds) {
  json fragments = json::object();
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    json points = json::array();
    for (const Eigen::Vector3d& point : seeds[i].points_mm) points.push_back(json_of(point));
    fragments[seeds.name(i)] = {{"seeds", points}, {"register", seeds[i].wanted}};
  }
  return fragments;
}

/// The list of a draft's document, with the fragment of each landmark.
json json_of_landmarks(const List<Landmarks>& fragments) {
  json list = json::array();
  for (std::size_t i = 0; i < fragments.size(); ++i)
    for (const Landmarks::Point& point : fragments[i].points) {
      json landmark = {{"name", point.name}, {"fragment", fragments.name(i)}, {"model_mm", json_of(point.model_mm)}};
      for (const Landmarks::Seen& seen : fragments[i].seen)
        if (seen.name == point.name) landmark["pixels"][seen.view] = {seen.pixel.x(), seen.pixel.y()};
      list.push_back(landmark);
    }
  return list;
}

/// What a file holds: {seeds}, {landmarks} or {world_from_ct}, and the command that reads it.
json imported(const Workbench& workbench, const Request& request) {
  const std::string what = request.parameter("what");
  if (what != "seeds" && what != "landmarks" && what != "pose")
    throw Error("seeds, landmarks or a pose can be imported, not '" + printable(what) + "'");
  const std::string path = workbench.folder.inside(request.parameter("path")).string();
  const NodeCall call{"read." + what, {{"path", path}}};
  const Ran ran = run(call, workbench);
  const Value& value = ran.outputs.at(what);
  json answer = {{"command", command_of(call)}, {"warnings", ran.warnings}};
  if (what == "seeds") answer["seeds"] = json_of_seeds(value.as_list<Seeds>());
  if (what == "landmarks") answer["landmarks"] = json_of_landmarks(value.as_list<Landmarks>());
  if (what == "pose") answer["world_from_ct"] = json_of(value.as<Pose>().world_from_model);
  return answer;
}

}  // namespace

void add_xray_export(Server& server, Workbench& workbench) {
  server.post("/api/xray/export", [&](const Request& request) { return json_answer(exported(workbench, request)); });
}

// Seeds, landmarks and poses from files.

void add_xray_exchange(Server& server, Workbench& workbench) {
  server.get("/api/xray/import", [&](const Request& request) { return json_answer(imported(workbench, request)); });
}

}  // namespace marrow::workbench
