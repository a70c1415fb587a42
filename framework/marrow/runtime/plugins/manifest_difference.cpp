// SPDX-License-Identifier: Apache-2.0
// What a library registers, compared with its description.
#include "marrow/base/number_text.hpp"
#include "marrow/runtime/plugins/manifest.hpp"

namespace marrow {
namespace {

using nlohmann::json;

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

std::string difference(const LibraryInfo& described, const LibraryInfo& registered) {
  std::vector<std::string> names_described, names_registered;
  const json before = by_name(described, names_described), now = by_name(registered, names_registered);
  const std::string found = difference(before, now, "");
  return found.empty() && names_described != names_registered
             ? "its description has another order or number of kinds, nodes and writers"
             : found;
}

}  // namespace marrow
