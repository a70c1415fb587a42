// SPDX-License-Identifier: Apache-2.0
// The inputs that a pipeline declares, and their values.
#include "marrow/runtime/pipeline/pipeline_text.hpp"

#include <algorithm>

#include "marrow/base/file_names.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/runtime/node/option_yaml.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;

const std::vector<std::string> kTextTypes{"path", "text", "number", "integer", "boolean"};

void set_type(DeclaredInput& input, const YamlEntry& entry, const PipelineLayer& layer, const Catalogue& catalogue) {
  const auto type = layer.yaml.text(entry.value, entry.place, "type");
  if (!type) return;
  input.type = *type;
  input.data.reset();
  if (contains(kTextTypes, *type)) return;
  const std::map<std::string, TypeInfo> types = catalogue.types();
  if (const auto found = types.find(*type); found != types.end()) {
    input.data = found->second;
    return;
  }
  std::vector<std::string> names = kTextTypes;
  for (const auto& [name, known] : types) names.push_back(name);
  layer.yaml.fault(entry.place, "unknown type " + in_quotes(*type) + " of input " + in_quotes(input.name),
                   suggestion(*type, names));
}

void read_input(DeclaredInput& input, const YamlEntry& written, const PipelineLayer& layer,
                const Catalogue& catalogue) {
  static const std::vector<std::string> kKeys{"type", "default", "help", "over", "optional"};
  std::optional<Place> over, optional;
  for (const YamlEntry& entry :
       layer.yaml.map(written.value, written.place, "input " + in_quotes(input.name), &kKeys)) {
    if (entry.key == "help") input.help = layer.yaml.text(entry.value, entry.place, "help").value_or("");
    if (entry.key == "default") {
      input.default_value.reset();
      if (!entry.value.IsNull()) input.default_value = layer.value_of(entry);
    }
    if (entry.key == "type") set_type(input, entry, layer, catalogue);
    if (entry.key == "over") {
      over = entry.place;
      input.over = layer.yaml.text(entry.value, entry.place, "over").value_or("");
    }
    if (entry.key == "optional") {
      optional = entry.place;
      input.is_optional = layer.yaml.boolean(entry.value, entry.place, "optional").value_or(false);
    }
  }
  const std::string who = "input " + in_quotes(input.name);
  for (const auto& [place, key] : {std::pair{over, "over"}, {optional, "optional"}})
    if (place && !input.data)
      layer.yaml.fault(*place, in_quotes(key) + " is for inputs of data, and " + who + " is a " + input.type,
                       std::string(key) == "optional" ? "give it a  default:  instead" : "");
  if (input.data && input.default_value)
    layer.yaml.fault(input.default_value->place, who + " is of type " + input.type + ", which has no default",
                     "a part may do without it by  optional: true");
}

OptionInfo info_of(const DeclaredInput& input) {
  OptionInfo info;
  info.type = OptionType::text;
  if (input.type == "path") info.type = OptionType::path;
  if (input.type == "number") info.type = OptionType::number;
  if (input.type == "integer") info.type = OptionType::integer;
  if (input.type == "boolean") info.type = OptionType::boolean;
  return info;
}

Place place_of(const InputValue& one) { return one.place.file.empty() ? Place{one.name + "=" + one.value} : one.place; }

/// A path as a whole path, an empty one as it is. `folder`: where it starts.
std::string whole_path(const std::string& path, const fs::path& folder) {
  return path.empty() ? path : plain_path(folder / path).string();
}

/// The value as a text, if it is good. A path becomes a whole path.
std::optional<std::string> checked(const DeclaredInput& input, const WrittenValue& value, Diagnostics& diagnostics) {
  const std::string who = "input " + in_quotes(input.name);
  const OptionInfo info = info_of(input);
  StrictYaml yaml = yaml_of(value, diagnostics);
  const auto no_names = [](const std::string& text, const Place&) { return std::optional(text); };
  if (!read_option(yaml, value.value, value.place, info, who, no_names)) return std::nullopt;
  const std::string text = value.value.Scalar();
  if (info.type != OptionType::path) return text;
  const auto& by_default = input.default_value;
  const bool may_be_empty = by_default && by_default->value.IsScalar() && by_default->value.Scalar().empty();
  if (text.empty() && !may_be_empty)
    diagnostics.add(value.place, who + " is an empty path",
                    "name a file or a folder; the folder in which you are is  .");
  return whole_path(text, value.folder);
}

}  // namespace

fs::path folder_of(const Place& written) {
  return written.file.empty() ? fs::current_path() : fs::absolute(written.file).parent_path();
}

void put_inputs_over(DeclaredInputs& inputs, const YamlEntry& section, const PipelineLayer& layer,
                     const Catalogue& catalogue) {
  for (const YamlEntry& entry : layer.yaml.map(section.value, section.place, "inputs")) {
    auto old = std::find_if(inputs.all.begin(), inputs.all.end(),
                            [&](const DeclaredInput& one) { return one.name == entry.key; });
    if (old != inputs.all.end() && entry.value.IsNull()) {
      inputs.all.erase(old);
      continue;
    }
    if (old == inputs.all.end()) {
      inputs.all.push_back({entry.key, entry.place});
      old = inputs.all.end() - 1;
    }
    old->place = entry.place;
    read_input(*old, entry, layer, catalogue);
  }
}

std::vector<PipelineInput> listed_inputs(const DeclaredInputs& inputs) {
  std::vector<PipelineInput> list;
  for (const DeclaredInput& one : inputs.all) {
    PipelineInput input{one.name, one.type, one.help};
    input.is_data = one.data.has_value();
    input.over = one.over;
    input.is_optional = one.is_optional;
    input.has_default = one.default_value && one.default_value->value.IsScalar();
    if (input.has_default) {
      input.default_text = one.default_value->value.Scalar();
      if (one.type == "path") input.default_text = whole_path(input.default_text, one.default_value->folder);
    }
    list.push_back(std::move(input));
  }
  return list;
}

void set_inputs(DeclaredInputs& inputs, const PipelineReading& reading, Diagnostics& diagnostics) {
  std::vector<std::string> names;
  for (const DeclaredInput& input : inputs.all) {
    names.push_back(input.name);
    std::optional<WrittenValue> value = input.default_value;
    for (const InputValue& one : reading.inputs)
      if (one.name == input.name && input.data)
        diagnostics.add(
            place_of(one),
            "input " + in_quotes(input.name) + " is data of type " + input.type + ", which only a node can give",
            "give it under  in:");
      else if (one.name == input.name)
        value = WrittenValue{place_of(one), YAML::Node(one.value), folder_of(one.place)};
    if (input.data) continue;
    if (!value) {
      inputs.missing.push_back(input.name);
      if (reading.use == PipelineReading::Use::alone)
        diagnostics.add(input.place, "input " + in_quotes(input.name) + " has no value",
                        "give it as  " + input.name + "=VALUE");
    } else if (const auto text = checked(input, *value, diagnostics)) {
      inputs.values[input.name] = *text;
    } else {
      inputs.missing.push_back(input.name);  // so that its users are no further faults
    }
  }
  for (const InputValue& one : reading.inputs)
    if (!contains(names, one.name))
      diagnostics.add(place_of(one), "the pipeline has no input " + in_quotes(one.name), suggestion(one.name, names));
}

}  // namespace marrow
