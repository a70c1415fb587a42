// SPDX-License-Identifier: Apache-2.0
// 3D Slicer's lists of fiducials (comments with the version, the coordinate system and the columns, then a line a
// point) and its markups (JSON with the lists of points under "markups", each with its coordinate system).
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>

#include "markups.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/names.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/toolbox/files/header_lines.hpp"
#include "marrow/toolbox/files/yaml_text.hpp"

namespace marrow::exchange {
namespace {

constexpr std::uint64_t kMostMarkupsBytes = 64u << 20;
/// No coordinate of a patient is larger. A larger one is damaged, or in another unit.
constexpr double kLargestCoordinate_mm = 1e6;

/// The place in LPS of a point whose file gives it in LPS or RAS.
Eigen::Vector3d in_lps(const Eigen::Vector3d& at_mm, bool is_ras) {
  return is_ras ? Eigen::Vector3d(-at_mm.x(), -at_mm.y(), at_mm.z()) : at_mm;
}

const char* const kColumns = "id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID";

struct Line {
  const std::filesystem::path& path;
  std::size_t number = 0;
  [[noreturn]] void refuse(const std::string& what) const {
    throw Error(formatted("{}:{}: {}", path.string(), number, what));
  }
};

/// The first 40 bytes, for a message.
std::string quoted_beginning(const std::string& text) { return "'" + printable(text.substr(0, 40)) + "'"; }

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
    line.refuse("expected a coordinate in mm of at most 1 km, got " + quoted_beginning(text));
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
        line.refuse("expected a version 4 or 5 of 3D Slicer's file, got " + quoted_beginning(*version));
      has_version = true;
    } else if (const auto value = said(text, "CoordinateSystem")) {
      const std::string system = value->substr(0, value->find(','));  // tables fill lines up with commas
      if (system != "LPS" && system != "RAS" && system != "0" && system != "1")
        line.refuse("expected the coordinate system LPS or RAS (also 1 or 0), got " + quoted_beginning(*value));
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

using nlohmann::json;

/// Where in the file we are, for messages: the file and the keys that lead there.
struct Place {
  std::string file, key;
  Place at(const std::string& name) const { return {file, key.empty() ? name : key + "." + name}; }
  Place at(std::size_t index) const { return {file, formatted("{}[{}]", key, index)}; }
  [[noreturn]] void refuse(const std::string& what) const { throw Error(file + ": " + key + ": " + what); }
};

std::string shown(const json& value) {
  const std::string text = value.dump(-1, ' ', true, json::error_handler_t::replace);
  return "'" + printable(text.substr(0, 40)) + "'";
}

json parsed(const std::string& text, const std::string& file) {
  try {
    return json::parse(text);
  } catch (const json::parse_error& error) {
    const std::size_t end = std::min(error.byte, text.size());
    const auto line = 1 + std::count(text.begin(), text.begin() + std::ptrdiff_t(end), '\n');
    throw Error(formatted(
        "{}:{}: is no JSON from here on; it is cut off or damaged: save the markups again in 3D Slicer", file, line));
  } catch (const json::out_of_range&) {
    throw Error(file + ": holds a number too large to be one; it is damaged: save the markups again in 3D Slicer");
  }
}

/// The text under a key, or `missing` if there is no such key.
std::string text_or(const json& object, const std::string& key, const std::string& missing, const Place& place) {
  const auto found = object.find(key);
  if (found == object.end()) return missing;
  if (!found->is_string()) place.at(key).refuse("expected a text, got " + shown(*found));
  return found->get<std::string>();
}

const json& list_at(const json& object, const std::string& key, const Place& place, const std::string& advice) {
  const auto found = object.find(key);
  if (found == object.end()) place.at(key).refuse("is missing; " + advice);
  if (!found->is_array()) place.at(key).refuse("expected a list, got " + shown(*found));
  return *found;
}

Eigen::Vector3d position_of(const json& point, const Place& place) {
  const json& numbers = list_at(point, "position", place, "each control point needs its three coordinates");
  const Place at = place.at("position");
  if (numbers.size() != 3) at.refuse(formatted("expected 3 coordinates, got {}", numbers.size()));
  Eigen::Vector3d position;
  for (std::size_t i = 0; i < 3; ++i) {
    if (!numbers[i].is_number()) at.at(i).refuse("expected a number, got " + shown(numbers[i]));
    position[Eigen::Index(i)] = numbers[i].get<double>();
    if (!(std::abs(position[Eigen::Index(i)]) <= kLargestCoordinate_mm))
      at.at(i).refuse("expected a coordinate in mm of at most 1 km, got " + shown(numbers[i]));
  }
  return position;
}

void read_list(const json& list, const Place& place, std::vector<MarkedPoint>& points) {
  if (!list.is_object()) place.refuse("expected an object, got " + shown(list));
  const std::string system = text_or(list, "coordinateSystem", "LPS", place);
  if (system != "LPS" && system != "RAS")
    place.at("coordinateSystem").refuse("expected LPS or RAS, got '" + printable(system.substr(0, 40)) + "'");
  const auto unit = list.find("coordinateUnits");
  if (unit != list.end() && *unit != "mm")
    place.at("coordinateUnits").refuse("expected mm, got " + shown(*unit) + "; save the points in mm");
  const json& found = list_at(list, "controlPoints", place, "the list has no points; is it another kind of markup?");
  for (std::size_t i = 0; i < found.size(); ++i) {
    const Place at = place.at("controlPoints").at(i);
    if (!found[i].is_object()) at.refuse("expected an object, got " + shown(found[i]));
    if (text_or(found[i], "positionStatus", "defined", at) != "defined") continue;
    points.push_back({text_or(found[i], "label", "", at), in_lps(position_of(found[i], at), system == "RAS")});
  }
}

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

std::vector<MarkedPoint> read_markups_json(const std::filesystem::path& path) {
  const Place file{path.string(), ""};
  const json root = parsed(files::read_text(path, kMostMarkupsBytes), file.file);
  if (!root.is_object()) throw Error(file.file + ": expected 3D Slicer's markups, got " + shown(root));
  const std::string schema = text_or(root, "@schema", "markups-schema-v1.", file);
  if (schema.find("markups-schema-v1.") == std::string::npos)
    file.at("@schema").refuse("expected a version 1 of 3D Slicer's markups, got '" + printable(schema.substr(0, 100)) +
                              "'");
  const json& lists = list_at(root, "markups", file, "expected 3D Slicer's markups, saved as .mrk.json");
  std::vector<MarkedPoint> points;
  for (std::size_t i = 0; i < lists.size(); ++i) read_list(lists[i], file.at("markups").at(i), points);
  if (points.empty()) file.at("markups").refuse("there is no point in it; place the points in 3D Slicer, and save");
  return points;
}

/// "distal" of "distal-1", "distal_1" and "distal 1".
std::string without_number(const std::string& label) {
  const std::size_t last = label.find_last_not_of("0123456789");
  if (last == std::string::npos || last + 1 == label.size()) return label;
  const bool is_number = last > 0 && (label[last] == '-' || label[last] == '_' || label[last] == ' ');
  return is_number ? label.substr(0, last) : label;
}

[[noreturn]] void refuse(const std::filesystem::path& path, std::size_t index, const std::string& what) {
  throw Error(formatted("{}: point {}: {}", path.string(), index + 1, what));
}

void check_label(const std::filesystem::path& path, std::size_t index, const std::string& name,
                 const std::string& advice) {
  if (name.empty()) refuse(path, index, "it has no label; " + advice);
  if (const std::string fault = fault_of_item_name(name); !fault.empty())
    refuse(path, index, "its label " + in_quotes(printable(name)) + " " + fault + "; " + advice);
}

MarkedPoint finite(const std::string& label, const Eigen::Vector3d& at_mm) {
  if (!at_mm.allFinite())
    throw Error("point " + in_quotes(printable(label)) + " has a coordinate that is not a finite number");
  return {label, at_mm};
}

}  // namespace

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

std::string markups_json(const std::vector<MarkedPoint>& points) {
  using nlohmann::ordered_json;
  ordered_json list = {{"type", "Fiducial"},
                       {"coordinateSystem", "LPS"},
                       {"coordinateUnits", "mm"},
                       {"controlPoints", ordered_json::array()}};
  for (const MarkedPoint& point : points)
    list["controlPoints"].push_back({{"id", formatted("{}", list["controlPoints"].size() + 1)},
                                     {"label", point.label},
                                     {"position", {point.at_mm.x(), point.at_mm.y(), point.at_mm.z()}},
                                     {"positionStatus", "defined"}});
  const ordered_json root = {
      {"@schema",
       "https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/Markups/Resources/Schema/"
       "markups-schema-v1.0.3.json#"},
      {"markups", {list}}};
  return root.dump(2, ' ', false, ordered_json::error_handler_t::replace) + "\n";
}

Landmarks read_marked_landmarks(const std::filesystem::path& path) {
  Landmarks landmarks;
  for (const MarkedPoint& point : read_markups(path)) {
    const std::size_t index = landmarks.points.size();
    check_label(path, index, point.label, "give each point its landmark's name in 3D Slicer");
    const auto other = std::find_if(landmarks.points.begin(), landmarks.points.end(),
                                    [&](const auto& known) { return known.name == point.label; });
    if (other != landmarks.points.end())
      refuse(path, index,
             formatted("its label '{}' is that of point {}; give each its own", printable(point.label),
                       other - landmarks.points.begin() + 1));
    landmarks.points.push_back({point.label, point.at_mm});
  }
  return landmarks;
}

List<Seeds> read_marked_seeds(const std::filesystem::path& path, const std::string& fragment) {
  std::vector<Seeds> fragments;
  std::size_t index = 0;
  for (const MarkedPoint& point : read_markups(path)) {
    const std::string name = fragment.empty() ? without_number(point.label) : fragment;
    check_label(path, index++, name, "give it its fragment's name in 3D Slicer, or give fragment");
    auto found = std::find_if(fragments.begin(), fragments.end(), [&](const Seeds& s) { return s.fragment == name; });
    if (found == fragments.end()) found = fragments.insert(fragments.end(), Seeds{name, {}});
    found->points_mm.push_back(point.at_mm);
  }
  List<Seeds> seeds;
  for (Seeds& one : fragments) {
    const std::string name = one.fragment;
    seeds.add(name, std::move(one));
  }
  return seeds;
}

std::vector<MarkedPoint> marked_points(const Landmarks& landmarks) {
  std::vector<MarkedPoint> points;
  for (const Landmarks::Point& point : landmarks.points) points.push_back(finite(point.name, point.model_mm));
  return points;
}

std::vector<MarkedPoint> marked_points(const Seeds& seeds) {
  std::vector<MarkedPoint> points;
  for (const Eigen::Vector3d& point : seeds.points_mm)
    points.push_back(finite(formatted("{}-{}", seeds.fragment, points.size() + 1), point));
  return points;
}

}  // namespace marrow::exchange
