// SPDX-License-Identifier: Apache-2.0
// 3D Slicer's markups: JSON with the lists of points under "markups", each with its coordinate system.
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "markups_file.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/toolbox/files/input_file.hpp"

namespace marrow::exchange {
namespace {

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

}  // namespace

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

}  // namespace marrow::exchange
