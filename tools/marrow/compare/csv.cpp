// SPDX-License-Identifier: Apache-2.0
#include "compare/csv.hpp"

#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"

namespace marrow::cli {

std::string csv_field(const std::string& raw) {
  std::string text;
  for (std::size_t begin = 0, end = 0; begin <= raw.size(); begin = end + 1) {
    end = std::min(raw.find('\n', begin), raw.size());
    text += (begin ? "\n" : "") + printable(raw.substr(begin, end - begin));
  }
  if (!text.empty() && std::string("=+-@\t\r\n").find(text[0]) != std::string::npos && !parsed_number(text))
    text = "'" + text;
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string quoted = "\"";
  for (char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + "\"";
}

std::string csv_number(const std::optional<double>& value) {
  if (!value) return "";
  return formatted("{:.9g}", *value);
}

std::vector<std::string> csv_cells(const std::string& line) {
  std::vector<std::string> cells(1);
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (c == '"' && quoted && i + 1 < line.size() && line[i + 1] == '"')
      cells.back() += line[i++];
    else if (c == '"')
      quoted = !quoted;
    else if (c == ',' && !quoted)
      cells.emplace_back();
    else if (c != '\r')
      cells.back() += c;
  }
  return cells;
}

}  // namespace marrow::cli
