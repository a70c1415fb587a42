// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/run/run_folder.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <ctime>
#include <fstream>
#include <thread>

#include "marrow/base/file_names.hpp"
#include "marrow/base/framework_file.hpp"
#include "marrow/base/machine.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/png_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/base/regular_file.hpp"
#include "marrow/base/text_file.hpp"
#include "marrow/runtime/pipeline/named_files.hpp"
#include "marrow/runtime/plugins/manifest.hpp"
#include "marrow/runtime/run/failed_calls.hpp"
#include "marrow/runtime/run/node_calls.hpp"
#include "marrow/runtime/run/place_of_results.hpp"
#include "marrow/runtime/run/verdicts.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr const char* kAdvice = "; choose another with --out";

[[noreturn]] void refuse(const fs::path& folder) {
  std::error_code error;
  if (!fs::is_directory(folder, error)) throw Error("the output folder " + folder.string() + " is a file" + kAdvice);
  throw Error("the output folder " + folder.string() + " is already there and not empty" + kAdvice + ", or remove it");
}

std::string utc_now() {
  const std::time_t now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  std::tm parts{};
  gmtime_r(&now, &parts);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &parts);
  return text;
}

/// The keys of the single items of a list, each with its place along the axes, in the order in which files are written.
/// The place is written like the path of the file, so that no two items have the same place.
void add_items(const Value& value, const std::string& place, json& items) {
  if (!value.is_list()) {
    items.push_back({place, value.key.hex()});
    return;
  }
  const std::vector<std::string> names = distinct_names(value.names);
  for (std::size_t i = 0; i < value.items.size(); ++i)
    add_items(value.items[i], (place.empty() ? "" : place + "/") + file_name_of(names[i]), items);
}

json items_of(const Value& value) {
  json items = json::array();
  add_items(value, "", items);
  return items;
}

/// The keys of the values that the node's inputs were wired to.
json inputs_of(const PipelineNode& node, const RunResult& result) {
  json inputs = json::object();
  for (const Wire& wire : node.wires) {
    Hasher hasher;
    try {
      for (const Reference& source : wire.sources) hasher.add(key_of(value_of(result, source)));
    } catch (const Error&) {  // the list does not have this item: the node failed
    }
    inputs[node.input_of(wire).name] = hasher.digest().hex();
  }
  return inputs;
}

/// The same for a node of a body. What it gets comes from nodes of the body, from what the passes were given, or both.
json inputs_in_body(const PipelineNode& node, const Repetition& repetition, const PassesRecord& passes) {
  json inputs = json::object();
  for (const Wire& wire : node.wires) {
    Hasher hasher;
    for (const Reference& source : wire.sources) {
      const std::vector<Value>& outputs = passes.nodes[std::size_t(source.node)].outputs;
      if (std::size_t(source.output) < outputs.size()) hasher.add(key_of(outputs[std::size_t(source.output)]));
      for (std::size_t i = 0; i < passes.given.size(); ++i) {
        const Reference& target = repetition.given.at(i).target;
        if (target.has_same_output(source)) hasher.add(key_of(passes.given[i]));
      }
    }
    inputs[node.input_of(wire).name] = hasher.digest().hex();
  }
  return inputs;
}

/// The digests of what the node's options of type path named when the node read it; null if it was missing or
/// unreadable.
json files_of(const NodeRecord& record) {
  json files = json::object();
  for (const auto& [option, content] : record.files) files[option] = content == Digest{} ? json() : json(content.hex());
  return files;
}

/// The digests of the files that were written, by which later damage can be found; null for what cannot be read.
json digests_of(const fs::path& folder, const std::vector<std::string>& files) {
  json digests = json::array();
  for (const std::string& file : files) try {
      digests.push_back(content_of(folder / file).hex());
    } catch (const Error&) {
      digests.push_back(json());
    }
  return digests;
}

/// To a file that is a PNG; others stay as they are.
void add_recipe(const fs::path& file, const std::string& text) {
  if (file.extension() != ".png") return;
  const std::string png = read_text_file(file, std::numeric_limits<std::uintmax_t>::max());
  if (is_png(png)) write_text_file(file, with_png_text(png, kRecipeKeyword, text));
}

bool took_part(const NodeRecord& record) {
  // A function has outputs with keys even if nothing called it.
  return record.status != NodeRecord::Status::not_needed || !record.outputs.empty();
}

/// Where the node is written, what it uses, and each of its options that has not its default value.
json places_of(const PipelineNode& node, const fs::path& file) {
  json options = json::object();
  for (std::size_t i = 0; i < node.option_places.size(); ++i)
    if (const std::string text = place_text(node.option_places[i], file); !text.empty())
      options[node.info.options[i].name] = text;
  return {{"node", place_text(node.place, file)}, {"uses", place_text(node.uses_place, file)}, {"options", options}};
}

