// SPDX-License-Identifier: Apache-2.0
#include "workbench/opened_folder.hpp"

#include <algorithm>
#include <chrono>
#include <ctime>
#include <fstream>
#include <iterator>
#include <mutex>
#include <regex>
#include <set>
#include <vector>

#include "marrow/base/hash.hpp"
#include "marrow/base/plain_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/base/text_file.hpp"
#include "marrow/toolbox/files/atomic_write.hpp"

namespace fs = std::filesystem;

namespace marrow::workbench {
namespace {

using nlohmann::json;

constexpr int kDeepest = 4;
constexpr int kMostEntries = 20'000;

bool is_hidden(const fs::path& path) { return path.filename().string().starts_with("."); }

/// "marrow" or "experiment" if the file says that it is a pipeline or an experiment; otherwise empty.
std::string format_of(const fs::path& file) {
  static const std::regex kFormat("(?:^|\\n)(marrow|experiment): *1");
  std::error_code error;
  if (fs::file_size(file, error) > 200'000 || error) return "";
  try {
    std::smatch format;
    const std::string text = plain_text(read_text_file(file, kMostSourceBytes));
    return std::regex_search(text, format, kFormat) ? format[1].str() : "";
  } catch (const std::exception&) {
    return "";  // it is listed as a file only
  }
}

constexpr const char* kFolder = ".marrow/drafts";
constexpr std::chrono::hours kFresh{1}, kUnused{24};

/// The texts that may name working files: all drafts with all their steps. Cases have copies of their own.
std::string texts_of_drafts(const fs::path& drafts) {
  std::string texts;
  for (const fs::directory_entry& entry : fs::directory_iterator(drafts))
    if (entry.path().extension() == ".jsonl") texts += read_text_file(entry.path(), entry.file_size());
  return texts;
}

}  // namespace

OpenedFolder::OpenedFolder(const fs::path& folder) {
  std::error_code error;
  folder_ = fs::canonical(folder, error);
  if (error || !fs::is_directory(folder_))
    throw Error(printable(folder.string()) + ": this is no folder; give one that exists");
  fs::directory_iterator(folder_, error);
  if (error) throw Error(printable(folder.string()) + ": this folder cannot be read: " + error.message());
}

fs::path OpenedFolder::inside(const std::string& relative) const {
  const auto refuse = [&] {
    return Error(in_quotes(printable(relative)) + " leads out of the folder that is open, " +
                 printable(folder_.string()));
  };
  if (relative.find('\0') != std::string::npos || fs::path(relative).is_absolute()) throw refuse();
  std::error_code error;
  const fs::path place = fs::weakly_canonical(folder_ / relative, error);
  if (error) throw Error(in_quotes(printable(relative)) + ": " + error.message());
  const auto [end, other] = std::mismatch(folder_.begin(), folder_.end(), place.begin(), place.end());
  if (end != folder_.end()) throw refuse();
  return place.has_filename() ? place : place.parent_path();
}

std::string OpenedFolder::relative(const fs::path& path) const {
  const std::string text = path.lexically_relative(folder_).generic_string();
  return text == "." ? "" : text;
}

json OpenedFolder::listing(const std::string& relative) const {
  const fs::path place = inside(relative);
  std::error_code error;
  fs::directory_iterator entries(place, error);
  if (error) throw Error(in_quotes(printable(relative)) + " cannot be listed: " + error.message());
  std::vector<std::string> folders;
  std::vector<std::pair<std::string, std::uintmax_t>> files;
  for (const fs::directory_entry& entry : entries) {
    if (is_hidden(entry.path())) continue;
    const std::string name = entry.path().filename().string();
    if (entry.is_directory(error))
      folders.push_back(name);
    else if (entry.is_regular_file(error))
      files.emplace_back(name, entry.file_size(error));
  }
  std::sort(folders.begin(), folders.end());
  std::sort(files.begin(), files.end());
  json listed = json::array();
  for (const auto& [name, bytes] : files) listed.push_back({{"name", name}, {"bytes", bytes}});
  return {{"path", this->relative(place)}, {"folders", folders}, {"files", listed}};
}

json OpenedFolder::contents() const {
  std::map<std::string, std::set<std::string>> found{
      {"cases", {}}, {"pipelines", {}}, {"experiments", {}}, {"runs", {}}, {"comparisons", {}}};
  int count = 0;
  std::error_code error;
  fs::recursive_directory_iterator entry(folder_, fs::directory_options::skip_permission_denied, error), end;
  for (; !error && entry != end && count < kMostEntries; entry.increment(error), ++count) {
    const fs::path& path = entry->path();
    const std::string name = path.filename().string();
    const fs::path folder = path.parent_path();
    if (entry->is_directory(error)) {
      if (is_hidden(path) || entry.depth() >= kDeepest) entry.disable_recursion_pending();
    } else if (name == "case.yaml") {
      found["cases"].insert(relative(folder));
    } else if (name == "run.json") {
      found["runs"].insert(relative(folder));
    } else if (name == "comparison.json") {
      found["comparisons"].insert(relative(folder));
    } else if (path.extension() == ".yaml" && !is_hidden(path)) {
      const std::string format = format_of(path);
      if (format == "marrow") found["pipelines"].insert(relative(path));
      if (format == "experiment") found["experiments"].insert(relative(path));
    }
  }
  // The resolved pipeline in a run's folder, and the runs of a comparison, belong to them.
  const auto belongs = [&](const std::string& path, const char* to) {
    return std::any_of(found[to].begin(), found[to].end(),
                       [&](const std::string& one) { return path.starts_with(one.empty() ? one : one + "/"); });
  };
  std::erase_if(found["runs"], [&](const std::string& path) { return belongs(path, "comparisons"); });
  for (const char* what : {"pipelines", "experiments", "cases"})
    std::erase_if(found[what],
                  [&](const std::string& path) { return belongs(path, "runs") || belongs(path, "comparisons"); });
  json contents = found;
  contents["is_cut"] = count >= kMostEntries;
  return contents;
}

std::string time_of_file(const std::filesystem::path& file) {
  std::error_code error;
  const auto written = std::filesystem::last_write_time(file, error);
  if (error) return "";
  const auto clock = std::chrono::file_clock::to_sys(written);
  const std::time_t seconds =
      std::chrono::system_clock::to_time_t(std::chrono::time_point_cast<std::chrono::system_clock::duration>(clock));
  std::tm utc{};
  gmtime_r(&seconds, &utc);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc);
  return text;
}

fs::path working_file(const OpenedFolder& folder, const std::string& name, const std::string& ending,
                      const std::string& text) {
  const fs::path drafts = folder.inside(kFolder);
  fs::create_directories(drafts);
  const fs::path file = drafts / (name + "-" + hash_of_bytes(text.data(), text.size()).hex() + ending);
  // Its time says when it was last in use. The time changes at most once an hour, because a run that is reading the
  // file would mistake a change for new content.
  static std::mutex one_at_a_time;
  const std::lock_guard lock(one_at_a_time);
  std::error_code error;
  const auto now = fs::file_time_type::clock::now(), before = fs::last_write_time(file, error);
  if (error)
    files::write_text(file, text);
  else if (now - before > kFresh)
    fs::last_write_time(file, now, error);
  return file;
}

void remove_unused_working_files(const OpenedFolder& folder) {
  static const std::regex kName("[a-z]+-[0-9a-f]{32}\\.(yaml|ply|png)");
  try {
    const fs::path drafts = folder.inside(kFolder);
    if (!fs::is_directory(drafts)) return;
    std::vector<fs::path> old;
    for (const fs::directory_entry& entry : fs::directory_iterator(drafts))
      if (entry.is_regular_file() && !entry.is_symlink() && std::regex_match(entry.path().filename().string(), kName) &&
          fs::file_time_type::clock::now() - entry.last_write_time() > kUnused)
        old.push_back(entry.path());
    if (old.empty()) return;
    const std::string texts = texts_of_drafts(drafts);
    std::error_code error;
    for (const fs::path& file : old)
      if (texts.find(file.filename().string()) == std::string::npos) fs::remove(file, error);
  } catch (const std::exception&) {
    // they stay; the next start tries again
  }
}

}  // namespace marrow::workbench
