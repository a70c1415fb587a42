// SPDX-License-Identifier: Apache-2.0
#pragma once
// A locale with decimal commas, as a script sets it by locale.setlocale(locale.LC_NUMERIC, "de_DE.UTF-8").
#include <stdlib.h>

#include <clocale>
#include <cstdio>
#include <filesystem>
#include <string>

namespace marrow::test {

/// The process has such a locale while this exists, unless it cannot be made here.
class CommaLocale {
 public:
  CommaLocale() {
    std::string folder = (std::filesystem::temp_directory_path() / "marrow-locale-XXXXXX").string();
    if (!::mkdtemp(folder.data())) return;
    folder_ = folder;
    const std::string command =
        "localedef -i de_DE -f UTF-8 '" + (folder_ / "de_DE.UTF-8").string() + "' > /dev/null 2>&1";
    if (std::system(command.c_str()) != 0) return;
    ::setenv("LOCPATH", folder_.c_str(), 1);
    is_set_ = std::setlocale(LC_NUMERIC, "de_DE.UTF-8") != nullptr;
  }
  ~CommaLocale() {
    std::setlocale(LC_NUMERIC, "C");
    ::unsetenv("LOCPATH");
    std::error_code failure;
    if (!folder_.empty()) std::filesystem::remove_all(folder_, failure);
  }
  CommaLocale(const CommaLocale&) = delete;
  CommaLocale& operator=(const CommaLocale&) = delete;

  /// Whether printf writes 1,5 now.
  bool is_set() const {
    char text[8];
    return is_set_ && std::snprintf(text, sizeof text, "%.1f", 1.5) == 3 && text[1] == ',';
  }

 private:
  std::filesystem::path folder_;
  bool is_set_ = false;
};

}  // namespace marrow::test

#define MARROW_NEED_COMMA_LOCALE(variable)    \
  const ::marrow::test::CommaLocale variable; \
  if (!variable.is_set()) GTEST_SKIP() << "no locale with decimal commas can be made here (localedef, de_DE)"
