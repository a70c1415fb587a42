// SPDX-License-Identifier: Apache-2.0
#include "workbench/kept_inputs.hpp"

#include "marrow/base/json_text.hpp"
#include "marrow/base/text_file.hpp"

namespace marrow::workbench {

using nlohmann::json;

namespace {

constexpr const char* kFile = ".marrow/inputs.json";

}  // namespace

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
