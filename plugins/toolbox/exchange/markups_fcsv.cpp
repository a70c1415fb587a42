// SPDX-License-Identifier: Apache-2.0
// 3D Slicer's lists of fiducials: comments with the version, the coordinate system and the columns, then a line a
// point.
#include <algorithm>
#include <cmath>
#include <optional>
#include <sstream>

#include "markups_file.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/toolbox/files/header_lines.hpp"
#include "marrow/toolbox/files/yaml_text.hpp"

namespace marrow::exchange {
namespace {

const char* const kColumns = "id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID";

struct Line {
  const std::filesystem::path& path;
  std::size_t number = 0;
  [[noreturn]] void refuse(const std::string& what) const {
    throw Error(formatted("{}:{}: {}", path.string(), number, what));
  }
};

std::string in_quotes(const std::string& text) { return "'" + printable(text.substr(0, 40)) + "'"; }

/// The cells of a line. A cell with commas is in quotes, and a quote in it is doubled.
std::vector<std::string> cells_of(const std::string& text, const Line& line) {
  std::vector<std::string> cells{""};
  bool is_quoted = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '"' && is_quoted && i + 1 < text.size() && text[i + 1] == '"')
      cells.back() += text[i++];
    else if (text[i] == '"')
      is_quoted = !is_quoted;
    else if (text[i] == ',' && !is_quoted)
      cells.emplace_back();
    else
      cells.back() += text[i];
  }
  if (is_quoted) line.refuse("a quotation mark is not closed; the file is cut off or damaged");
  return cells;
}

/// What a comment "# key = value" says.
std::optional<std::string> said(const std::string& text, const std::string& key) {
  const std::size_t begin = text.find_first_not_of("# \t");
  if (begin == std::string::npos || text.compare(begin, key.size(), key) != 0) return std::nullopt;
  const std::size_t sign = text.find_first_not_of(" \t", begin + key.size());
  if (sign == std::string::npos || text[sign] != '=') return std::nullopt;
  const std::size_t value = text.find_first_not_of(" \t", sign + 1);
  return value == std::string::npos ? "" : text.substr(value);
}

std::optional<double> number_in(const std::string& cell) {
  return parsed_number(std::string_view(cell).substr(std::min(cell.find_first_not_of(' '), cell.size())));
}

double coordinate(const std::string& text, const Line& line) {
  const auto value = number_in(text);
  if (!value || !(std::abs(*value) <= kLargestCoordinate_mm))
    line.refuse("expected a coordinate in mm of at most 1 km, got " + in_quotes(text));
  return *value;
}

/// What the comments at the beginning say.
struct Header {
  bool has_version = false, has_axes = false, is_ras = false;
  std::size_t x = 1, label = 11, columns = 14;
  std::vector<std::size_t> of_flags{8, 9, 10};          ///< vis, sel and lock, which are 0 or 1
  std::vector<std::size_t> of_orientation{4, 5, 6, 7};  ///< ow, ox, oy, oz: an angle and an axis, or a quaternion

  void read(const std::string& text, const Line& line) {
    if (const auto version = said(text, "Markups fiducial file version")) {
      if (version->rfind("4.", 0) != 0 && version->rfind("5.", 0) != 0)
        line.refuse("expected a version 4 or 5 of 3D Slicer's file, got " + in_quotes(*version));
      has_version = true;
    } else if (const auto value = said(text, "CoordinateSystem")) {
      const std::string system = value->substr(0, value->find(','));  // tables fill lines up with commas
      if (system != "LPS" && system != "RAS" && system != "0" && system != "1")
        line.refuse("expected the coordinate system LPS or RAS (also 1 or 0), got " + in_quotes(*value));
      has_axes = true;
      is_ras = system == "RAS" || system == "0";
    } else if (const auto names = said(text, "columns")) {
      const std::vector<std::string> cells = cells_of(*names, line);
      const auto place_of = [&](const char* name) {
        const auto found = std::find(cells.begin(), cells.end(), name);
        if (found == cells.end()) line.refuse("there is no column '" + std::string(name) + "'; expected " + kColumns);
        return std::size_t(found - cells.begin());
      };
      x = place_of("x");
      if (place_of("y") != x + 1 || place_of("z") != x + 2)
        line.refuse("the columns x, y, z do not follow each other; expected " + std::string(kColumns));
      label = place_of("label");
      columns = cells.size();
      const auto places_of = [&](std::initializer_list<const char*> wanted) {
        std::vector<std::size_t> places;
        for (const char* name : wanted)
          if (const auto found = std::find(cells.begin(), cells.end(), name); found != cells.end())
            places.push_back(std::size_t(found - cells.begin()));
        return places;
      };
      of_flags = places_of({"vis", "sel", "lock"});
      of_orientation = places_of({"ow", "ox", "oy", "oz"});
    }
  }
};

/// 3D Slicer 5 ends a row with two cells more than it names columns, some versions after an empty one: whether the
/// point is placed (0 to 3, 2 if it is), and whether a program made it (0 or 1). Nothing if the row ends in another
/// way.
std::optional<double> status_of(const std::vector<std::string>& cells, const Header& header) {
  if (cells.size() < header.columns + 2) return std::nullopt;
  const auto is_empty = [](const std::string& cell) { return cell.find_first_not_of(' ') == std::string::npos; };
  if (!std::all_of(cells.begin() + std::ptrdiff_t(header.columns), cells.end() - 2, is_empty)) return std::nullopt;
  const auto status = number_in(cells[cells.size() - 2]), by_program = number_in(cells.back());
  const bool is_known = status && by_program && *status >= 0 && *status <= 3 && (*by_program == 0 || *by_program == 1);
  return is_known ? status : std::nullopt;
}

