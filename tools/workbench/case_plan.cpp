// SPDX-License-Identifier: Apache-2.0
// Which files a case's folder will hold, and under which names.
#include <algorithm>
#include <cctype>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "workbench/case_text.hpp"
#include "workbench/files_of_case.hpp"

namespace fs = std::filesystem;

namespace marrow::workbench {
namespace {

using nlohmann::json;

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
