// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/plugins/manifest.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/runtime/node/declaration.hpp"

#include <algorithm>
#include <cctype>
#include <iterator>
#include <limits>
#include <set>

#include "marrow/base/error.hpp"
#include "marrow/base/json_text.hpp"
#include "marrow/plugin.hpp"
#include "marrow/runtime/process/worker.hpp"

namespace marrow {
namespace {

using nlohmann::json;
constexpr int kManifestVersion = 6;  // 6: the checksum is of the text that follows it
constexpr std::string_view kChecksum = "{\"checksum\": \"";
constexpr std::size_t kDigits = 32;  // of a checksum
constexpr const char* kOptionTypes[] = {"boolean", "integer", "number", "text", "path", "numbers", "texts", "paths"};
constexpr const char* kApart[] = {"no", "parses", "computes"};
constexpr std::int64_t kMostBytes_of_value = 1 << 30;
constexpr std::size_t kMostLinked = 20'000;  // some Python packages load thousands of files

json json_of(const TypeInfo& type) {
  return {{"id", type.id}, {"version", type.version}, {"size", type.size}, {"function", type.is_function}};
}

json json_of(const PortInfo& port) {
  return {{"name", port.name},         {"help", port.help}, {"type", json_of(port.type)},
          {"optional", port.optional}, {"axis", port.axis}, {"figures", port.figures}};
}

json json_of(const OptionInfo& option) {
  json j = {{"name", option.name},         {"help", option.help},
            {"unit", option.unit},         {"type", kOptionTypes[int(option.type)]},
            {"required", option.required}, {"default", marrow::json_of(option.default_value)},
            {"choices", option.choices},   {"length", option.length},
            {"replaces", option.replaces}};
  if (option.minimum) j["minimum"] = *option.minimum;
  if (option.maximum) j["maximum"] = *option.maximum;
  return j;
}

json json_of(const KindPort& port) {
  json j = {{"name", port.name}, {"help", port.help}, {"axis", port.axis}, {"types", json::array()}};
  for (const TypeInfo& type : port.types) j["types"].push_back(json_of(type));
  return j;
}

json json_of(const KindInfo& kind) {
  json j = {{"name", kind.name},
            {"summary", kind.summary},
            {"sees_truth", kind.sees_truth},
            {"apart", kApart[int(kind.apart)]}};
  j["inputs"] = j["outputs"] = j["traits"] = j["checks"] = json::array();
  for (const KindPort& port : kind.inputs) j["inputs"].push_back(json_of(port));
  for (const KindPort& port : kind.outputs) j["outputs"].push_back(json_of(port));
  for (const TraitInfo& trait : kind.traits) j["traits"].push_back({{"name", trait.name}, {"help", trait.help}});
  for (const CheckInfo& check : kind.checks)
    j["checks"].push_back({{"name", check.name}, {"what", check.what}, {"limit", check.limit}, {"unit", check.unit}});
  return j;
}

json json_of(const WriterInfo& writer) {
  return {{"type", json_of(writer.type)}, {"extension", writer.extension}, {"help", writer.help}};
}

[[noreturn]] void damaged(const std::string& what) { throw Error("it is damaged: " + what); }

/// Reads an object of the manifest. Checks that it has the expected number of fields, and that each field is there with
/// the right type.
class JsonObject {
 public:
  JsonObject(const json& object, std::string name, std::size_t count) : object_(object), name_(std::move(name)) {
    if (!object.is_object()) damaged(name_ + " is not an object");
    if (object.size() != count) damaged(formatted("{} has {} fields, expected {}", name_, object.size(), count));
  }
  const json& at(const char* key) const {
    const auto found = object_.find(key);
    if (found == object_.end()) damaged(name_ + " has no '" + key + "'");
    return *found;
  }
  std::string text(const char* key) const { return text_of(at(key), key); }
  bool boolean(const char* key) const {
    if (!at(key).is_boolean()) damaged(said(key) + "is neither true nor false");
    return at(key).get<bool>();
  }
  double number(const char* key) const { return number_of(at(key), key); }
  std::int64_t integer(const char* key, std::int64_t least, std::int64_t most) const {
    try {
      return integer_of(at(key), least, most, name_ + ": '" + key + "'");
    } catch (const Error& error) {
      damaged(error.what());
    }
  }
  const json& list(const char* key) const {
    if (!at(key).is_array()) damaged(said(key) + "is not a list");
    return at(key);
  }
  std::vector<std::string> texts(const char* key) const {
    std::vector<std::string> result;
    for (const json& item : list(key)) result.push_back(text_of(item, key));
    return result;
  }
  std::vector<double> numbers(const char* key) const {
    std::vector<double> result;
    for (const json& item : list(key)) result.push_back(number_of(item, key));
    return result;
  }

