// SPDX-License-Identifier: Apache-2.0
#include "workbench/case_text.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <map>

#include "marrow/base/error.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/toolbox/files/yaml_text.hpp"

namespace marrow::workbench {
namespace {

using nlohmann::json;

bool is_row(const json& list) {
  return std::none_of(list.begin(), list.end(), [](const json& item) { return item.is_structured(); });
}

/// Any value. Texts are quoted, so that YAML reads none as a number or a truth value. Lists of numbers are on one line.
void put(YAML::Emitter& out, const json& value) {
  if (value.is_array()) {
    if (is_row(value)) out << YAML::Flow;
    out << YAML::BeginSeq;
    for (const json& item : value) put(out, item);
    out << YAML::EndSeq;
  } else if (value.is_object()) {
    out << YAML::BeginMap;
    for (const auto& [name, item] : value.items()) put(out << YAML::Key << name << YAML::Value, item);
    out << YAML::EndMap;
  } else if (value.is_number()) {
    out << files::number(value.get<double>());
  } else if (value.is_boolean()) {
    out << (value.get<bool>() ? "true" : "false");
  } else {
    out << YAML::DoubleQuoted << (value.is_string() ? value.get<std::string>() : "");
  }
}

void put_name(YAML::Emitter& out, const std::string& name) {
  out << YAML::Key << YAML::DoubleQuoted << name << YAML::Value;
}

/// The keys of `from` that are named and not null, in this order.
void put_keys(YAML::Emitter& out, const json& from, std::initializer_list<const char*> keys) {
  for (const char* key : keys)
    if (from.contains(key) && !from[key].is_null()) put(out << YAML::Key << key << YAML::Value, from[key]);
}

void put_ct(YAML::Emitter& out, const json& ct) {
  out << YAML::Key << "ct" << YAML::Value;
  if (ct.size() == 1) return put(out, ct.at("file"));
  out << YAML::BeginMap;
  put_keys(out, ct, {"file", "voxel_size_mm", "flip", "value_offset_hu", "series_uid"});
  out << YAML::EndMap;
}

void put_volumes(YAML::Emitter& out, const json& document) {
  if (document.at("ct").is_object()) put_ct(out, document["ct"]);
  put_keys(out, document, {"labels"});
}

void put_view(YAML::Emitter& out, const json& view) {
  out << YAML::BeginMap;
  put_keys(out, view, {"name", "image"});
  if (view.contains("camera")) {
    const json& camera = view["camera"];
    put(out << YAML::Key << "camera" << YAML::Value,
        camera.is_object() && camera.size() == 1 && camera.contains("file") ? camera["file"] : camera);
  }
  put_keys(out, view, {"mask"});
  out << YAML::EndMap;
}

void put_fragment(YAML::Emitter& out, const json& fragment) {
  out << YAML::BeginMap;
  put_keys(out, fragment, {"seeds", "label"});
  if (fragment.contains("surface")) {
    const json& surface = fragment["surface"];
    put(out << YAML::Key << "surface" << YAML::Value, surface.size() == 1 ? surface.at("file") : surface);
  }
  put_keys(out, fragment, {"register"});
  for (const char* key : {"start", "truth"})
    if (fragment.contains(key) && fragment[key].is_array()) {
      out << YAML::Key << key << YAML::Value << YAML::BeginMap << YAML::Key << "target" << YAML::Value << "world"
          << YAML::Key << "source" << YAML::Value << "ct";
      put(out << YAML::Key << "matrix" << YAML::Value, fragment[key]);
      out << YAML::EndMap;
    }
  out << YAML::EndMap;
}

/// The only fragment that is registered; empty if there are several.
std::string only_fragment(const json& document) {
  std::string only;
  for (const auto& [name, fragment] : document.at("fragments").items()) {
    if (!fragment.value("register", true)) continue;
    if (!only.empty()) return "";
    only = name;
  }
  return only;
}

void put_landmarks(YAML::Emitter& out, const std::vector<json>& landmarks) {
  const auto name = [](const json& landmark) { return landmark.at("name").get<std::string>(); };
  out << YAML::BeginMap << YAML::Key << "points" << YAML::Value << YAML::BeginMap;
  std::map<std::string, std::vector<const json*>> by_view;
  bool is_tracked = false;
  for (const json& landmark : landmarks) {
    put_name(out, name(landmark));
    put(out, landmark.at("model_mm"));
    const json pixels = landmark.value("pixels", json::object());
    for (const auto& [view, pixel] : pixels.items())
      if (pixel.is_array()) by_view[view].push_back(&landmark);
    is_tracked = is_tracked || landmark.contains("tracked_mm");
  }
  out << YAML::EndMap;
  if (!by_view.empty()) {
    out << YAML::Key << "seen" << YAML::Value << YAML::BeginMap;
    for (const auto& [view, seen] : by_view) {
      put_name(out, view);
      out << YAML::BeginMap;
      for (const json* landmark : seen) {
        put_name(out, name(*landmark));
        put(out, (*landmark)["pixels"][view]);
      }
      out << YAML::EndMap;
    }
    out << YAML::EndMap;
  }
  if (is_tracked) {
    out << YAML::Key << "tracked" << YAML::Value << YAML::BeginMap;
    for (const json& landmark : landmarks)
      if (landmark.contains("tracked_mm")) {
        put_name(out, name(landmark));
        put(out, landmark["tracked_mm"]);
      }
    out << YAML::EndMap;
  }
  out << YAML::EndMap;
}

}  // namespace

std::string case_yaml(const PlannedCase& plan) {
  const json& document = plan.document;
  YAML::Emitter out;
  out.SetDoublePrecision(17);
  out << YAML::BeginMap << YAML::Key << "marrow-case" << YAML::Value << 1;
  put_volumes(out, document);
  out << YAML::Key << "views" << YAML::Value << YAML::BeginSeq;
  for (const json& view : document.at("views")) put_view(out, view);
  out << YAML::EndSeq << YAML::Key << "fragments" << YAML::Value << YAML::BeginMap;
  for (const auto& [name, fragment] : document.at("fragments").items()) {
    put_name(out, name);
    put_fragment(out, fragment);
  }
  out << YAML::EndMap << YAML::EndMap;
  return files::text_of(out);
}

std::string landmarks_yaml(const json& document) {
  std::map<std::string, std::vector<json>> by_fragment;
  for (const json& landmark : document.value("landmarks", json::array())) {
    if (!landmark.contains("model_mm") || !landmark["model_mm"].is_array())
      continue;  // it has no position in the CT yet
    const json given = landmark.value("fragment", json());
    const std::string fragment = given.is_string() ? given.get<std::string>() : only_fragment(document);
    if (fragment.empty())
      throw Error("landmark " + in_quotes(printable(landmark.value("name", ""))) +
                  ": several fragments are registered; choose the one that it belongs to");
    by_fragment[fragment].push_back(landmark);
  }
  if (by_fragment.empty()) return "";
  YAML::Emitter out;
  out << YAML::BeginMap << YAML::Key << "marrow-landmarks" << YAML::Value << 1 << YAML::Key << "fragments"
      << YAML::Value << YAML::BeginMap;
  for (const auto& [fragment, landmarks] : by_fragment) {
    put_name(out, fragment);
    put_landmarks(out, landmarks);
  }
  out << YAML::EndMap << YAML::EndMap;
  return files::text_of(out);
}

json landmarks_of_file(const std::filesystem::path& file) {
  const YAML::Node root = YAML::LoadFile(file.string());
  const auto numbers = [](const YAML::Node& list) {
    json row = json::array();
    for (const YAML::Node& item : list) row.push_back(item.as<double>());
    return row;
  };
  json landmarks = json::array();
  for (const auto& fragment : root["fragments"])
    for (const auto& point : fragment.second["points"]) {
      const std::string name = point.first.Scalar();
      json landmark{{"name", name}, {"fragment", fragment.first.Scalar()}, {"model_mm", numbers(point.second)}};
      if (const YAML::Node seen = fragment.second["seen"])
        for (const auto& view : seen)
          if (view.second[name]) landmark["pixels"][view.first.Scalar()] = numbers(view.second[name]);
      if (const YAML::Node tracked = fragment.second["tracked"]; tracked && tracked[name])
        landmark["tracked_mm"] = numbers(tracked[name]);
      landmarks.push_back(landmark);
    }
  return landmarks;
}

}  // namespace marrow::workbench
