// SPDX-License-Identifier: Apache-2.0
#include "workbench/drafts.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <yaml-cpp/yaml.h>
#include <cerrno>
#include <cstdint>
#include <cstring>

#include "marrow/base/json_text.hpp"
#include "marrow/base/plain_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/base/text_file.hpp"
#include "workbench/case_files.hpp"
#include "workbench/server.hpp"

namespace fs = std::filesystem;

namespace marrow::workbench {
namespace {

using nlohmann::json;

/// The name of a draft's file for the path of a case: "cases/7" is "cases%2F7.jsonl".
std::string file_name(const std::string& case_path) {
  std::string name;
  for (const char c : case_path) name += c == '/' ? "%2F" : c == '%' ? "%25" : std::string(1, c);
  return (name.empty() ? "%" : name) + ".jsonl";
}

/// The path of the case whose draft has this file's name; the opposite of file_name().
std::string case_path_of(std::string name) {
  name.resize(name.size() - std::string(".jsonl").size());
  if (name == "%") return "";
  std::string path;
  for (std::size_t i = 0; i < name.size(); ++i) {
    const bool is_code = name[i] == '%' && i + 2 < name.size();
    path += !is_code ? name[i] : name.compare(i, 3, "%2F") == 0 ? '/' : '%';
    if (is_code) i += 2;
  }
  return path;
}

/// Appends a line and waits until it is on the disk. If a crash left `half_bytes` of a line at the end, they go first.
/// On any failure, restores the file and throws Error.
void append_line(const fs::path& file, std::uintmax_t half_bytes, const std::string& line) {
  fs::create_directories(file.parent_path());
  const Descriptor descriptor(open(file.c_str(), O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0644));
  if (!descriptor.is_open()) throw Error("the draft cannot be kept: " + std::string(std::strerror(errno)));
  const off_t before = lseek(descriptor, 0, SEEK_END) - off_t(half_bytes);
  const bool is_good =
      (half_bytes == 0 || ftruncate(descriptor, before) == 0) && write_all(descriptor, line) && fsync(descriptor) == 0;
  const std::string why = std::strerror(errno);
  if (!is_good && ftruncate(descriptor, before) != 0) {
    // whoever reads the draft skips the half line
  }
  if (!is_good) throw Error("the change is not kept in the draft: " + why + "; make room and try again");
}

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

void Drafts::apply(Draft& draft, const json& line) {
  if (line.contains("document")) {
    if (draft.saved > int(draft.at)) draft.saved = -1;  // undo and redo no longer lead to what was saved
    draft.steps.resize(draft.steps.empty() ? 0 : draft.at + 1);
    draft.steps.push_back({line.value("what", ""), line["document"]});
    draft.at = draft.steps.size() - 1;
  } else if (line.contains("undo") && draft.at > 0) {
    --draft.at;
  } else if (line.contains("redo") && draft.at + 1 < draft.steps.size()) {
    ++draft.at;
  } else if (line.contains("saved")) {
    draft.saved = int(draft.at);
  }
  ++draft.revision;
}

void Drafts::append(Draft& draft, const json& line) {
  std::string lines = json_text(line) + "\n";
  if (draft.whole_bytes == 0)  // the history includes the beginning
    lines = json_text({{"what", draft.steps[0].what}, {"document", draft.steps[0].document}}) + "\n" + lines;
  append_line(draft.file, draft.bytes - draft.whole_bytes, lines);
  draft.bytes = draft.whole_bytes += lines.size();
  apply(draft, line);
}

Drafts::Draft Drafts::read(const fs::path& file) {
  Draft draft;
  draft.file = file;
  if (!fs::exists(file)) return draft;
  const std::string text = read_text_file(file, kMostRecordBytes);
  draft.bytes = text.size();
  int number = 0;
  for (std::size_t begin = 0, end; (end = text.find('\n', begin)) != std::string::npos; begin = end + 1) {
    const std::string place =
        formatted("the draft .marrow/drafts/{}:{}", printable(file.filename().string()), ++number);
    const json line = parse_json(text.substr(begin, end - begin), place);
    if (!line.is_object() || (draft.steps.empty() && !line.contains("document")) ||
        !line.value("document", json::object()).is_object())
      throw Error(place + ": this is no change of a case; mend the file, or throw the draft away on the first page");
    apply(draft, line);
    draft.whole_bytes = end + 1;
  }
  const std::string rest = text.substr(draft.whole_bytes);
  if (draft.steps.empty() && !rest.empty() && rest[0] != '{')
    throw Error("the draft .marrow/drafts/" + printable(file.filename().string()) +
                " holds no changes of a case; throw it away on the first page");
  return draft;
}

Drafts::Draft& Drafts::find(const std::string& case_path) {
  folder_.inside(case_path);  // refuses a path that leads elsewhere
  const fs::path path = folder_.inside(".marrow/drafts") / file_name(case_path);
  std::error_code error;
  const std::uintmax_t size = fs::file_size(path, error), bytes = error ? 0 : size;
  const auto known = drafts_.find(case_path);
  if (known != drafts_.end() && known->second.bytes == bytes) return known->second;
  Draft draft = read(path);
  if (draft.steps.empty()) {
    draft.steps.push_back({"the beginning", document_of_case(folder_, case_path)});
    draft.saved = fs::exists(folder_.inside(case_path) / "case.yaml") ? 0 : -1;
  }
  return drafts_[case_path] = std::move(draft);
}

Drafts::Draft& Drafts::find(const std::string& case_path, int revision) {
  Draft& draft = find(case_path);
  if (draft.revision != revision)
    throw Conflict("this case was changed in another tab; the page now shows what is newest");
  return draft;
}

json Drafts::shown(const std::string& case_path, const Draft& draft) const {
  const bool can_redo = draft.at + 1 < draft.steps.size();
  return {{"case", case_path},
          {"revision", draft.revision},
          {"document", draft.steps[draft.at].document},
          {"undo", draft.at > 0 ? json(draft.steps[draft.at].what) : json()},
          {"redo", can_redo ? json(draft.steps[draft.at + 1].what) : json()},
          {"is_saved", draft.saved == int(draft.at)}};
}

json Drafts::open(const std::string& case_path) {
  const std::lock_guard lock(mutex_);
  return shown(case_path, find(case_path));
}

json Drafts::unsaved() {
  const std::lock_guard lock(mutex_);
  json all = json::array();
  std::error_code error;
  for (fs::directory_iterator entry(folder_.inside(".marrow/drafts"), error), end; !error && entry != end;
       entry.increment(error)) {
    const fs::path& file = entry->path();
    if (file.extension() != ".jsonl") continue;
    json row = {{"case", case_path_of(file.filename().string())}, {"changed", time_of_file(file)}};
    try {
      const Draft& draft = find(row["case"].get<std::string>());
      const bool is_case = fs::exists(folder_.inside(row["case"].get<std::string>()) / "case.yaml");
      if (draft.saved == int(draft.at) || (is_case && draft.at == 0)) continue;
      row["changes"] = draft.at;
    } catch (const std::exception& fault) {
      row["fault"] = printable_lines(fault.what());
    }
    all.push_back(std::move(row));
  }
  std::sort(all.begin(), all.end(), [](const json& a, const json& b) { return a["changed"] > b["changed"]; });
  return all;
}

void Drafts::throw_away(const std::string& case_path) {
  const std::lock_guard lock(mutex_);
  folder_.inside(case_path);
  std::error_code error;
  if (!fs::remove(folder_.inside(".marrow/drafts") / file_name(case_path), error))
    throw Error(error ? "the draft cannot be removed: " + error.message() : "there is no draft of this case");
  drafts_.erase(case_path);
}

json Drafts::change(const std::string& case_path, int revision, const std::string& what, json document) {
  const std::lock_guard lock(mutex_);
  if (!document.is_object()) throw Error("the changed case is no object");
  Draft& draft = find(case_path, revision);
  append(draft, {{"what", what}, {"document", std::move(document)}});
  return shown(case_path, draft);
}

json Drafts::step(const std::string& case_path, int revision, bool is_redo) {
  const std::lock_guard lock(mutex_);
  Draft& draft = find(case_path, revision);
  const bool can_step = is_redo ? draft.at + 1 < draft.steps.size() : draft.at > 0;
  if (can_step) append(draft, {{is_redo ? "redo" : "undo", true}});
  return shown(case_path, draft);
}

json Drafts::mark_saved(const std::string& case_path, int revision) {
  const std::lock_guard lock(mutex_);
  Draft& draft = find(case_path, revision);
  append(draft, {{"saved", true}});
  return shown(case_path, draft);
}

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
