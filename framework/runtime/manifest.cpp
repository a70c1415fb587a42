// SPDX-License-Identifier: Apache-2.0
#include "manifest.hpp"

#include <algorithm>
#include <iterator>

#include "marrow/domain/error.hpp"

namespace marrow {
namespace {

using nlohmann::json;
constexpr int kManifestVersion = 1;
constexpr const char* kOptionTypes[] = {"boolean", "integer", "number", "text", "path", "numbers", "texts", "paths"};

json json_of(const TypeInfo& type) {
  return {{"id", type.id}, {"version", type.version}, {"size", type.size}, {"function", type.is_function}};
}
TypeInfo type_from(const json& j) { return {j.at("id"), j.at("version"), j.at("size"), j.at("function")}; }

json json_of(const PortInfo& port) {
  return {{"name", port.name}, {"help", port.help}, {"type", json_of(port.type)}, {"optional", port.optional}, {"axis", port.axis}};
}
PortInfo port_from(const json& j) {
  return {j.at("name"), j.at("help"), type_from(j.at("type")), j.at("optional"), j.at("axis")};
}

json json_of(const OptionInfo& option) {
  json j = {{"name", option.name},         {"help", option.help},
            {"unit", option.unit},         {"type", kOptionTypes[int(option.type)]},
            {"required", option.required}, {"default", marrow::json_of(option.default_value)},
            {"choices", option.choices},   {"length", option.length}};
  if (option.minimum) j["minimum"] = *option.minimum;
  if (option.maximum) j["maximum"] = *option.maximum;
  return j;
}

OptionValue value_from(const json& j, OptionType type) {
  switch (type) {
    case OptionType::boolean: return j.get<bool>();
    case OptionType::integer: return j.get<std::int64_t>();
    case OptionType::number: return j.get<double>();
    case OptionType::text:
    case OptionType::path: return j.get<std::string>();
    case OptionType::numbers: return j.get<std::vector<double>>();
    default: return j.get<std::vector<std::string>>();
  }
}

OptionInfo option_from(const json& j) {
  OptionInfo option;
  option.name = j.at("name");
  option.help = j.at("help");
  option.unit = j.at("unit");
  const std::string type = j.at("type");
  option.type = OptionType(std::find(std::begin(kOptionTypes), std::end(kOptionTypes), type) - std::begin(kOptionTypes));
  option.required = j.at("required");
  option.default_value = value_from(j.at("default"), option.type);
  option.choices = j.at("choices").get<std::vector<std::string>>();
  option.length = j.at("length");
  if (j.contains("minimum")) option.minimum = j.at("minimum").get<double>();
  if (j.contains("maximum")) option.maximum = j.at("maximum").get<double>();
  return option;
}

NodeInfo node_from(const json& j) {
  NodeInfo node;
  node.name = j.at("name");
  node.summary = j.at("summary");
  node.random = j.at("random");
  for (const json& port : j.at("inputs")) node.inputs.push_back(port_from(port));
  for (const json& port : j.at("outputs")) node.outputs.push_back(port_from(port));
  for (const json& option : j.at("options")) node.options.push_back(option_from(option));
  return node;
}

Digest digest_from(const std::string& hex) {
  if (hex.size() != 32) throw Error("a digest has 32 digits");
  return {std::stoull(hex.substr(16), nullptr, 16), std::stoull(hex.substr(0, 16), nullptr, 16)};
}

}  // namespace

const char* option_type_name(OptionType type) { return kOptionTypes[int(type)]; }

json json_of(const OptionValue& value) {
  return std::visit([](const auto& v) { return json(v); }, value);
}

json json_of(const NodeInfo& node) {
  json j = {{"name", node.name}, {"summary", node.summary}, {"random", node.random}};
  j["inputs"] = j["outputs"] = j["options"] = json::array();
  for (const PortInfo& port : node.inputs) j["inputs"].push_back(json_of(port));
  for (const PortInfo& port : node.outputs) j["outputs"].push_back(json_of(port));
  for (const OptionInfo& option : node.options) j["options"].push_back(json_of(option));
  return j;
}

std::string manifest_text(const LibraryInfo& info) {
  json j = {{"marrow_manifest", kManifestVersion}, {"library", info.digest.hex()}, {"refused", info.refused}};
  j["linked"] = j["nodes"] = j["writers"] = json::array();
  for (const LinkedLibrary& library : info.linked) j["linked"].push_back({{"path", library.path}, {"size", library.size}});
  for (const NodeInfo& node : info.nodes) j["nodes"].push_back(json_of(node));
  for (const WriterInfo& writer : info.writers)
    j["writers"].push_back({{"type", json_of(writer.type)}, {"extension", writer.extension}, {"help", writer.help}});
  j["checksum"] = hash_of(j.dump()).hex();
  return j.dump(1) + "\n";
}

LibraryInfo manifest_from_text(const std::string& text) try {
  json j = json::parse(text);
  if (j.at("marrow_manifest") != kManifestVersion) throw Error("it was written by another version of marrow");
  const std::string checksum = j.at("checksum");
  j.erase("checksum");
  if (hash_of(j.dump()).hex() != checksum) throw Error("it was edited by hand");
  LibraryInfo info;
  info.digest = digest_from(j.at("library"));
  info.refused = j.at("refused");
  for (const json& library : j.at("linked")) info.linked.push_back({library.at("path"), library.at("size")});
  for (const json& node : j.at("nodes")) info.nodes.push_back(node_from(node));
  for (const json& writer : j.at("writers"))
    info.writers.push_back({type_from(writer.at("type")), writer.at("extension"), writer.at("help")});
  return info;
} catch (const nlohmann::json::exception&) {
  throw Error("it is damaged");
}

}  // namespace marrow
