// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/run/failed_calls.hpp"

#include <nlohmann/json.hpp>
#include <sstream>

#include "marrow/base/file_names.hpp"
#include "marrow/base/json_text.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/base/text_file.hpp"
#include "marrow/runtime/run/apart.hpp"
#include "marrow/runtime/run/place_of_results.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr const char *kCallFile = "call.json", *kKeysFile = "results.json";

/// "track/edges" -> track/edges. What a file name cannot have is escaped.
fs::path path_of_folders(const std::string& names) {
  fs::path path;
  std::istringstream parts(names);
  for (std::string part; std::getline(parts, part, '/');) path /= file_name_of(part);
  return path;
}

/// Makes a folder that nothing else is in: base, base-2, base-3 ... A node 'a' with an item 'b' and a node 'a/b' want
/// the same one.
fs::path new_folder(const fs::path& base) {
  fs::create_directories(base.parent_path());
  fs::path folder = base;
  for (int i = 2; !fs::create_directory(folder) && fs::exists(folder / kCallFile); ++i)
    folder = formatted("{}-{}", base.string(), i);
  return folder;
}

bool is_small(const Value& value) {
  if (!value.data || !value.type.content) return false;
  ByteCounter counter;
  value.type.content->pack(value.data.get(), counter);
  return counter.count <= FailedCalls::kMostBytesOfInput;
}

void add_items(const Value& value, const std::string& place, std::vector<RecordedInput>& items,
               const std::function<std::string(const Value&, const std::string& place)>& file_of) {
  if (!value.is_list()) {
    items.push_back({place, value.is_absent() ? "" : value.key.hex(), file_of(value, place)});
    return;
  }
  const std::vector<std::string> names = distinct_names(value.names);
  for (std::size_t i = 0; i < value.items.size(); ++i)
    add_items(value.items[i], (place.empty() ? "" : place + "/") + file_name_of(names[i]), items, file_of);
}

json options_of(const PipelineNode& node) {
  json options = json::object();
  for (std::size_t i = 0; i < node.options.size(); ++i)
    options[node.info.options[i].name] = json_of_option(node.options[i]);
  return options;
}

KeysOfCalls keys_from(const json& results) {
  KeysOfCalls keys;
  for (const json& one : results) {
    const std::optional<Digest> key = digest_of_hex(one.at(3).get<std::string>());
    if (key) keys[{one.at(0), one.at(1), one.at(2)}] = *key;
  }
  return keys;
}

RecordedCall from_json(const fs::path& folder, const json& call) {
  RecordedCall read;
  read.run = (folder / call.at("run").get<std::string>()).lexically_normal();
  read.within = call.at("within");
  read.node = call.at("node");
  read.item = call.at("item");
  read.path = call.at("path");
  read.place = call.at("place");
  read.uses = call.at("uses");
  read.reason = call.at("reason");
  read.seed = call.at("seed");
  read.call_seed = call.at("call_seed");
  read.threads = call.at("threads");
  read.file_limits = {call.at("file_memory_mb"), call.at("file_seconds")};
  read.has_inputs = !call.at("inputs").is_null();
  if (!read.has_inputs) return read;
  for (const auto& [port, items] : call.at("inputs").items())
    for (const json& item : items) read.inputs[port].push_back({item.at("place"), item.at("key"), item.at("file")});
  return read;
}

}  // namespace

std::vector<RecordedInput> items_of_input(const Value& value) {
  std::vector<RecordedInput> items;
  add_items(value, "", items, [](const Value&, const std::string&) { return ""; });
  return items;
}

FailedCalls::FailedCalls(const fs::path& run_folder, const Catalogue& catalogue, RunSettings& settings)
    : run_folder_(run_folder),
      catalogue_(catalogue),
      seed_(settings.seed),
      threads_(settings.threads),
      file_limits_(settings.file_limits) {
  settings.on_failed_call = [this](const FailedCall& call) { keep(call); };
  settings.call_keys = &keys_;
}

void FailedCalls::keep(const FailedCall& call) {
  const std::scoped_lock lock(mutex_);
  if (++failures_[call.path] > kMostOfNode) return;
  try {
    write(call);
  } catch (const std::exception&) {  // the disk is full, say: the message of the failure itself counts more
  }
}

void FailedCalls::write(const FailedCall& call) {
  const fs::path base = run_folder_ / "failed" / path_of_folders(call.path);
  const fs::path folder = new_folder(call.place.empty() ? base : base / path_of_folders(call.place));
  json inputs = call.inputs.empty() && !call.node.info.inputs.empty() ? json() : json::object();
  for (std::size_t i = 0; i < call.inputs.size(); ++i) {
    const std::string& port = call.node.info.inputs[i].name;
    std::vector<RecordedInput> items;
    add_items(call.inputs[i], "", items, [&](const Value& value, const std::string& place) -> std::string {
      if (!is_small(value) || !catalogue_.find_writer(value.type)) return "";
      RunFolder::Written written;
      const fs::path stem = folder / "inputs" / port;
      write_value(value, place.empty() ? stem : stem / place, folder, catalogue_, written);
      return written.files.empty() ? "" : written.files[0];
    });
    inputs[port] = json::array();
    for (const RecordedInput& item : items)
      inputs[port].push_back({{"place", item.place}, {"key", item.key}, {"file", item.file}});
  }
  const json record = {{"run", run_folder_.lexically_relative(folder).string()},
                       {"within", call.within},
                       {"node", call.node.id},
                       {"item", call.item},
                       {"path", call.path},
                       {"place", call.place},
                       {"uses", call.node.info.name},
                       {"reason", call.reason},
                       {"seed", seed_},
                       {"call_seed", call.seed},
                       {"threads", threads_},
                       {"file_memory_mb", file_limits_.memory_mb},
                       {"file_seconds", file_limits_.seconds},
                       {"options", options_of(call.node)},
                       {"inputs", inputs}};
  write_text_file(folder / kCallFile, json_text(record, 1) + "\n");
  folders_.push_back(folder.lexically_relative(run_folder_).string());
}

void FailedCalls::finish() {
  const std::scoped_lock lock(mutex_);
  if (folders_.empty()) return;
  json results = json::array();
  for (const auto& [place, key] : keys_.all()) {
    results.push_back(place);
    results.back().push_back(key.hex());
  }
  write_text_file(run_folder_ / "failed" / kKeysFile, json_text(results) + "\n");
}

std::vector<std::string> FailedCalls::folders() const {
  const std::scoped_lock lock(mutex_);
  std::vector<std::string> folders = folders_;  // threads fail in any order
  std::sort(folders.begin(), folders.end());
  return folders;
}

RecordedCall read_failed_call(const fs::path& folder) {
  const fs::path file = folder / kCallFile;
  std::error_code error;
  if (!fs::exists(file, error))
    throw Error(folder.string() + " is not the folder of a failed call: it has no " + kCallFile +
                "; give one of those below failed/ in the folder of a run");
  const fs::path whole = fs::canonical(folder);
  try {
    RecordedCall read = from_json(whole, parse_json(read_text_file(file, kMostRecordBytes), file.string()));
    // A run that was killed did not write the keys. Then what a plugin made that has been rebuilt is made again.
    const fs::path keys = read.run / "failed" / kKeysFile;
    if (fs::exists(keys, error))
      read.kept = keys_from(parse_json(read_text_file(keys, kMostRecordBytes), keys.string()));
    return read;
  } catch (const json::exception&) {
    throw Error(file.string() + " is not what 'marrow run' wrote; run the pipeline again");
  }
}

}  // namespace marrow
