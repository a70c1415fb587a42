// SPDX-License-Identifier: Apache-2.0
#include "workbench/pipeline.hpp"

#include <cstdlib>

#include "commands.hpp"
#include "marrow/base/plain_text.hpp"
#include "marrow/base/temporary_folder.hpp"
#include "marrow/runtime/node/types.hpp"
#include "marrow/runtime/run/place_of_results.hpp"
#include "marrow/toolbox/files/mesh_file.hpp"
#include "report/report.hpp"

namespace fs = std::filesystem;

namespace marrow::workbench {
namespace {

using nlohmann::json;
using Kind = RunEvent::Kind;

/// The lines that `marrow run` writes to the log of a run.
void log_event(RunLog& log, const RunEvent& event) {
  const std::string where = cli::place_of(event);
  if (event.kind == Kind::finished) {
    const std::string text = formatted("{:.3f} s", event.seconds);
    log.keep(LogLevel::info, where, text);
  } else if (event.kind == Kind::skipped) {
    log.keep(LogLevel::info, where, "skipped: " + event.text);
  } else if (event.kind == Kind::warning) {
    log.keep(LogLevel::warning, where, event.text);
  } else if (event.kind == Kind::failed) {
    log.keep(event.level, "", event.text);
  } else if (event.kind == Kind::message) {
    log.keep(event.level, where, event.text);
  }
}

json nodes_of(const Pipeline& pipeline, const RunResult& result) {
  json nodes = json::object();
  for (std::size_t i = 0; i < result.nodes.size(); ++i)
    nodes[pipeline.nodes[i].id] = {{"status", status_name(result.nodes[i].status)},
                                   {"reason", result.nodes[i].reason},
                                   {"seconds", result.nodes[i].seconds}};
  return nodes;
}

constexpr int kPicture_px = 1000;
constexpr std::size_t kMostItems = 12;  // of one output
constexpr std::size_t kMostFiles = 8;   // of one item that is written as a folder
constexpr std::size_t kMostTriangles = 600'000;
constexpr std::size_t kMostText = 100'000;

template <class Item>
std::string bytes_text(const std::vector<Item>& items) {
  return base64(bytes_of_items(items));
}

json mesh_json(const Mesh& mesh) {
  const std::size_t count = mesh.triangles.size();
  if (count > kMostTriangles)
    return {{"kind", "text"},
            {"text", formatted("a surface of {} triangles; at most {} are drawn here", count, kMostTriangles)}};
  return {{"kind", "mesh"},
          {"vertices", bytes_text(floats_of(mesh.vertices_mm))},
          {"triangles", bytes_text(mesh.triangles)},
          {"text", formatted("{} vertices, {} triangles", mesh.vertices_mm.size(), count)}};
}

/// The three slices through the middle, from the least to the largest value in them.
json slices_json(const Grid& grid, const std::vector<float>& voxels) {
  const auto size = grid.size;
  json slices = json::array();
  double least = std::numeric_limits<double>::infinity(), most = -least;
  std::vector<std::vector<float>> values(3);
  for (int axis = 0; axis < 3; ++axis) {
    const int across = axis == 0 ? 1 : 0, up = axis == 2 ? 1 : 2;
    std::array<int, 3> at{};
    at[std::size_t(axis)] = size[axis] / 2;
    for (int row = size[up] - 1; row >= 0; --row)
      for (int column = 0; column < size[across]; ++column) {
        at[std::size_t(up)] = row, at[std::size_t(across)] = column;
        const float value = voxels[grid.offset(at[0], at[1], at[2])];
        values[std::size_t(axis)].push_back(value);
        least = std::min(least, double(value)), most = std::max(most, double(value));
      }
  }
  for (int axis = 0; axis < 3; ++axis) {
    const int across = axis == 0 ? 1 : 0, up = axis == 2 ? 1 : 2;
    std::vector<std::uint8_t> grey;
    for (const float value : values[std::size_t(axis)])
      grey.push_back(std::uint8_t(most > least ? 255 * (value - least) / (most - least) : 0));
    slices.push_back({{"width", size[across]},
                      {"height", size[up]},
                      {"stretch", grid.spacing_mm[up] / grid.spacing_mm[across]},
                      {"grey", bytes_text(grey)}});
  }
  return {{"kind", "slices"}, {"slices", slices}, {"least", least}, {"most", most}};
}

json file_json(const fs::path& file) {
  const std::string extension = file.extension().string();
  if (extension == ".png") return {{"kind", "picture"}, {"picture", cli::picture_url(file, kPicture_px)}};
  if (extension == ".ply" || extension == ".stl") return mesh_json(files::read_mesh_file(file, 1));
  std::string text = read_text_file(file, kMostRecordBytes);
  if (extension == ".json") {
    const json content = json::parse(text, nullptr, false);
    if (content.is_object() && content.contains("marrow-scene"))
      return {{"kind", "text"}, {"text", "a scene in 3D; the report of a run shows it"}};
    if (content.is_object() && content.contains("metrics") && content["metrics"].is_array())
      return {{"kind", "figures"}, {"figures", content["metrics"]}};
  }
  const bool is_cut = text.size() > kMostText;
  if (is_cut) text.resize(kMostText);
  return {{"kind", "text"}, {"text", text}, {"is_cut", is_cut}};
}

json shown_file(const fs::path& file, const std::string& name) {
  json item;
  try {
    item = file_json(file);
  } catch (const std::exception& error) {
    item = {{"kind", "text"}, {"text", "it cannot be shown: " + std::string(error.what())}};
  }
  item["name"] = name;
  return item;
}

/// What the page shows of an item. For most types, their writer makes files, and the page shows these.
json shown_item(const Value& value, const fs::path& folder, const Catalogue& catalogue) {
  if (value.is_absent())
    return json::array({{{"kind", "text"}, {"text", value.missing.empty() ? "nothing" : "nothing: " + value.missing}}});
  if (value.type.is_function)
    return json::array({{{"kind", "text"}, {"text", "a function that other nodes call; it has no picture"}}});
  // Large values are shown without files.
  if (value.type == TypeInfo::of<Mesh>()) return json::array({mesh_json(value.as<Mesh>())});
  if (value.type == TypeInfo::of<Volume>())
    return json::array({slices_json(value.as<Volume>().grid, value.as<Volume>().values)});
  if (value.type == TypeInfo::of<SignedField>())
    return json::array({slices_json(value.as<SignedField>().grid, value.as<SignedField>().values_mm)});
  if (value.type == TypeInfo::of<Verdict>()) {
    json verdict = json_of(NamedVerdict{"", "", value.as<Verdict>()});
    verdict["kind"] = "verdict";
    return json::array({verdict});
  }
  const WriterInfo* writer = catalogue.find_writer(value.type);
  if (!writer) return json::array({{{"kind", "text"}, {"text", "no library writes values of this type"}}});
  const fs::path place = folder / ("item" + writer->extension);
  const WriterDefinition& definition = catalogue.load_writer(value.type);
  const auto data = value.data ? value.data : value.source->data(definition.info.type);
  definition.write(data.get(), place.string());
  json shown = json::array();
  if (!fs::is_directory(place)) return json::array({shown_file(place, "")});
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(place))
    if (entry.is_regular_file()) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  std::stable_partition(files.begin(), files.end(), [](const fs::path& file) { return file.extension() == ".png"; });
  for (std::size_t i = 0; i < std::min(files.size(), kMostFiles); ++i)
    shown.push_back(shown_file(files[i], files[i].lexically_relative(place).string()));
  return shown;
}

void add_items(json& items, const Value& value, const std::string& place, const Catalogue& catalogue) {
  if (items.size() >= kMostItems) return;
  if (value.is_list()) {
    for (std::size_t i = 0; i < value.items.size(); ++i)
      add_items(items, value.items[i], place.empty() ? value.names[i] : place + "/" + value.names[i], catalogue);
    return;
  }
  const TemporaryFolder folder(new_temporary_folder("look"));
  json parts;
  try {
    parts = shown_item(value, folder.path(), catalogue);
  } catch (const std::exception& error) {
    parts = json::array({{{"kind", "text"}, {"text", "it cannot be shown: " + std::string(error.what())}}});
  }
  items.push_back({{"place", place}, {"parts", parts}});
}

std::size_t count_items(const Value& value) {
  if (!value.is_list()) return 1;
  std::size_t count = 0;
  for (const Value& item : value.items) count += count_items(item);
  return count;
}

/// The values of the node's outputs, read back from the store.
std::vector<Value> stored_outputs(Pipeline pipeline, std::size_t node, const Workbench& workbench, Job& job) {
  const std::string id = pipeline.nodes[node].id;
  pipeline.outputs.clear();
  for (std::size_t i = 0; i < pipeline.nodes[node].info.outputs.size(); ++i) {
    Reference source;
    source.text = id + "." + pipeline.nodes[node].info.outputs[i].name;
    source.node = int(node);
    source.output = int(i);
    pipeline.outputs.push_back({pipeline.nodes[node].info.outputs[i].name, source});
  }
  RunSettings settings;
  settings.store = &workbench.store;
  settings.cancelled = &job.stopped();
  settings.remember = false;
  for (const PlannedNode& planned : plan_pipeline(pipeline, workbench.catalogue, settings))
    if (planned.what == PlannedNode::What::runs || planned.what == PlannedNode::What::depends)
      throw Error("what '" + id + "' makes has not been computed yet; run what is stale first");
  const RunResult result = run_pipeline(pipeline, workbench.catalogue, settings);
  return result.nodes[node].outputs;
}

}  // namespace

