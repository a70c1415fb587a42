// SPDX-License-Identifier: Apache-2.0
#include "templates.hpp"

#include <algorithm>
#include <regex>

#include "marrow/base/error.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/base/text_file.hpp"
#include "marrow/toolbox/files/atomic_write.hpp"
#include "process.hpp"

namespace fs = std::filesystem;

namespace marrow::cli {

fs::path shared_files(const fs::path& below) {
  const fs::path folder = this_program().parent_path().parent_path() / "share/marrow" / below;
  if (!fs::exists(folder))
    throw Error(printable(folder.string()) + ": it is not there; install the package marrow-dev, or marrow as a whole");
  return folder;
}

std::string replaced(std::string text, const Replacements& replacements) {
  std::vector<std::pair<std::string, std::string>> longest_first(replacements.begin(), replacements.end());
  std::stable_sort(longest_first.begin(), longest_first.end(),
                   [](const auto& a, const auto& b) { return a.first.size() > b.first.size(); });
  for (const auto& [key, value] : longest_first)
    for (std::size_t at = text.find(key); at != std::string::npos; at = text.find(key, at + value.size()))
      text.replace(at, key.size(), value);
  return text;
}

Files filled_templates(const fs::path& folder, const Replacements& replacements) {
  Files files;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const fs::path name = entry.path().filename();
    files[name == "gitignore" ? fs::path(".gitignore") : name] =
        replaced(read_text_file(entry.path(), kMostSourceBytes), replacements);
  }
  return files;
}

void expect_free(const fs::path& place) {
  if (fs::exists(fs::symlink_status(place)))
    throw Error(printable(place.string()) +
                ": it exists already, and nothing was written; name another place with --out");
}

fs::path write_project(const fs::path& wanted, const std::string& otherwise, const Files& files) {
  const fs::path folder = wanted.empty() ? fs::path(otherwise) : wanted;
  expect_free(folder);
  files::write_atomically(fs::absolute(folder), [&](const fs::path& unfinished) {
    fs::create_directories(unfinished);
    for (const auto& [name, text] : files) {
      write_text_file(unfinished / name, text);
      fs::permissions(unfinished / name, fs::perms(name == "ci" ? 0755 : 0644));
    }
  });
  return folder;
}

std::string moved_text(const fs::path& from, const fs::path& folder) {
  const std::string text = read_text_file(from, kMostSourceBytes);
  const fs::path old_folder = fs::absolute(from).parent_path();
  static const std::regex kPath(R"([A-Za-z0-9_.\-]+(/[A-Za-z0-9_.\-]+)+|[A-Za-z0-9_\-]+\.yaml)");
  std::string result;
  auto end = text.cbegin();
  for (std::sregex_iterator match(text.begin(), text.end(), kPath), none; match != none; ++match) {
    result.append(end, text.cbegin() + match->position());
    const fs::path there = old_folder / match->str();
    result += fs::exists(there) ? fs::relative(there, folder).string() : match->str();
    end = text.cbegin() + match->position() + match->length();
  }
  return result.append(end, text.cend());
}

void expect_name(const std::string& name, const std::string& what) {
  static const std::regex kName("[a-z][a-z0-9_]*");
  if (name.size() > 60 || !std::regex_match(name, kName))
    throw Error(what + " '" + printable(name) +
                "': a name has small letters, digits and '_', begins with a letter, and is "
                "at most 60 characters long");
}

}  // namespace marrow::cli
