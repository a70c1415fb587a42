// SPDX-License-Identifier: Apache-2.0
#pragma once
// Strict reading of the text headers of MetaImage and NRRD. A header is read only once, so the values that are used are
// those that were checked.
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "marrow/toolbox/files/input_file.hpp"

namespace marrow::files {

/// The fields of a header by name, in lower case. A field that is given twice is an Error.
class HeaderFields {
 public:
  explicit HeaderFields(std::filesystem::path path) : path_(std::move(path)) {}
  const std::filesystem::path& path() const { return path_; }

  void add(std::string key, const std::string& value);
  void replace(const std::string& key, const std::string& value) { values_[key] = value; }
  bool has(const std::string& key) const { return values_.count(key) > 0; }
  /// Getters return the value, or `missing` if there is no such field. Those without a default then throw Error.
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

/// The lines at the beginning of a file, one after the other. They end with \n, \r\n or \r, as the first one does, and
/// a byte order mark before them is passed over. A whole file of UTF-16 is converted. Throws Error if one line or all
/// lines together are longer than those of any real header.
class HeaderLines {
 public:
  explicit HeaderLines(const InputFile& file);
  /// The next line without its line end. std::nullopt at the end of the file.
  std::optional<std::string> next();
  /// Offset of the next line in the file. After a header in UTF-16, where no samples can follow, it is the file's end.
  std::uint64_t at() const;

 private:
  const InputFile& file_;
  std::string text_;  ///< the beginning of the file, or all of it
  std::size_t at_ = 0;
  bool is_utf16_ = false;
  char line_end_ = '\n';
};

std::string trimmed(const std::string& text);
std::string in_small_letters(std::string text);
/// The extension of a file's name in small letters, with its dot.
std::string extension_of(const std::filesystem::path& path);
std::vector<std::string> words_of(const std::string& text);
/// The beginning of a file's text, for a message. Characters that cannot be printed become '?'.
std::string shown(const std::string& text);
/// The whole text as a finite number. std::nullopt if it is none.
std::optional<double> number_of(const std::string& text);

/// The file with the samples that a header names; it lies in the header's folder or below it. Throws Error if the name
/// is a list, a pattern or a path that leaves the folder, if there is no such file, or if it or a folder on the way is
/// a link out of the folder. Also throws if the user named only the header and not the folder with both files
/// (`folder_is_named`): all files in the folder count, and no others.
std::filesystem::path file_beside(const std::filesystem::path& header, const std::string& name, bool folder_is_named);

}  // namespace marrow::files