/// Whether cells other than coordinates and texts hold impossible values: a flag that is not 0 or 1, an axis that is
/// longer than 1, or an angle about no axis.
bool holds_impossible_values(const std::vector<std::string>& cells, const Header& header) {
  const auto number = [&](std::size_t place) { return place < cells.size() ? number_in(cells[place]) : std::nullopt; };
  for (const std::size_t flag : header.of_flags)
    if (const auto value = number(flag); value && *value != 0 && *value != 1) return true;
  if (header.of_orientation.size() != 4) return false;
  double longest = 0;
  for (std::size_t i = 1; i < 4; ++i)
    longest = std::max(longest, std::abs(number(header.of_orientation[i]).value_or(0)));
  return longest > 1 || (longest == 0 && std::abs(number(header.of_orientation[0]).value_or(0)) > 1);
}

/// Whether a number with a decimal comma may have become two cells, which moves the coordinates and the label to other
/// columns. A row may also lack cells at its end, or have an empty one there. Then the label shows that nothing has
/// moved.
bool may_be_shifted(const std::vector<std::string>& cells, const Header& header, bool has_status) {
  if (holds_impossible_values(cells, header)) return true;
  if (cells.size() == header.columns + (has_status ? 2 : 0)) return false;
  return (cells.size() > header.columns && !has_status) || number_in(cells[header.label]).has_value();
}

/// The point of a row; nothing if it is listed but not placed.
std::optional<MarkedPoint> point_of(const std::string& text, const Header& header, const Line& line) {
  const std::vector<std::string> cells = cells_of(text, line);
  if (const std::size_t least = std::max(header.label, header.x + 2) + 1; cells.size() < least)
    line.refuse(formatted("expected at least {} cells, got {}", least, cells.size()));
  const auto status = status_of(cells, header);
  if (may_be_shifted(cells, header, status.has_value()))
    line.refuse(
        (cells.size() == header.columns + (status ? 2 : 0)
             ? "the cells do not stand below their columns: those of the orientation or of vis, sel and lock "
               "hold other numbers"
             : formatted("expected {} cells, one for each of the columns, got {}", header.columns, cells.size())) +
        "; a number with a decimal comma makes two cells: write 12.5, not 12,5, and a text with commas in "
        "quotation marks");
  constexpr double kPlaced = 2;
  if (status && *status != kPlaced) return std::nullopt;
  Eigen::Vector3d at_mm;
  for (int i = 0; i < 3; ++i) at_mm[i] = coordinate(cells[header.x + std::size_t(i)], line);
  return MarkedPoint{cells[header.label], in_lps(at_mm, header.is_ras)};
}

/// In small or capital letters.
bool ends_with(const std::filesystem::path& path, std::string_view end) {
  const std::string name = files::in_small_letters(path.filename().string());
  return name.size() > end.size() && name.ends_with(end);
}

std::string quoted(const std::string& text) {
  std::string clean;
  for (const char c : text) {
    if (c == '"') clean += c;
    clean += c == '\n' || c == '\r' ? ' ' : c;
  }
  return clean.find_first_of(",\"") == std::string::npos ? clean : '"' + clean + '"';
}

}  // namespace

std::vector<MarkedPoint> read_markups_fcsv(const std::filesystem::path& path) {
  std::istringstream lines(files::read_text(path, kMostMarkupsBytes));
  Header header;
  std::vector<MarkedPoint> points;
  std::string text;
  for (Line line{path}; std::getline(lines, text);) {
    ++line.number;
    while (!text.empty() && text.back() == ' ') text.pop_back();
    if (text.empty()) continue;
    if (text[0] == '#') {
      header.read(text, line);
      continue;
    }
    if (!header.has_version) line.refuse("expected 3D Slicer's '# Markups fiducial file version = ' first");
    if (!header.has_axes)
      line.refuse("no line '# CoordinateSystem = ' came before; add it, with LPS or RAS after the sign");
    if (auto point = point_of(text, header, line)) points.push_back(std::move(*point));
  }
  if (points.empty()) throw Error(path.string() + ": there is no point in it; expected 3D Slicer's list of fiducials");
  return points;
}

std::string markups_fcsv(const std::vector<MarkedPoint>& points) {
  std::string text = "# Markups fiducial file version = 4.11\n# CoordinateSystem = LPS\n# columns = ";
  text += std::string(kColumns) + "\n";
  for (std::size_t i = 0; i < points.size(); ++i) {
    text += formatted("{}", i + 1);
    for (const double coordinate : points[i].at_mm) text += "," + files::number(coordinate);
    text += ",0,0,0,1,1,1,0," + quoted(points[i].label) + ",,\n";
  }
  return text;
}

bool is_markups_file(const std::filesystem::path& path) {
  return ends_with(path, ".mrk.json") || ends_with(path, ".fcsv");
}

std::vector<MarkedPoint> read_markups(const std::filesystem::path& path) {
  return ends_with(path, ".fcsv") ? read_markups_fcsv(path) : read_markups_json(path);
}

}  // namespace marrow::exchange
