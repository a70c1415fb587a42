// SPDX-License-Identifier: Apache-2.0
// A case.yaml as the document of a draft.
#include <yaml-cpp/yaml.h>

#include <cstdint>

#include "marrow/base/error.hpp"
#include "marrow/base/plain_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/base/text_file.hpp"
#include "workbench/case_text.hpp"
#include "workbench/drafts.hpp"

namespace fs = std::filesystem;

namespace marrow::workbench {
namespace {

using nlohmann::json;

/// Numbers and truth values keep their type; everything else becomes a text.
json json_of_scalar(const YAML::Node& node) {
  if (node.Tag() == "!") return node.Scalar();  // a text in quotes
  bool truth = false;
  double number = 0;
  std::int64_t whole = 0;
  if (YAML::convert<std::int64_t>::decode(node, whole)) return whole;  // the width of an image must stay a whole number
  if (YAML::convert<double>::decode(node, number)) return number;
  if (YAML::convert<bool>::decode(node, truth)) return truth;
  return node.Scalar();
}

json json_of_yaml(const YAML::Node& node) {
  if (node.IsSequence()) {
    json list = json::array();
    for (const YAML::Node& item : node) list.push_back(json_of_yaml(item));
    return list;
  }
  if (node.IsMap()) {
    json map = json::object();
    for (const auto& entry : node) map[entry.first.Scalar()] = json_of_yaml(entry.second);
    return map;
  }
  return node.IsScalar() ? json_of_scalar(node) : json();
}

/// A placement as a 4 x 4 matrix.
json matrix_of(const json& placement) {
  if (placement.contains("matrix")) return placement["matrix"];
  json matrix = json::array();
  for (std::size_t i = 0; i < 3; ++i) {
    json row = placement.at("rotation").at(i);
    row.push_back(placement.at("translation_mm").at(i));
    matrix.push_back(row);
  }
  matrix.push_back({0, 0, 0, 1});
  return matrix;
}

/// Replaces the short forms of a case.yaml by those of a document.
void adapt(json& document) {
  if (json& ct = document["ct"]; ct.is_string()) ct = {{"file", ct}};
  for (json& view : document.at("views"))
    if (json& camera = view.at("camera"); camera.is_string()) camera = {{"file", camera}};
  for (auto& [name, fragment] : document.at("fragments").items()) {
    for (const char* key : {"start", "truth"})
      if (fragment.contains(key)) fragment[key] = matrix_of(fragment[key]);
    if (fragment.contains("surface") && fragment["surface"].is_string())
      fragment["surface"] = {{"file", fragment["surface"]}};
  }
  document.erase("marrow-case");
}

}  // namespace

void put_below(json& document, const std::string& case_path) {
  const auto move = [&](json& path) {
    if (!case_path.empty()) path = case_path + "/" + path.get<std::string>();
  };
  if (document.at("ct").is_object()) move(document["ct"].at("file"));
  if (document.contains("labels") && document["labels"].is_string()) move(document["labels"]);
  for (auto& [name, fragment] : document.at("fragments").items())
    if (fragment.contains("surface")) move(fragment["surface"].at("file"));
  for (json& view : document.at("views")) {
    move(view.at("image"));
    if (view.contains("mask") && !view["mask"].is_null()) move(view["mask"]);
    if (view.at("camera").contains("file")) move(view["camera"]["file"]);
  }
}

json document_of_case(const OpenedFolder& folder, const std::string& case_path) {
  const fs::path file = folder.inside(case_path) / "case.yaml";
  json document{{"ct", nullptr}, {"views", json::array()}, {"fragments", json::object()}};
  if (fs::exists(file)) {
    try {
      document = json_of_yaml(YAML::Load(plain_text(read_text_file(file, kMostSourceBytes))));
      adapt(document);
      put_below(document, case_path);
    } catch (const std::exception& error) {
      throw Error(printable(file.string()) + ": this case cannot be read here: " + printable(error.what()) +
                  "; 'marrow inspect' says what is wrong");
    }
  }
  document["landmarks"] = json::array();
  const fs::path landmarks = folder.inside(case_path) / "landmarks.yaml";
  if (!fs::exists(landmarks)) return document;
  try {
    document["landmarks"] = landmarks_of_file(landmarks);
  } catch (const std::exception& error) {
    throw Error(printable(landmarks.string()) + ": these landmarks cannot be read here: " + printable(error.what()));
  }
  return document;
}

}  // namespace marrow::workbench
