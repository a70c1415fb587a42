// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/network/description.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <utility>

#include "marrow/base/names.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/toolbox/files/yaml_values.hpp"

namespace marrow::network {
namespace {

using files::YamlFile, files::YamlMap;

constexpr int kLargestTile_px = 4096, kMostNames = 256, kMostSlices = 31, kLargestStride_px = 64;

template <class Enum>
using Choices = std::vector<std::pair<const char*, Enum>>;

const Choices<Values> kValues{{"line_integrals", Values::line_integrals},
                              {"grey_values", Values::grey_values},
                              {"hounsfield", Values::hounsfield}};
const Choices<bool> kBone{{"bright", true}, {"dark", false}};
const Choices<Normalisation::Method> kMethods{{"percentiles", Normalisation::Method::percentiles},
                                              {"deviation", Normalisation::Method::deviation},
                                              {"fixed", Normalisation::Method::fixed}};
const Choices<Output::Activation> kActivations{{"none", Output::Activation::none},
                                               {"sigmoid", Output::Activation::sigmoid},
                                               {"softmax", Output::Activation::softmax}};
const Choices<Output::Kind> kKinds{{"classes", Output::Kind::classes},
                                   {"edge_strength", Output::Kind::edge_strength},
                                   {"heat_maps", Output::Kind::heat_maps}};

/// The names with commas between them.
std::string listed(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

template <class Enum>
std::vector<std::string> names_of(const Choices<Enum>& choices) {
  std::vector<std::string> names;
  for (const auto& [name, value] : choices) names.emplace_back(name);
  return names;
}

template <class Enum>
std::string name_in(const Choices<Enum>& choices, Enum value) {
  for (const auto& [name, one] : choices)
    if (one == value) return name;
  return "";
}

template <class Enum>
void take_choice(const YamlMap& map, const std::string& key, const Choices<Enum>& choices, Enum& value) {
  const auto text = map.text(key);
  if (!text) return;
  for (const auto& [name, one] : choices)
    if (*text == name) {
      value = one;
      return;
    }
  map.fault(key, key + ": expected " + listed(names_of(choices)) + "; got '" + *text + "'");
}

void take_text(const YamlMap& map, const std::string& key, std::string& value) {
  if (const auto text = map.text(key)) value = *text;
}

void take_integer(const YamlMap& map, const std::string& key, int least, int most, int& value) {
  const auto number = map.integer(key);
  if (!number) return;
  if (*number < least || *number > most)
    return map.fault(key, formatted("{}: expected {} to {}, got {}", key, least, most, *number));
  value = *number;
}

void take_number(const YamlMap& map, const std::string& key, double least, double most, double& value) {
  const auto number = map.number(key);
  if (!number) return;
  if (!(*number >= least && *number <= most))
    return map.fault(key, formatted("{}: expected {:g} to {:g}, got {:g}", key, least, most, *number));
  value = *number;
}

Normalisation normalisation_of(const YamlMap& input) {
  Normalisation normalisation;
  const auto node = input.required("normalise");
  if (!node) return normalisation;
  const YamlMap map(input.file(), *node, "normalise", {"method", "low", "high"});
  take_choice(map, "method", kMethods, normalisation.method);
  if (normalisation.method == Normalisation::Method::deviation) {
    for (const char* key : {"low", "high"})
      if (map.has(key)) map.fault(key, std::string(key) + ": the method 'deviation' takes no numbers");
    return normalisation;
  }
  const bool is_percent = normalisation.method == Normalisation::Method::percentiles;
  take_number(map, "low", is_percent ? 0 : -1e6, is_percent ? 100 : 1e6, normalisation.low);
  take_number(map, "high", is_percent ? 0 : -1e6, is_percent ? 100 : 1e6, normalisation.high);
  if (map.valid() && !(normalisation.low < normalisation.high))
    map.fault("high", formatted("high: expected more than low, {:g}, got {:g}", normalisation.low, normalisation.high));
  return normalisation;
}

void take_tile(const YamlMap& map, Input& input) {
  if (const auto size = map.numbers("size_px", 2)) {
    for (const double side : *size)
      if (side < 8 || side > kLargestTile_px || side != std::floor(side))
        map.fault("size_px", formatted("size_px: expected whole numbers of rows and columns, 8 to {}, got {:g}",
                                       kLargestTile_px, side));
    input.size_px = {int((*size)[1]), int((*size)[0])};
  }
  take_integer(map, "overlap_px", 0, kLargestTile_px, input.overlap_px);
  const int least = std::min(input.size_px.width, input.size_px.height);
  if (least > 0 && input.overlap_px > least / 2)
    map.fault("overlap_px", formatted("overlap_px: expected at most half the tile's shorter side, {}, got {}",
                                      least / 2, input.overlap_px));
}

Input input_of(const YamlMap& description) {
  Input input;
  const auto node = description.required("input");
  if (!node) return input;
  const YamlMap map(description.file(), *node, "input",
                    {"values", "bone", "pixel_mm", "pixel_px", "normalise", "size_px", "overlap_px", "slices"});
  take_choice(map, "values", kValues, input.values);
  take_choice(map, "bone", kBone, input.bone_is_bright);
  if (map.has("pixel_mm") == map.has("pixel_px"))
    map.fault(map.has("pixel_mm") ? "pixel_px" : "",
              "expected one of pixel_mm (its size at the bone) and pixel_px (in pixels of the image), got " +
                  std::string(map.has("pixel_mm") ? "both" : "none"));
  if (map.has("pixel_mm")) take_number(map, "pixel_mm", 0.01, 100, input.pixel_mm);
  if (map.has("pixel_px")) take_number(map, "pixel_px", 0.1, 100, input.pixel_px);
  input.normalisation = normalisation_of(map);
  take_tile(map, input);
  if (map.has("slices")) {
    take_integer(map, "slices", 1, kMostSlices, input.slices);
    if (input.slices % 2 == 0)
      map.fault("slices",
                formatted("slices: expected an odd number, so that one is in the middle, got {}", input.slices));
    if (input.slices > 1 && input.values != Values::hounsfield)
      map.fault("slices", "slices: only a CT has slices; values are not 'hounsfield'");
  }
  return input;
}

void take_names(const YamlMap& map, Output& output) {
  if (output.kind == Output::Kind::edge_strength) return;
  output.names = map.texts_or_none("names");
  if (output.names.empty()) map.fault("names", "names: expected the names of its channels, got none");
  if (output.names.size() > kMostNames)
    map.fault("names", formatted("names: expected at most {}, got {}", kMostNames, output.names.size()));
  const std::set<std::string> different(output.names.begin(), output.names.end());
  if (different.size() != output.names.size()) map.fault("names", "names: one occurs twice");
}

Output output_of(const YamlMap& outputs, const std::string& key, Output::Kind kind) {
  Output output;
  output.kind = kind;
  std::vector<std::string> keys{"layer", "activation", "stride_px"};
  if (kind != Output::Kind::edge_strength) keys.emplace_back("names");
  if (kind == Output::Kind::heat_maps) keys.emplace_back("deviation_factor");
  const YamlMap map(outputs.file(), outputs.node(key), "output '" + key + "'", keys);
  take_text(map, "layer", output.layer);
  take_names(map, output);
  take_choice(map, "activation", kActivations, output.activation);
  if (output.activation == Output::Activation::softmax && kind != Output::Kind::classes)
    map.fault("activation", "activation: only classes exclude each other; expected none or sigmoid, got 'softmax'");
  if (map.has("stride_px")) take_integer(map, "stride_px", 1, kLargestStride_px, output.stride_px);
  if (map.has("deviation_factor")) take_number(map, "deviation_factor", 1e-3, 1e3, output.deviation_factor);
  return output;
}

/// Tiles must begin at whole pixels of each output.
void check_strides(const YamlMap& map, const Input& input, const std::vector<Output>& outputs) {
  for (const Output& output : outputs)
    if (input.size_px.width % output.stride_px || input.size_px.height % output.stride_px ||
        input.overlap_px % (2 * output.stride_px))
      map.fault("input", formatted("size_px and half of overlap_px must be multiples of the stride of '{}', {}",
                                   name_in(kKinds, output.kind), output.stride_px));
}

std::vector<Output> outputs_of(const YamlMap& description) {
  std::vector<Output> outputs;
  const auto node = description.required("outputs");
  if (!node) return outputs;
  const YamlMap map(description.file(), *node, "outputs", names_of(kKinds));
  for (const auto& [key, kind] : kKinds)
    if (map.has(key)) outputs.push_back(output_of(map, key, kind));
  if (map.valid() && outputs.empty())
    description.fault("outputs", "expected " + listed(names_of(kKinds)) + "; got none");
  return outputs;
}

}  // namespace

Description read_description(const std::filesystem::path& path) {
  YamlFile file(path);
  const YamlMap map(file, file.root(), "network",
                    {"marrow-network", "name", "help", "version", "licence", "trained", "input", "outputs"});
  files::check_version(map, "marrow-network");
  Description description;
  description.file = path;
  description.model = std::filesystem::path(path).replace_extension(".onnx");
  take_text(map, "name", description.name);
  take_text(map, "help", description.help);
  take_text(map, "version", description.version);
  take_text(map, "licence", description.licence);
  if (const auto node = map.required("trained")) {
    const YamlMap trained(file, *node, "trained", {"data", "good_for", "not_for"});
    take_text(trained, "data", description.trained_on);
    take_text(trained, "good_for", description.good_for);
    take_text(trained, "not_for", description.not_for);
  }
  description.input = input_of(map);
  description.outputs = outputs_of(map);
  check_strides(map, description.input, description.outputs);
  file.finish();
  return description;
}

const Output& output_of(const Description& description, Output::Kind kind) {
  std::vector<std::string> there;
  for (const Output& output : description.outputs) {
    if (output.kind == kind) return output;
    there.push_back(name_in(kKinds, output.kind));
  }
  throw Error(description.file.string() + ": the network has no output '" + name_in(kKinds, kind) + "'; it has " +
              listed(there));
}

std::vector<std::size_t> channels_of_classes(const Description& description, const Output& output,
                                             const std::vector<std::string>& names) {
  std::vector<std::size_t> channels;
  for (const std::string& name : names) {
    const auto found = std::find(output.names.begin(), output.names.end(), name);
    if (found == output.names.end())
      throw Error(description.file.string() + ": the network has no class '" + name + "'; " +
                  suggestion(name, output.names));
    channels.push_back(std::size_t(found - output.names.begin()));
  }
  return channels;
}

void expect_values(const Description& description, std::initializer_list<Values> can_give, const std::string& node) {
  std::vector<std::string> given;
  for (const Values values : can_give) {
    if (values == description.input.values) return;
    given.push_back(name_in(kValues, values));
  }
  throw Error(description.file.string() + ": the network wants values: " + name_in(kValues, description.input.values) +
              ", but " + node + " can give only " + listed(given));
}

}  // namespace marrow::network
