// SPDX-License-Identifier: Apache-2.0
// Names that become names of files: an accepted name stays in its folder, and different names give different files.
#include "marrow/base/file_names.hpp"

#include <algorithm>
#include <set>

#include "target.hpp"

namespace {

using namespace marrow;

/// Fails unless a text is the name of one file in a folder.
void expect_inside(const std::string& name, const std::string& from) {
  const bool has_control =
      std::any_of(name.begin(), name.end(), [](char c) { return std::uint8_t(c) < 0x20 || c == 0x7f; });
  const std::filesystem::path folder = "/folder", file = (folder / name).lexically_normal();
  if (name.empty() || name.size() > 255 || has_control || name.find_first_of("/\\") != std::string::npos ||
      name == "." || name == ".." || file.parent_path() != folder || file.filename() != name)
    fuzz::finding("'" + from + "' becomes the file name '" + name + "', which is none");
}

/// The text that a file name was made from, if the name was not shortened.
std::string decoded(const std::string& name) {
  if (name == "%") return "";
  std::string text;
  for (std::size_t i = 0; i < name.size(); ++i) {
    if (name[i] != '%')
      text += name[i];
    else
      text += char(std::stoi(name.substr(i + 1, 2), nullptr, 16)), i += 2;
  }
  return text;
}

void expect_own_file(const std::string& text) {
  const std::string name = file_name_of(text);
  expect_inside(name, text);
  const bool is_shortened = name.find('~') != std::string::npos;
  if (is_shortened ? text.size() * 3 <= 200 : decoded(name) != text)
    fuzz::finding("another name than '" + text + "' becomes '" + name + "' too");
  if (fault_of_name(text).empty()) expect_inside(text, text);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::vector<std::string> names{""};
  for (const char byte : std::string_view(reinterpret_cast<const char*>(data), size)) {
    if (byte == '\n' && names.size() < 64)
      names.emplace_back();
    else
      names.back() += byte;
  }
  fuzz::expect_value_or_error([&] {
    std::set<std::string> texts(names.begin(), names.end()), files;
    for (const std::string& text : texts) {
      expect_own_file(text);
      files.insert(file_name_of(text));
    }
    if (files.size() != texts.size()) fuzz::finding("two names become one file");
    const std::vector<std::string> distinct = distinct_names(names);
    if (distinct.size() != names.size() ||
        std::set<std::string>(distinct.begin(), distinct.end()).size() != names.size())
      fuzz::finding("names that were made distinct are not");
  });
  return 0;
}