void LastRuns::keep(const std::string& file, std::shared_ptr<const LastRun> run) {
  const std::lock_guard lock(mutex_);
  file_ = file;
  run_ = std::move(run);
}

std::shared_ptr<const LastRun> LastRuns::find(const std::string& file, const std::string& revision,
                                              const json& inputs) const {
  const std::lock_guard lock(mutex_);
  return run_ && file_ == file && run_->revision == revision && run_->inputs == inputs ? run_ : nullptr;
}

json plan_of(const Pipeline& pipeline, const Workbench& workbench) {
  RunSettings settings;
  settings.store = workbench.usable_store();
  if (!settings.store)
    throw Error("results cannot be kept, so it is not known what is stale: " + workbench.store.fault());
  settings.remember = false;
  return cli::json_of(pipeline, plan_pipeline(pipeline, workbench.catalogue, settings));
}

json run_into_folder(std::shared_ptr<LastRun> run, const PipelineArguments& arguments, const Workbench& workbench,
                     Job& job) {
  cli::expect_files_can_hold(run->pipeline, workbench.catalogue);
  const std::filesystem::path runs = workbench.folder.inside("runs");
  expect_nothing_reads(run->pipeline, runs, "the folder of the runs", "open a folder above it");
  RunSettings settings;
  settings.store = workbench.usable_store();
  if (settings.store)
    expect_nothing_reads(run->pipeline, settings.store->folder(), "the store of results",
                         "set MARROW_CACHE to another folder");
  RunFolder folder = RunFolder::with_free_name(runs / run->pipeline.name, run->pipeline);
  for (const std::string& note : run->pipeline.notes) folder.log().keep(LogLevel::info, "", "note: " + note);
  settings.cancelled = &job.stopped();
  settings.observer = [&](const RunEvent& event) {
    log_event(folder.log(), event);
    job.tell(cli::json_of(event));
  };
  folder.keep_failed_calls(settings, workbench.catalogue);
  run->result = run_pipeline(run->pipeline, workbench.catalogue, settings);
  const auto written =
      folder.write_outputs(run->pipeline, run->result, workbench.catalogue, recipe_of_run(run->pipeline, settings));
  folder.write_record(run->pipeline, run->result, settings, workbench.catalogue, arguments, written);
  if (settings.store) settings.store->tidy(settings.cancelled);
  json verdicts = json::array(), faults = json::array();
  for (const NamedVerdict& one : verdicts_of(run->pipeline, run->result)) verdicts.push_back(json_of(one));
  for (const RunFolder::Written& output : written)
    if (!output.fault.empty()) faults.push_back("output '" + output.output + "': " + output.fault);
  return {{"folder", workbench.folder.relative(folder.path())},
          {"status", run->result.cancelled() ? "cancelled"
                     : run->result.failed()  ? "failed"
                                             : "done"},
          {"seconds", run->result.seconds},
          {"verdicts", verdicts},
          {"faults", faults},
          {"nodes", nodes_of(run->pipeline, run->result)}};
}

