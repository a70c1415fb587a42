// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/pipeline/settings.hpp"

#include "marrow/base/printable.hpp"
#include "marrow/base/strict_yaml.hpp"
#include "marrow/runtime/pipeline/given_value.hpp"

namespace marrow {

void add_settings(const std::filesystem::path& file, PipelineArguments& arguments, Diagnostics& diagnostics) {
  static const std::vector<std::string> kKeys{"inputs", "set"};
  const int layer = arguments.overrides.empty() ? 0 : arguments.overrides.back().layer + 1;
  const auto text = read_source(file, "the file of settings", diagnostics);
  if (!text) return;
  StrictYaml yaml(file.string(), diagnostics);
  const std::size_t before = diagnostics.size();
  const YAML::Node root = yaml.parse(*text);
  if (diagnostics.size() > before) return;
  for (const YamlEntry& section : yaml.map(root, {file.string(), 1, 1}, "the file of settings", &kKeys))
    for (const YamlEntry& entry : yaml.map(section.value, section.place, in_quotes(section.key))) {
      if (section.key == "set")
        arguments.overrides.push_back({entry.key, text_to_give(entry.value), entry.place, layer});
      else if (const auto value = yaml.text(entry.value, entry.place, in_quotes(entry.key)))
        arguments.inputs.push_back({entry.key, *value, entry.place});
    }
}

}  // namespace marrow
