// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/plugins/manifest.hpp"

#include <cctype>
#include <iterator>
#include <set>

#include "marrow/base/json_text.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/plugin.hpp"
#include "marrow/runtime/plugins/library_fields.hpp"
#include "marrow/runtime/process/worker.hpp"

namespace marrow {
namespace {

using nlohmann::json;
constexpr int kManifestVersion = 8;  // 8: suites of kinds that other libraries declare
constexpr std::string_view kChecksum = "{\"checksum\": \"";
constexpr std::size_t kDigits = 32;  // of a checksum
constexpr std::int64_t kMostBytes_of_value = 1 << 30;
constexpr std::size_t kMostLinked = 20'000;  // some Python packages load thousands of files

template <class T>
json document_of(const std::vector<T>& items);

template <class T>
json document_of(const T& value) {
  if constexpr (HasNamedFields<T>) {
    json object;
    visit_fields(value, [&](const char* key, const auto& member) {
      json one = document_of(member);
      if (!one.is_null()) object[key] = std::move(one);  // a range that is not given
    });
    return object;
  } else if constexpr (std::is_enum_v<T>) {
    return ValueNames<T>::kNames[std::size_t(value)];
  } else if constexpr (std::is_same_v<T, OptionValue>) {
    return json_of(value);
  } else if constexpr (std::is_same_v<T, std::optional<double>>) {
    return value ? json(*value) : json();
  } else {
    return value;
  }
}

template <class T>
json document_of(const std::vector<T>& items) {
  json list = json::array();
  for (const T& item : items) list.push_back(document_of(item));
  return list;
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
  bool has(const char* key) const { return object_.contains(key); }
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

/// The index of a text in a list of names.
template <class Names>
int one_of(const Names& names, const std::string& text, const std::string& what) {
  const auto found = std::find(std::begin(names), std::end(names), text);
  if (found == std::end(names)) damaged("there is no " + what + " '" + text + "'");
  return int(found - std::begin(names));
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

/// Throws Error unless a library could register this.
template <class Definition, class Info>
void check_as_registered(Info& info, const std::string& what) {
  Definition definition;
  definition.info = std::move(info);
  detail::check_declaration(definition);
  if (!definition.faults.empty()) damaged(what + definition.info.name + ": " + definition.faults.front());
  info = std::move(definition.info);
}

/// Checks what the types of its fields do not guarantee.
template <class T>
void complete(const JsonObject&, T&) {}
void complete(const JsonObject& fields, TypeInfo&) { fields.integer("size", 1, kMostBytes_of_value); }
void complete(const JsonObject& fields, OptionInfo& option) {
  option.default_value = default_from(fields, option.type);
  const auto* numbers = std::get_if<std::vector<double>>(&option.default_value);
  if (option.length && (!numbers || numbers->size() != option.length))
    damaged(formatted("the default of '{}' does not have {} numbers", option.name, option.length));
}
void complete(const JsonObject&, NodeInfo& node) { check_as_registered<NodeDefinition>(node, ""); }
void complete(const JsonObject&, KindInfo& kind) { check_as_registered<KindDefinition>(kind, "kind "); }
void complete(const JsonObject&, WriterInfo& writer) {
  // The extension becomes the end of a file's path.
  const bool plain = std::all_of(writer.extension.begin(), writer.extension.end(),
                                 [](unsigned char c) { return std::isalnum(c) || c == '.' || c == '_' || c == '-'; });
  if (!plain || (!writer.extension.empty() && writer.extension[0] != '.'))
    damaged("'" + writer.extension + "' is not an extension of files");
}

template <class T>
T read_from(const json& j);

/// Reads one field. An option's default is left to complete(), because its type is another field.
template <class M>
void read_field(const JsonObject& fields, const char* key, M& value) {
  if constexpr (std::is_same_v<M, bool>) {
    value = fields.boolean(key);
  } else if constexpr (std::is_enum_v<M>) {
    value = M(one_of(ValueNames<M>::kNames, fields.text(key), ValueNames<M>::kWhat));
  } else if constexpr (std::is_integral_v<M>) {
    constexpr std::int64_t kMost = std::is_same_v<M, int> ? std::numeric_limits<int>::max() : kMostBytes_of_value;
    value = M(fields.integer(key, 0, kMost));
  } else if constexpr (std::is_same_v<M, double>) {
    value = fields.number(key);
  } else if constexpr (std::is_same_v<M, std::optional<double>>) {
    if (fields.has(key)) value = fields.number(key);
  } else if constexpr (std::is_same_v<M, std::string>) {
    value = fields.text(key);
  } else if constexpr (std::is_same_v<M, std::vector<std::string>>) {
    value = fields.texts(key);
  } else if constexpr (HasNamedFields<M>) {
    value = read_from<M>(fields.at(key));
  } else if constexpr (!std::is_same_v<M, OptionValue>) {
    for (const json& item : fields.list(key)) value.push_back(read_from<typename M::value_type>(item));
  }
}

template <class T>
T read_from(const json& j) {
  T value{};
  std::size_t count = 0;
  const char* what = visit_fields(value, [&](const char* key, const auto& member) {
    constexpr bool kMayBeAbsent = std::is_same_v<std::remove_cvref_t<decltype(member)>, std::optional<double>>;
    count += !kMayBeAbsent || j.contains(key);
  });
  const JsonObject fields(j, what, count);
  visit_fields(value, [&](const char* key, auto& member) { read_field(fields, key, member); });
  complete(fields, value);
  return value;
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

/// The first difference between two documents. `path` names the place.
std::string difference(const json& described, const json& registered, const std::string& path) {
  if (described == registered) return "";
  const bool lists = described.is_array() && registered.is_array() && described.size() == registered.size();
  for (std::size_t i = 0; lists && i < described.size(); ++i) {
    const bool named = described[i].is_object() && described[i].contains("name");
    const std::string name = named ? described[i]["name"].get<std::string>() : formatted("{}", i + 1);
    if (std::string found = difference(described[i], registered[i], path + "/" + name); !found.empty()) return found;
  }
  if (described.is_object() && registered.is_object())
    for (const json* side : {&described, &registered})
      for (const auto& [key, value] : side->items()) {
        const json before = described.value(key, json()), now = registered.value(key, json());
        if (std::string found = difference(before, now, path + "/" + key); !found.empty()) return found;
      }
  const auto shown = [](const json& j) -> std::string {
    if (j.is_array()) return formatted("{} of them", j.size());
    return j.is_null() ? "none" : j.is_object() ? "it" : j.dump();
  };
  return path.substr(1) + ": the library has " + shown(registered) + ", its description has " + shown(described);
}

/// The kinds, nodes and writers by their names. `order` receives the names.
json by_name(const LibraryInfo& info, std::vector<std::string>& order) {
  const json whole = library_json(info);
  json named;
  for (const char* list : {"kinds", "nodes", "writers"}) {
    named[list] = json::object();
    for (const json& one : whole.at(list)) {
      order.push_back(one.contains("name") ? one["name"] : one["type"]["id"]);
      named[list][order.back()] = one;
    }
  }
  return named;
}

}  // namespace

json json_of(const NodeInfo& node) { return document_of(node); }

json library_json(const LibraryInfo& info) {
  json j = {{"marrow_manifest", kManifestVersion}, {"library", info.digest.hex()}, {"refused", info.refused}};
  j["linked"] = json::array();
  for (const LinkedLibrary& library : info.linked)
    j["linked"].push_back({{"path", json_of_bytes(library.path)}, {"size", library.size}});
  j["kinds"] = document_of(info.kinds);
  j["nodes"] = document_of(info.nodes);
  j["writers"] = document_of(info.writers);
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
  const JsonObject fields(j, "it", 7);
  LibraryInfo info;
  const std::optional<Digest> digest = digest_of_hex(fields.text("library"));
  if (!digest) damaged("the library's digest is not 32 hexadecimal digits");
  info.digest = *digest;
  info.refused = fields.text("refused");
  if (fields.list("linked").size() > kMostLinked)
    damaged(formatted("it names more than {} linked libraries", kMostLinked));
  for (const json& library : fields.list("linked")) info.linked.push_back(linked_from(library));
  std::set<std::string> kinds, names;
  for (const json& kind : fields.list("kinds")) {
    info.kinds.push_back(read_from<KindInfo>(kind));
    if (!kinds.insert(info.kinds.back().name).second) damaged("it has the kind '" + info.kinds.back().name + "' twice");
  }
  for (const json& node : fields.list("nodes")) {
    info.nodes.push_back(read_from<NodeInfo>(node));
    if (!names.insert(info.nodes.back().name).second) damaged("it has the node '" + info.nodes.back().name + "' twice");
  }
  for (const json& writer : fields.list("writers")) info.writers.push_back(read_from<WriterInfo>(writer));
  if (!info.refused.empty() && !(info.kinds.empty() && info.nodes.empty() && info.writers.empty()))
    damaged("it has nodes of a library that it refuses");
  return info;
}

LibraryInfo info_of_nodes(const json& nodes) {
  json j = library_json({});
  j["nodes"] = nodes;
  return library_from_json(j);
}

std::string difference(const LibraryInfo& described, const LibraryInfo& registered) {
  std::vector<std::string> names_described, names_registered;
  const json before = by_name(described, names_described), now = by_name(registered, names_registered);
  const std::string found = difference(before, now, "");
  return found.empty() && names_described != names_registered
             ? "its description has another order or number of kinds, nodes and writers"
             : found;
}

}  // namespace marrow