// Shows the outputs of a node. Surfaces and volumes are shown directly. The writers of other types write files into a
// temporary folder, and these become pictures, surfaces and texts.

json outputs_of_node(const Pipeline& pipeline, const std::string& node, const LastRun* last, const Workbench& workbench,
                     Job& job) {
  const auto found = std::find_if(pipeline.nodes.begin(), pipeline.nodes.end(),
                                  [&](const PipelineNode& one) { return one.id == node; });
  if (found == pipeline.nodes.end()) throw Error("the pipeline has no node '" + node + "'");
  const std::size_t index = std::size_t(found - pipeline.nodes.begin());
  std::vector<Value> values;
  if (last && last->result.nodes[index].status == NodeRecord::Status::done) values = last->result.nodes[index].outputs;
  if (values.empty()) values = stored_outputs(pipeline, index, workbench, job);
  json outputs = json::array();
  for (std::size_t i = 0; i < values.size() && i < found->info.outputs.size(); ++i) {
    const PortInfo& port = found->info.outputs[i];
    json items = json::array();
    add_items(items, values[i], "", workbench.catalogue);
    const std::size_t count = count_items(values[i]);
    outputs.push_back({{"name", port.name},
                       {"type", port.type.id},
                       {"help", port.help},
                       {"left_out", count - std::min(count, items.size())},
                       {"items", items}});
  }
  return outputs;
}

}  // namespace marrow::workbench
