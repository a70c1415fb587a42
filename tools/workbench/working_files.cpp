// SPDX-License-Identifier: Apache-2.0
#include "workbench/working_files.hpp"

#include <chrono>
#include <fstream>
#include <iterator>
#include <mutex>
#include <regex>
#include <vector>

#include "marrow/base/error.hpp"
#include "marrow/base/hash.hpp"
#include "marrow/base/text_file.hpp"
#include "marrow/toolbox/files/atomic_write.hpp"

namespace fs = std::filesystem;

namespace marrow::workbench {
namespace {

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
