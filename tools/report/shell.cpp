// SPDX-License-Identifier: Apache-2.0

#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "report/report.hpp"

namespace marrow::cli {
namespace {

/// $'...', which keeps any bytes in one line of characters that a terminal shows as they are.
std::string escaped_word(const std::string& text) {
  std::string word = "$'";
  for (const char c : text) {
    const bool is_plain = c >= ' ' && c <= '~' && c != '\'' && c != '\\' && c != '!';  // ! recalls commands in bash
    word += is_plain ? std::string(1, c) : formatted("\\{:03o}", static_cast<unsigned char>(c));
  }
  return word + "'";
}

}  // namespace

std::string shell_word(const std::string& text) {
  static const std::string kPlain = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_@%+:,./-";
  if (!text.empty() && text.find_first_not_of(kPlain) == std::string::npos) return text;
  return printable(text) == text ? script_word(text) : escaped_word(text);
}

std::string shell_path(const std::filesystem::path& path) {
  return shell_word(path.native().starts_with("-") ? "./" + path.string() : path.string());
}

std::string script_word(const std::string& text) {
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? "'\\''" : std::string(1, c);
  return quoted + "'";
}

}  // namespace marrow::cli
