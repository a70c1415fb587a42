// SPDX-License-Identifier: Apache-2.0
#include "header_lines.hpp"

#include <algorithm>
#include <cmath>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/plain_text.hpp"

namespace marrow::files {
namespace {

constexpr std::size_t kLongestLine = 1 << 16, kLongestHeader = 1 << 18;

/// The path of a file below `folder`, as a header names it; on Windows some write it with backslashes. Empty if it may
/// lead out of the folder.
std::filesystem::path path_inside(const std::filesystem::path& folder, std::string name) {
  if (name.find('\0') != std::string::npos || name.starts_with('/')) return {};
  std::error_code failure;
  if (!std::filesystem::exists(std::filesystem::symlink_status(folder / name, failure)))
    std::replace(name.begin(), name.end(), '\\', '/');
  const std::filesystem::path path(name), short_path = path.lexically_normal();
  const bool is_inside = path.is_relative() && path.has_filename() && short_path != "." &&
                         std::find(path.begin(), path.end(), "..") == path.end();
  return is_inside ? short_path : std::filesystem::path();
}

}  // namespace

std::string trimmed(const std::string& text) {
  const std::size_t first = text.find_first_not_of(" \t\r"), last = text.find_last_not_of(" \t\r");
  return first == std::string::npos ? "" : text.substr(first, last + 1 - first);
}

std::string in_small_letters(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return char(std::tolower(c)); });
  return text;
}

std::string extension_of(const std::filesystem::path& path) { return in_small_letters(path.extension().string()); }

std::vector<std::string> words_of(const std::string& text) {
  std::vector<std::string> words;
  for (std::size_t at = 0; (at = text.find_first_not_of(" \t", at)) != std::string::npos;) {
    const std::size_t end = std::min(text.find_first_of(" \t", at), text.size());
    words.push_back(text.substr(at, end - at));
    at = end;
  }
  return words;
}

std::string shown(const std::string& text) {
  std::string printable = text.substr(0, 60);
  for (char& c : printable)
    if (c < ' ' || c > '~') c = '?';
  return printable;
}

std::optional<double> number_of(const std::string& text) {
  const auto value = parsed_number(text);
  return value && std::isfinite(*value) ? value : std::nullopt;
}

HeaderLines::HeaderLines(const InputFile& file) : file_(file) {
  text_ = file.text(0, std::size_t(std::min<std::uint64_t>(file.size(), kLongestHeader + kLongestLine)));
  is_utf16_ = begins_as_utf16(text_);
  if (is_utf16_) text_ = plain_text(std::move(text_));
  if (text_.starts_with("\xEF\xBB\xBF")) at_ = 3;
  const std::size_t end = text_.find_first_of("\r\n");
  if (end != std::string::npos && text_[end] == '\r' && text_.compare(end, 2, "\r\n") != 0) line_end_ = '\r';
}

std::optional<std::string> HeaderLines::next() {
  if (at_ >= text_.size()) return std::nullopt;
  const std::size_t end = std::min(text_.find(line_end_, at_), text_.size());
  if (end - at_ >= kLongestLine)
    throw Error(file_.path().string() +
                ": a line of its header is longer than 65536 bytes; it is damaged, or of another kind");
  std::string line = text_.substr(at_, end - at_);
  at_ = std::min(end + 1, text_.size());
  if (at_ > kLongestHeader)
    throw Error(file_.path().string() + ": its header is longer than 262144 bytes; it is damaged, or of another kind");
  if (!line.empty() && line.back() == '\r') line.pop_back();
  return line;
}

std::uint64_t HeaderLines::at() const { return is_utf16_ ? file_.size() : at_; }

void HeaderFields::add(std::string key, const std::string& value) {
  key = in_small_letters(trimmed(key));
  if (!values_.emplace(key, trimmed(value)).second)
    throw Error(path_.string() + ": its header gives '" + shown(key) +
                "' twice; it is damaged: copy or export it again");
}

std::string HeaderFields::text(const std::string& key) const {
  if (!has(key)) throw Error(path_.string() + ": its header has no '" + key + "'; it is cut off or damaged");
  return values_.at(key);
}

std::string HeaderFields::text_or(const std::string& key, const std::string& missing) const {
  return has(key) ? values_.at(key) : missing;
}

void HeaderFields::refuse(const std::string& key, const std::string& expected) const {
  throw Error(path_.string() + ": its header says '" + key + "' is '" + shown(text_or(key, "")) + "'; expected " +
              expected);
}

long long HeaderFields::whole_number_or(const std::string& key, long long missing) const {
  if (!has(key)) return missing;
  const std::string value = values_.at(key);
  long long number = 0;
  const auto [end, failure] = std::from_chars(value.data(), value.data() + value.size(), number);
  if (failure != std::errc() || end != value.data() + value.size()) refuse(key, "a whole number");
  return number;
}

std::vector<double> HeaderFields::numbers(const std::string& key, std::size_t count) const {
  std::vector<double> numbers;
  for (const std::string& word : words_of(text(key))) {
    const auto number = number_of(word);
    if (!number || numbers.size() == count) refuse(key, formatted("{} numbers", count));
    numbers.push_back(*number);
  }
  if (numbers.size() != count) refuse(key, formatted("{} numbers", count));
  return numbers;
}

bool HeaderFields::is_true_or(const std::string& key, bool missing) const {
  const std::string value = in_small_letters(text_or(key, missing ? "true" : "false"));
  if (value == "true" || value == "1" || value == "t" || value == "yes" || value == "y") return true;
  if (value == "false" || value == "0" || value == "f" || value == "no" || value == "n") return false;
  refuse(key, "True or False");
}

std::filesystem::path file_beside(const std::filesystem::path& header, const std::string& name, bool folder_is_named) {
  const bool is_list =
      in_small_letters(name.substr(0, 4)) == "list" && (name.size() == 4 || name[4] == ' ' || name[4] == '\t');
  if (is_list || name.find('%') != std::string::npos)
    throw Error(header.string() + ": names several files for its samples ('" + shown(name) +
                "'); expected one file that lies beside it: convert it to .mha or .nrrd");
  if (!folder_is_named)
    throw Error(header.string() + ": keeps its samples in another file, '" + shown(name) +
                "'; name the folder that holds both, or convert to .mha or .nrrd");
  const std::filesystem::path inside = path_inside(header.parent_path(), name);
  if (inside.empty())
    throw Error(header.string() + ": names '" + shown(name) +
                "' for its samples; expected one file that lies beside it, or in a folder beside it");
  std::filesystem::path data = header.parent_path();
  for (const std::filesystem::path& part : inside) check_stays_inside(header.parent_path(), data /= part);
  std::error_code failure;
  if (!std::filesystem::exists(std::filesystem::symlink_status(data, failure)))
    throw Error(header.string() + ": names '" + shown(name) + "' for its samples, which is not there");
  return data;
}

}  // namespace marrow::files
