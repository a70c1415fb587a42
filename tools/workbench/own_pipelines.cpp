// SPDX-License-Identifier: Apache-2.0
#include "workbench/own_pipelines.hpp"

#include <yaml-cpp/yaml.h>

#include <set>

#include "marrow/base/error.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/base/text_file.hpp"
#include "new/templates.hpp"

namespace fs = std::filesystem;

namespace marrow::workbench {
namespace {

using nlohmann::json;

/// The others hold parts of pipelines, experiments, and what the pages run themselves.
constexpr const char* kFamilies[] = {"bone",    "calibration", "femur", "guidance",
                                     "implant", "simulate",    "track", "wrist"};

/// {help, inputs} as the file itself says it; those of files that it extends are left out.
json described(const fs::path& file) {
  json shown = {{"help", ""}, {"inputs", json::array()}};
  try {
    const YAML::Node root = YAML::Load(read_text_file(file, kMostSourceBytes));
    if (root["help"].IsScalar()) shown["help"] = root["help"].Scalar();
    if (root["inputs"].IsMap())
      for (const auto& input : root["inputs"]) shown["inputs"].push_back(input.first.Scalar());
  } catch (const std::exception&) {  // it is offered without a description
  }
  return shown;
}

}  // namespace

json own_pipelines() {
  json all = json::array();
  for (const char* family : kFamilies) {
    std::set<fs::path> files;
    try {
      for (const fs::directory_entry& entry : fs::directory_iterator(cli::shared_files(fs::path("pipelines") / family)))
        if (entry.path().extension() == ".yaml") files.insert(entry.path());
    } catch (const std::exception&) {
      continue;
    }
    for (const fs::path& file : files) {
      all.push_back(described(file));
      all.back()["name"] = family + ("/" + file.stem().string());
    }
  }
  return all;
}

std::string copy_of_own_pipeline(const std::string& name, const OpenedFolder& folder) {
  for (const json& one : own_pipelines()) {
    if (one["name"] != name) continue;
    const fs::path from = cli::shared_files("pipelines/" + name + ".yaml");
    const fs::path target = folder.path() / from.filename();
    if (fs::symlink_status(target).type() != fs::file_type::not_found)
      throw Error(printable(from.filename().string()) + " exists in this folder already; open it, or rename it first");
    write_text_file(target, cli::moved_text(from, folder.path()));
    return folder.relative(target);
  }
  throw Error("marrow has no pipeline " + in_quotes(printable(name)) + " of its own");
}

}  // namespace marrow::workbench
