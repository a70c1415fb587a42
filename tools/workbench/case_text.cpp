// SPDX-License-Identifier: Apache-2.0
#include "workbench/case_files.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cctype>
#include <map>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/toolbox/files/yaml_text.hpp"

namespace fs = std::filesystem;

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

/// A word for a file's name: letters, digits, '-' and '_' of the name, or `otherwise`.
std::string plain(const std::string& name, const std::string& otherwise) {
  std::string word;
  for (const unsigned char c : name.substr(0, 60))
    if (std::isalnum(c) || c == '-' || c == '_') word += char(c);
  return word.empty() ? otherwise : word;
}

/// ".nii.gz" and ".seg.nrrd" count as one extension.
std::string extension_of(const fs::path& file) {
  const std::string last = file.extension().string(), before = file.stem().extension().string();
  return last == ".gz" || before == ".seg" ? before + last : last;
}

class Planner {
 public:
  Planner(const OpenedFolder& folder, const std::string& case_path)
      : folder_(folder), place_(folder.inside(case_path)) {}

  /// Replaces a path that is relative to the opened folder by one that is relative to the case's.
  void take(json& path, const std::string& what, const std::string& stem) {
    if (!path.is_string() || path.get<std::string>().empty()) return miss(what + " is missing");
    fs::path from;
    try {
      from = folder_.inside(path.get<std::string>());
    } catch (const Error& error) {
      return miss(what + ": " + error.what());
    }
    std::error_code error;
    if (!fs::exists(from, error))
      return miss(what + ": there is no " + in_quotes(printable(path.get<std::string>())) + " any more");
    const std::string inside = from.lexically_relative(place_).generic_string();
    if (inside != "." && !inside.starts_with("..") && !inside.empty()) {
      files_.push_back({from, inside, false});
      path = inside;
      return;
    }
    if (inside == ".") return miss(what + ": this is the case's own folder; put the slices into a folder of their own");
    path = add_new(from, stem);
  }

  void miss(const std::string& fault) { faults_ += (faults_.empty() ? "" : "\n") + fault; }

  PlannedCase finish(json document) {
    if (!faults_.empty()) throw Error(faults_);
    return {std::move(document), std::move(files_)};
  }

 private:
  std::string add_new(const fs::path& from, const std::string& stem) {
    std::error_code error;
    const std::string extension = fs::is_directory(from, error) ? "" : extension_of(from);
    for (int number = 1;; ++number) {
      const std::string name = stem + (number > 1 ? formatted("-{}", number) : "") + extension;
      const auto planned =
          std::find_if(files_.begin(), files_.end(), [&](const auto& file) { return file.name == name; });
      if (planned != files_.end()) {
        if (planned->from == from) return name;
        continue;
      }
      const bool is_there = fs::exists(fs::symlink_status(place_ / name, error));
      if (is_there && !is_same_content(from, place_ / name)) continue;
      files_.push_back({is_there ? place_ / name : from, name, !is_there});
      return name;
    }
  }

  const OpenedFolder& folder_;
  const fs::path place_;
  std::vector<PlannedCase::File> files_;
  std::string faults_;
};

void plan_views(Planner& planner, json& views) {
  if (!views.is_array() || views.empty()) planner.miss("there is no X-ray view; add at least one");
  int number = 0;
  for (json& view : views) {
    const json given = view.value("name", json());
    const std::string name = given.is_string() ? given.get<std::string>() : given.dump(),
                      what = "view " + in_quotes(printable(name));
    const std::string stem = plain(name, formatted("view-{}", ++number));
    planner.take(view["image"], what + ", its image", stem);
    if (view.contains("mask") && !view["mask"].is_null())
      planner.take(view["mask"], what + ", its mask", stem + ".mask");
    json& camera = view["camera"];
    if (camera.is_object() && camera.contains("file"))
      planner.take(camera["file"], what + ", its camera", stem + ".camera");
    else if (!camera.is_object())
      planner.miss(what + " has no camera");
  }
}

void plan_fragment(Planner& planner, const std::string& name, json& fragment, const json& labels) {
  const std::string what = "fragment " + in_quotes(printable(name));
  if (fragment.contains("surface"))
    planner.take(fragment["surface"]["file"], what + ", its surface", plain(name, "surface"));
  else if (fragment.contains("label") && !labels.is_string())
    planner.miss(what + " has a label, but there is no label map; choose one");
  else if (!fragment.contains("label") && fragment.value("seeds", json::array()).empty())
    planner.miss(what + " has no seed; click inside its bone, or give it a label or a surface");
}

/// Only a CT can be segmented from seeds.
bool needs_ct(const json& fragments) {
  return fragments.empty() || std::any_of(fragments.begin(), fragments.end(), [](const json& fragment) {
           return !fragment.contains("label") && !fragment.contains("surface");
         });
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

// Which files a case's folder will hold, and under which names.

PlannedCase plan_case(const OpenedFolder& folder, const std::string& case_path, json document) {
  Planner planner(folder, case_path);
  json &ct = document["ct"], &labels = document["labels"], &fragments = document["fragments"];
  if (ct.is_object())
    planner.take(ct["file"], "the CT", "ct");
  else if (needs_ct(fragments))
    planner.miss("the CT is missing; choose one");
  if (labels.is_string())
    planner.take(labels, "the label map", "labels");
  else
    document.erase("labels");
  plan_views(planner, document["views"]);
  if (!fragments.is_object() || fragments.empty())
    planner.miss("there is no fragment; add one, with its seeds, its label or its surface");
  for (auto& [name, fragment] : fragments.items())
    plan_fragment(planner, name, fragment, document.value("labels", json()));
  return planner.finish(std::move(document));
}

}  // namespace marrow::workbench
