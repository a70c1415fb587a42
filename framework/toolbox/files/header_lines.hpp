// SPDX-License-Identifier: Apache-2.0
#pragma once
// The text headers of MetaImage and NRRD, read strictly and once: what is checked is what is used.
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "marrow/toolbox/files/input_file.hpp"

namespace marrow::files {

/// The fields of a header by name, in small letters; a field that is given twice is refused.
class HeaderFields {
 public:
  explicit HeaderFields(std::filesystem::path path) : path_(std::move(path)) {}
  const std::filesystem::path& path() const { return path_; }

  void add(std::string key, const std::string& value);
  bool has(const std::string& key) const { return values_.count(key) > 0; }
  /// The value, or `missing` where the field is not there. Those without a default throw Error.
  std::string text(const std::string& key) const;
  std::string text_or(const std::string& key, const std::string& missing) const;
  long long whole_number_or(const std::string& key, long long missing) const;
  /// Exactly `count` finite numbers.
  std::vector<double> numbers(const std::string& key, std::size_t count) const;
  bool is_true_or(const std::string& key, bool missing) const;
  [[noreturn]] void refuse(const std::string& key, const std::string& expected) const;

 private:
  std::filesystem::path path_;
  std::map<std::string, std::string> values_;
};

/// The lines at the beginning of a file, one after the other. Throws Error where a line is longer than any header's, or
/// all are.
class HeaderLines {
 public:
  explicit HeaderLines(const InputFile& file) : file_(file) {}
  /// The next line without its end; none at the end of the file.
  std::optional<std::string> next();
  /// Where the next line begins.
  std::uint64_t at() const { return at_; }

 private:
  const InputFile& file_;
  std::string part_;
  std::uint64_t at_ = 0, part_begin_ = 0;
};

std::string trimmed(const std::string& text);
std::string in_small_letters(std::string text);
std::vector<std::string> words_of(const std::string& text);
/// The beginning of a text out of a file, for a message: what cannot be printed becomes '?'.
std::string shown(const std::string& text);
/// A number in full, finite; none where the text is none.
std::optional<double> number_of(const std::string& text);

/// The file beside a header that it names for its samples. Throws Error where the name is a list, a pattern or a path,
/// where the option names the header alone instead of the folder that holds both, or where it is a link out of the
/// folder.
std::filesystem::path file_beside(const std::filesystem::path& header, const std::string& name, bool folder_is_named);

}  // namespace marrow::files