json json_of(const NodeRecord& record, const PipelineNode& node, const fs::path& file, const Catalogue& catalogue) {
  json j = {{"id", node.id},
            {"uses", node.info.name},
            {"written", places_of(node, file)},
            {"status", status_name(record.status)},
            {"calls", record.calls},
            {"cached", record.cached},
            {"start_s", record.start_s},
            {"seconds", record.seconds},
            {"peak_process_memory_mb", record.peak_memory_mb},
            {"keys", json::object()},
            {"items", json::object()},
            {"functions", json::array()},
            {"random", node.info.random},
            {"files", files_of(record)}};
  if (!record.reason.empty()) j["reason"] = record.reason;
  if (record.passes) {
    j["passes"] = json::array();
    for (const PassesRecord::Pass& pass : record.passes->passes) {
      j["passes"].push_back({{"name", pass.name}, {"status", status_name(pass.status)}, {"seconds", pass.seconds}});
      if (!pass.reason.empty()) j["passes"].back()["reason"] = pass.reason;
    }
    if (!record.passes->end.empty()) j["end"] = record.passes->end;
  }
  if (record.stopped > 0) j["not_run_because_of_it"] = record.stopped;
  if (const LibraryInfo* library = catalogue.library_of(node.info.name)) {
    j["library"] = library->file.filename().string();
    j["build_id"] = library->build_id.hex();
  }
  if (const std::string version = version_of_program(node); !version.empty()) j["program_version"] = version;
  for (std::size_t i = 0; i < record.outputs.size(); ++i) {
    const std::string& name = node.info.outputs[i].name;
    j["keys"][name] = key_of(record.outputs[i]).hex();
    j["items"][name] = items_of(record.outputs[i]);
    if (node.info.outputs[i].type.is_function) j["functions"].push_back(name);
  }
  return j;
}

/// Calls use(node, record, its name) for each node that took part, and then for those of its body. Outside of bodies,
/// `inputs_of_node` gives the keys of a node's inputs.
using InputsOfNode = std::function<json(const PipelineNode&)>;
using UseOfNode = std::function<void(const PipelineNode&, const NodeRecord&, const std::string&, const json&)>;
void for_each_node(const Pipeline& pipeline, const std::vector<NodeRecord>& records, const std::string& path,
                   const InputsOfNode& inputs_of_node, const UseOfNode& use) {
  for (std::size_t i = 0; i < pipeline.nodes.size() && i < records.size(); ++i) {
    const PipelineNode& node = pipeline.nodes[i];
    if (!took_part(records[i])) continue;
    use(node, records[i], path + node.id, inputs_of_node(node));
    if (!records[i].passes) continue;
    const auto in_body = [&](const PipelineNode& one) {
      return inputs_in_body(one, *node.repetition, *records[i].passes);
    };
    for_each_node(node.repetition->alone, records[i].passes->nodes, path + node.id + "/", in_body, use);
  }
}

json json_of(const LibraryInfo& library) {
  json linked = json::array();
  for (const LinkedLibrary& one : library.linked)
    if (one.path.find("-packages/") == std::string::npos)  // of an installed Python package there may be thousands
      linked.push_back(fs::path(one.path).filename().string());
  json j = {{"file", library.file.filename().string()}, {"build_id", library.build_id.hex()}, {"links", linked}};
  if (library.file.extension() == ".py" && !library.linked.empty()) j["interpreter"] = library.linked[0].path;
  return j;
}

}  // namespace

RunFolder::RunFolder(const fs::path& folder, const Pipeline& pipeline) : folder_(folder) {
  std::error_code error;
  if (fs::exists(folder, error) && (!fs::is_directory(folder, error) || !fs::is_empty(folder, error))) refuse(folder);
  fs::create_directories(folder, error);
  if (error) throw Error("cannot make the output folder " + folder.string() + ": " + error.message() + kAdvice);
  if (take(pipeline)) return;
  throw Error("the output folder " + folder.string() + " was taken by another run just now" + kAdvice);
}

RunFolder RunFolder::with_free_name(const fs::path& base, const Pipeline& pipeline) {
  std::error_code error;
  if (base.has_parent_path()) fs::create_directories(base.parent_path(), error);
  for (int i = 1;; ++i) {
    RunFolder run;
    run.folder_ = i == 1 ? base : fs::path(formatted("{}-{}", base.string(), i));
    if (::mkdir(run.folder_.c_str(), 0777) == 0) {
      try {
        if (run.take(pipeline)) return run;
      } catch (...) {
        ::rmdir(run.folder_.c_str());
        throw;
      }
    } else if (errno != EEXIST) {
      throw Error("cannot make the output folder " + run.folder_.string() + ": " + std::strerror(errno) + kAdvice);
    }
  }
}

RunFolder::RunFolder() = default;
RunFolder::RunFolder(RunFolder&&) noexcept = default;
RunFolder::~RunFolder() = default;

