// SPDX-License-Identifier: Apache-2.0
#include "report/report.hpp"

namespace marrow::cli {

std::string shell_word(const std::string& text) {
  static const std::string kPlain = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_@%+:,./-";
  if (!text.empty() && text.find_first_not_of(kPlain) == std::string::npos) return text;
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? "'\\''" : std::string(1, c);
  return quoted + "'";
}

std::string shell_path(const std::filesystem::path& path) {
  return shell_word(path.native().starts_with("-") ? "./" + path.string() : path.string());
}

}  // namespace marrow::cli
