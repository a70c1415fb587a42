// SPDX-License-Identifier: Apache-2.0
#include "workbench/pipeline.hpp"

#include <yaml-cpp/yaml.h>
#include <set>

#include "marrow/base/json_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/base/text_file.hpp"
#include "new/templates.hpp"

namespace fs = std::filesystem;

namespace marrow::workbench {
namespace {

using nlohmann::json;

constexpr std::size_t kMostSteps = 200;

std::string digest_of(const std::string& text) { return hash_of_bytes(text.data(), text.size()).hex(); }

/// The others hold parts of pipelines, experiments, and what the pages run themselves.
constexpr const char* kFamilies[] = {"bone",    "calibration", "femur", "guidance",
                                     "implant", "simulate",    "track", "wrist"};

/// {help, inputs} as the file itself says it; those of files that it extends are left out.
json described(const fs::path& file) {
  json shown = {{"help", ""}, {"inputs", json::array()}};
  try {
    const YAML::Node root = YAML::Load(read_text_file(file, kMostSourceBytes));
    if (root["help"].IsScalar()) shown["help"] = root["help"].Scalar();
    if (root["inputs"].IsMap())
      for (const auto& input : root["inputs"]) shown["inputs"].push_back(input.first.Scalar());
  } catch (const std::exception&) {  // it is offered without a description
  }
  return shown;
}

constexpr const char* kFile = ".marrow/inputs.json";

}  // namespace

void PipelineFiles::add(History& history, Step step) {
  history.steps.resize(history.steps.empty() ? 0 : history.at + 1);
  history.steps.push_back(std::move(step));
  if (history.steps.size() > kMostSteps) history.steps.erase(history.steps.begin());
  history.at = history.steps.size() - 1;
}

PipelineFiles::History& PipelineFiles::find(const std::string& file) {
  std::string text = read_text_file(folder_.inside(file), kMostSourceBytes);
  History& history = histories_[file];
  if (history.steps.empty())
    add(history, {"the file as it was found", std::move(text)});
  else if (history.steps[history.at].text != text)
    add(history, {"a change by another program", std::move(text)});
  return history;
}

PipelineFiles::History& PipelineFiles::find(const std::string& file, const std::string& revision) {
  History& history = find(file);
  if (digest_of(history.steps[history.at].text) != revision)
    throw Conflict(printable(file) + " was changed elsewhere; the page now shows what is newest");
  return history;
}

json PipelineFiles::shown(const std::string& file, const History& history) const {
  const std::string& text = history.steps[history.at].text;
  const bool can_redo = history.at + 1 < history.steps.size();
  return {{"file", file},
          {"text", text},
          {"revision", digest_of(text)},
          {"undo", history.at > 0 ? json(history.steps[history.at].what) : json()},
          {"redo", can_redo ? json(history.steps[history.at + 1].what) : json()}};
}

json PipelineFiles::open(const std::string& file) {
  const std::lock_guard lock(mutex_);
  return shown(file, find(file));
}

std::string PipelineFiles::revision(const std::string& file) const {
  return digest_of(read_text_file(folder_.inside(file), kMostSourceBytes));
}

json PipelineFiles::change(const std::string& file, const std::string& revision, const std::string& what,
                           const std::function<std::string(const std::string&)>& changed) {
  const std::lock_guard lock(mutex_);
  History& history = find(file, revision);
  std::string text = changed(history.steps[history.at].text);
  if (text != history.steps[history.at].text) {
    write_text_file(folder_.inside(file), text);
    add(history, {what, std::move(text)});
  }
  return shown(file, history);
}

json PipelineFiles::step(const std::string& file, const std::string& revision, int by) {
  const std::lock_guard lock(mutex_);
  History& history = find(file, revision);
  const std::size_t to = history.at + std::size_t(by);
  if (to < history.steps.size()) {  // a number below zero wraps around, and is too large
    write_text_file(folder_.inside(file), history.steps[to].text);
    history.at = to;
  }
  return shown(file, history);
}

json own_pipelines() {
  json all = json::array();
  for (const char* family : kFamilies) {
    std::set<fs::path> files;
    try {
      for (const fs::directory_entry& entry : fs::directory_iterator(cli::shared_files(fs::path("pipelines") / family)))
        if (entry.path().extension() == ".yaml") files.insert(entry.path());
    } catch (const std::exception&) {
      continue;
    }
    for (const fs::path& file : files) {
      all.push_back(described(file));
      all.back()["name"] = family + ("/" + file.stem().string());
    }
  }
  return all;
}

std::string copy_of_own_pipeline(const std::string& name, const OpenedFolder& folder) {
  for (const json& one : own_pipelines()) {
    if (one["name"] != name) continue;
    const fs::path from = cli::shared_files("pipelines/" + name + ".yaml");
    const fs::path target = folder.path() / from.filename();
    if (fs::symlink_status(target).type() != fs::file_type::not_found)
      throw Error(printable(from.filename().string()) + " exists in this folder already; open it, or rename it first");
    write_text_file(target, cli::moved_text(from, folder.path()));
    return folder.relative(target);
  }
  throw Error("marrow has no pipeline " + in_quotes(printable(name)) + " of its own");
}

using nlohmann::json;

json KeptInputs::all() const {
  try {
    json kept = parse_json(read_text_file(folder_.inside(kFile), kMostSourceBytes), kFile);
    return kept.is_object() ? kept : json::object();
  } catch (const std::exception&) {  // there is none yet, or it is damaged and is written anew
    return json::object();
  }
}

json KeptInputs::of(const std::string& file) const {
  const std::lock_guard lock(mutex_);
  const json kept = all();
  json inputs = json::object();
  if (const auto found = kept.find(file); found != kept.end() && found->is_object())
    for (const auto& [name, value] : found->items())
      if (value.is_string()) inputs[name] = value;
  return inputs;
}

void KeptInputs::keep(const std::string& file, const json& inputs) {
  const std::lock_guard lock(mutex_);
  json kept = all();
  if (!inputs.is_object() || kept.value(file, json()) == inputs) return;
  kept[file] = inputs;
  try {
    const std::filesystem::path place = folder_.inside(kFile);
    std::filesystem::create_directories(place.parent_path());
    write_text_file(place, json_text(kept, 1) + "\n");
  } catch (const std::exception&) {  // the folder may only be read
  }
}

}  // namespace marrow::workbench