void RunFolder::keep_failed_calls(RunSettings& settings, const Catalogue& catalogue) {
  if (!settings.given.empty()) return;  // values of another program: nothing could make them again
  failed_calls_ = std::make_unique<FailedCalls>(folder_, catalogue, settings);
}

std::vector<std::string> RunFolder::failed_calls() const {
  return failed_calls_ ? failed_calls_->folders() : std::vector<std::string>();
}

bool RunFolder::take(const Pipeline& pipeline) {
  const fs::path log = folder_ / "log.txt";
  // O_EXCL: this succeeds for one process only.
  Descriptor file(::open(log.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
  if (!file.is_open() && errno == EEXIST) return false;
  if (!file.is_open())
    throw Error("cannot write to the output folder " + folder_.string() + ": " + std::strerror(errno) + kAdvice);
  file.close();
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_, error))
    if (entry.path() != log) {
      fs::remove(log, error);
      refuse(folder_);
    }
  try {
    write_text_file(folder_ / "pipeline.yaml", resolved_yaml(pipeline));
    fs::create_directory(folder_ / "outputs");
    log_ = std::make_unique<RunLog>(log);
    return true;
  } catch (const std::exception& fault) {
    for (const char* name : {"log.txt", "pipeline.yaml"})
      fs::remove(folder_ / name, error);  // so that a second try finds it empty
    throw Error(fault.what());
  }
}

std::vector<RunFolder::Written> RunFolder::write_outputs(const Pipeline& pipeline, const RunResult& result,
                                                         const Catalogue& catalogue,
                                                         const std::optional<RunRecipe>& recipe) {
  std::vector<Written> all;
  const std::string text = recipe ? recipe->text() : "";
  for (const PipelineOutput& output : pipeline.outputs) {
    Written written{output.name, {}, "", ""};
    try {
      write_value(value_of(result, output.source), folder_ / "outputs" / output.name, folder_, catalogue, written);
      if (recipe)
        for (const std::string& file : written.files) add_recipe(folder_ / file, text);
    } catch (const std::exception& error) {
      written.fault = error.what();
    }
    all.push_back(std::move(written));
  }
  return all;
}

void RunFolder::write_record(const Pipeline& pipeline, const RunResult& result, const RunSettings& settings,
                             const Catalogue& catalogue, const PipelineArguments& arguments,
                             const std::vector<Written>& written) {
  json record = {{"marrow", MARROW_VERSION},
                 {"framework", file_digest(framework_file()).hex()},
                 {"pipeline", pipeline.name},
                 {"finished", utc_now()},
                 {"status", result.cancelled() ? "cancelled"
                            : result.failed()  ? "failed"
                                               : "done"},
                 {"seconds", result.seconds},
                 {"seed", settings.seed},
                 {"threads", settings.threads > 0 ? settings.threads : int(std::thread::hardware_concurrency())},
                 {"cpu_level", cpu_level()},
                 {"inputs", json::object()},
                 {"overrides", json::array()},
                 {"nodes", json::array()},
                 {"plugins", json::array()},
                 {"outputs", json::array()}};
  for (const NamedVerdict& one : verdicts_of(pipeline, result)) record["verdicts"].push_back(json_of(one));
  for (const InputValue& one : arguments.inputs) record["inputs"][one.name] = one.value;
  for (const Override& one : arguments.overrides) record["overrides"].push_back(one.key + "=" + one.value);
  std::set<fs::path> libraries;
  const auto inputs_of_node = [&](const PipelineNode& node) { return inputs_of(node, result); };
  for_each_node(pipeline, result.nodes, "", inputs_of_node,
                [&](const PipelineNode& node, const NodeRecord& done, const std::string& name, const json& inputs) {
                  json j = json_of(done, node, pipeline.file, catalogue);
                  j["id"] = name;
                  j["inputs"] = inputs;
                  record["nodes"].push_back(std::move(j));
                  const LibraryInfo* library = catalogue.library_of(node.info.name);
                  if (library && libraries.insert(library->file).second) record["plugins"].push_back(json_of(*library));
                });
  // These limits decide whether a file is read at all.
  if (settings.file_limits.memory_mb > 0) record["file_memory_mb"] = settings.file_limits.memory_mb;
  if (settings.file_limits.seconds > 0) record["file_seconds"] = settings.file_limits.seconds;
  for (std::size_t i = 0; i < written.size(); ++i) {
    json output = {{"name", written[i].output}, {"files", written[i].files}, {"items", json::array()}};
    output["digests"] = digests_of(folder_, written[i].files);
    if (!written[i].fault.empty()) output["fault"] = written[i].fault;
    if (!written[i].absent.empty()) output["absent"] = written[i].absent;
    try {
      output["items"] = items_of(value_of(result, pipeline.outputs.at(i).source));
    } catch (const Error&) {  // the list does not have this item: `fault` says so
    }
    record["outputs"].push_back(std::move(output));
  }
  if (failed_calls_) failed_calls_->finish();
  write_text_file(folder_ / "run.json", record.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
}

}  // namespace marrow