 private:
  std::string said(const char* key) const { return name_ + ": '" + key + "' "; }
  std::string text_of(const json& j, const char* key) const {
    if (!j.is_string()) damaged(said(key) + "is not a text");
    return j.get<std::string>();
  }
  double number_of(const json& j, const char* key) const {
    if (!j.is_number()) damaged(said(key) + "is not a number");
    return j.get<double>();
  }

  const json& object_;
  std::string name_;
};

TypeInfo type_from(const json& j) {
  const JsonObject fields(j, "a type", 4);
  const auto version = int(fields.integer("version", 0, std::numeric_limits<int>::max()));
  return {fields.text("id"), version, std::size_t(fields.integer("size", 1, kMostBytes_of_value)),
          fields.boolean("function")};
}

PortInfo port_from(const json& j) {
  const JsonObject fields(j, "a port", 6);
  return {fields.text("name"),        fields.text("help"), type_from(fields.at("type")),
          fields.boolean("optional"), fields.text("axis"), fields.texts("figures")};
}

OptionValue default_from(const JsonObject& fields, OptionType type) {
  switch (type) {
    case OptionType::boolean:
      return fields.boolean("default");
    case OptionType::integer:
      return fields.integer("default", INT64_MIN, INT64_MAX);
    case OptionType::number:
      return fields.number("default");
    case OptionType::text:
    case OptionType::path:
      return fields.text("default");
    case OptionType::numbers:
      return fields.numbers("default");
    default:
      return fields.texts("default");
  }
}

/// The index of a text in a list of names.
template <std::size_t Count>
int one_of(const char* const (&names)[Count], const std::string& text, const std::string& what) {
  const auto found = std::find(std::begin(names), std::end(names), text);
  if (found == std::end(names)) damaged("there is no " + what + " '" + text + "'");
  return int(found - std::begin(names));
}

OptionInfo option_from(const json& j) {
  const JsonObject fields(j, "an option", 9 + j.contains("minimum") + j.contains("maximum"));
  OptionInfo option;
  option.name = fields.text("name");
  option.help = fields.text("help");
  option.unit = fields.text("unit");
  option.type = OptionType(one_of(kOptionTypes, fields.text("type"), "type of options"));
  option.required = fields.boolean("required");
  option.default_value = default_from(fields, option.type);
  option.choices = fields.texts("choices");
  option.length = std::size_t(fields.integer("length", 0, kMostBytes_of_value));
  option.replaces = fields.texts("replaces");
  const auto* numbers = std::get_if<std::vector<double>>(&option.default_value);
  if (option.length && (!numbers || numbers->size() != option.length))
    damaged(formatted("the default of '{}' does not have {} numbers", option.name, option.length));
  if (j.contains("minimum")) option.minimum = fields.number("minimum");
  if (j.contains("maximum")) option.maximum = fields.number("maximum");
  return option;
}

RelationInfo relation_from(const json& j) {
  const JsonObject fields(j, "a relation", 2);
  return {RelationType(one_of(kRelationTypes, fields.text("type"), "relation")), fields.texts("names")};
}

/// The node must obey the same rules as when a library registers it.
NodeInfo node_from(const json& j) {
  const JsonObject fields(j, "a node", 8);
  NodeDefinition node;
  node.info.name = fields.text("name");
  node.info.summary = fields.text("summary");
  node.info.random = fields.boolean("random");
  for (const json& port : fields.list("inputs")) node.info.inputs.push_back(port_from(port));
  for (const json& port : fields.list("outputs")) node.info.outputs.push_back(port_from(port));
  for (const json& option : fields.list("options")) node.info.options.push_back(option_from(option));
  for (const json& relation : fields.list("relations")) node.info.relations.push_back(relation_from(relation));
  node.info.traits = fields.texts("traits");
  detail::check_declaration(node);
  if (!node.faults.empty()) damaged(node.info.name + ": " + node.faults.front());
  return std::move(node.info);
}

KindPort kind_port_from(const json& j) {
  const JsonObject fields(j, "a port of a kind", 4);
  KindPort port{fields.text("name"), fields.text("help"), {}, fields.text("axis")};
  for (const json& type : fields.list("types")) port.types.push_back(type_from(type));
  return port;
}

/// The kind must obey the same rules as when a library registers it.
KindInfo kind_from(const json& j) {
  const JsonObject fields(j, "a kind", 8);
  KindDefinition kind;
  kind.info.name = fields.text("name");
  kind.info.summary = fields.text("summary");
  kind.info.sees_truth = fields.boolean("sees_truth");
  kind.info.apart = Apart(one_of(kApart, fields.text("apart"), "way to run apart"));
  for (const json& port : fields.list("inputs")) kind.info.inputs.push_back(kind_port_from(port));
  for (const json& port : fields.list("outputs")) kind.info.outputs.push_back(kind_port_from(port));
  for (const json& trait : fields.list("traits")) {
    const JsonObject of_trait(trait, "a trait", 2);
    kind.info.traits.push_back({of_trait.text("name"), of_trait.text("help")});
  }
  for (const json& check : fields.list("checks")) {
    const JsonObject of_check(check, "a check", 4);
    kind.info.checks.push_back(
        {of_check.text("name"), of_check.text("what"), of_check.number("limit"), of_check.text("unit")});
  }
  detail::check_declaration(kind);
  if (!kind.faults.empty()) damaged("kind " + kind.info.name + ": " + kind.faults.front());
  return std::move(kind.info);
}

WriterInfo writer_from(const json& j) {
  const JsonObject fields(j, "a writer", 3);
  WriterInfo writer{type_from(fields.at("type")), fields.text("extension"), fields.text("help")};
  // The extension becomes the end of a file's path.
  const bool plain = std::all_of(writer.extension.begin(), writer.extension.end(),
                                 [](unsigned char c) { return std::isalnum(c) || c == '.' || c == '_' || c == '-'; });
  if (!plain || (!writer.extension.empty() && writer.extension[0] != '.'))
    damaged("'" + writer.extension + "' is not an extension of files");
  return writer;
}

std::string full_path_from(const json& j, const char* of_what) {
  std::string path;
  try {
    path = bytes_of_json(j);
  } catch (const Error& error) {
    damaged(std::string("the path of ") + of_what + ": " + error.what());
  }
  if (path.empty() || path[0] != '/' || path.find('\0') != std::string::npos)
    damaged("'" + path + "' is not the full path of " + of_what);
  return path;
}

LinkedLibrary linked_from(const json& j) {
  const JsonObject fields(j, "a linked library", 2);
  return {full_path_from(fields.at("path"), "a library"), std::uint64_t(fields.integer("size", 0, INT64_MAX))};
}

SearchedFolder searched_from(const json& j) {
  const JsonObject fields(j, "a searched folder", 2);
  return {full_path_from(fields.at("path"), "a folder"), fields.texts("names")};
}

json parsed(const std::string& text) {
  if (text.size() > kMostManifest_bytes) damaged(formatted("it has {} bytes", text.size()));
  try {
    return parse_json(text, "its text");
  } catch (const Error& error) {
    damaged(error.what());
  }
}

/// Checks the version, and the checksum of a text.
void check(const std::string& text, const json& j) {
  if (!j.is_object()) damaged("it is not an object");
  if (!j.contains("marrow_manifest") || j["marrow_manifest"] != kManifestVersion)
    throw Error("it was written by another version of marrow");
  if (!j.contains("checksum")) damaged("it has no checksum");
  const std::string_view checked = std::string_view(text).substr(std::min(text.size(), kChecksum.size() + kDigits));
  if (!text.starts_with(kChecksum) ||
      hash_of_bytes(checked.data(), checked.size()).hex() != text.substr(kChecksum.size(), kDigits))
    throw Error("it was edited by hand");
}

}  // namespace

json json_of(const NodeInfo& node) {
  json j = {{"name", node.name}, {"summary", node.summary}, {"random", node.random}};
  j["inputs"] = j["outputs"] = j["options"] = j["relations"] = json::array();
  for (const PortInfo& port : node.inputs) j["inputs"].push_back(json_of(port));
  for (const PortInfo& port : node.outputs) j["outputs"].push_back(json_of(port));
  for (const OptionInfo& option : node.options) j["options"].push_back(json_of(option));
  for (const RelationInfo& relation : node.relations)
    j["relations"].push_back({{"type", relation_type_name(relation.type)}, {"names", relation.names}});
  j["traits"] = node.traits;
  return j;
}

json library_json(const LibraryInfo& info) {
  json j = {{"marrow_manifest", kManifestVersion}, {"library", info.digest.hex()}, {"refused", info.refused}};
  j["linked"] = j["searched"] = j["kinds"] = j["nodes"] = j["writers"] = json::array();
  for (const LinkedLibrary& library : info.linked)
    j["linked"].push_back({{"path", json_of_bytes(library.path)}, {"size", library.size}});
  for (const SearchedFolder& folder : info.searched)
    j["searched"].push_back({{"path", json_of_bytes(folder.path)}, {"names", folder.names}});
  for (const KindInfo& kind : info.kinds) j["kinds"].push_back(json_of(kind));
  for (const NodeInfo& node : info.nodes) j["nodes"].push_back(json_of(node));
  for (const WriterInfo& writer : info.writers) j["writers"].push_back(json_of(writer));
  return j;
}

std::string with_checksum(const json& document) {
  const std::string text = "\"" + std::string(document.empty() ? "" : ",") + document.dump(1).substr(1) + "\n";
  return std::string(kChecksum) + hash_of_bytes(text.data(), text.size()).hex() + text;
}

std::string manifest_text(const LibraryInfo& info) { return with_checksum(library_json(info)); }

LibraryInfo manifest_from_text(const std::string& text) {
  JsonDocument document(parsed(text));
  check(text, document.value());
  document.value().erase("checksum");
  return library_from_json(document.value());
}

LibraryInfo library_from_json(const json& j) {
  const JsonObject fields(j, "it", 8);
  LibraryInfo info;
  const std::optional<Digest> digest = digest_of_hex(fields.text("library"));
  if (!digest) damaged("the library's digest is not 32 hexadecimal digits");
  info.digest = *digest;
  info.refused = fields.text("refused");
  if (fields.list("linked").size() > kMostLinked)
    damaged(formatted("it names more than {} linked libraries", kMostLinked));
  for (const json& library : fields.list("linked")) info.linked.push_back(linked_from(library));
  for (const json& folder : fields.list("searched")) info.searched.push_back(searched_from(folder));
  std::set<std::string> kinds, names;
  for (const json& kind : fields.list("kinds")) {
    info.kinds.push_back(kind_from(kind));
    if (!kinds.insert(info.kinds.back().name).second) damaged("it has the kind '" + info.kinds.back().name + "' twice");
  }
  for (const json& node : fields.list("nodes")) {
    info.nodes.push_back(node_from(node));
    if (!names.insert(info.nodes.back().name).second) damaged("it has the node '" + info.nodes.back().name + "' twice");
  }
  for (const json& writer : fields.list("writers")) info.writers.push_back(writer_from(writer));
  if (!info.refused.empty() && !(info.kinds.empty() && info.nodes.empty() && info.writers.empty()))
    damaged("it has nodes of a library that it refuses");
  return info;
}

LibraryInfo info_of_nodes(const json& nodes) {
  json j = library_json({});
  j["nodes"] = nodes;
  return library_from_json(j);
}

}  // namespace marrow
