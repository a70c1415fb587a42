// SPDX-License-Identifier: Apache-2.0
#include "report/cell_material.hpp"

#include <set>

#include "marrow/base/error.hpp"
#include "marrow/base/hash.hpp"
#include "marrow/base/json_text.hpp"
#include "marrow/base/text_file.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;
using compare::CellIndex;
using nlohmann::json;

constexpr const char* kFolder = "report";

/// What is known of the cells of one case and start, and the pictures, meshes and scenes that they name.
struct CellsOfStart {
  std::size_t case_index = 0, start = 0;
  json cells = json::array();
  ReportMaterial material;
};

/// The bytes by which `data` grows if a place is added. Things that another place has added do not count.
std::size_t growth(const json& data, CellsOfStart& place) {
  std::size_t bytes = json_text(place.cells).size();
  for (const auto& [name, group] : place.material.groups())
    for (const auto& [id, thing] : group->items())
      if (!data.at(name).contains(id)) bytes += id.size() + 5 + json_text(thing).size();
  return bytes;
}

void enter(json& data, CellsOfStart place) {
  for (json& cell : place.cells) data["materials"].push_back(std::move(cell));
  for (const auto& [name, group] : place.material.groups()) data[name].update(*group);
}

std::vector<std::string> kinds_in(const json& cells) {
  std::vector<std::string> kinds;
  for (const char* kind : {"pictures", "scene", "convergence", "landscape"})
    if (std::any_of(cells.begin(), cells.end(),
                    [&](const json& cell) { return cell.contains(kind) && !cell[kind].empty(); }))
      kinds.push_back(kind);
  return kinds;
}

/// Writes a place as a file of `folder`, and returns how the page lists it.
json written_beside(CellsOfStart place, const fs::path& folder) {
  const std::vector<std::string> kinds = kinds_in(place.cells);
  json content = {{"materials", std::move(place.cells)}};
  for (const auto& [name, group] : place.material.groups()) content[name] = std::move(*group);
  const std::string text = json_text(content), name = hash_of(text).hex().substr(0, 16) + ".js";
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw Error("cannot make the folder " + folder.string() + ": " + error.message());
  write_text_file(folder / name, "Parts.take(\"" + name + "\",\n" + text + "\n);\n");
  return {{"case", place.case_index}, {"start", place.start}, {"file", name}, {"bytes", text.size()}, {"kinds", kinds}};
}

/// The next place among the shown cells from `at` on. Moves `at` behind it.
CellsOfStart next_place(const compare::CellRunner& runner, const std::vector<CellIndex>& shown, std::size_t& at) {
  CellsOfStart place{shown[at].case_index, shown[at].start, json::array(), {}};
  for (; at < shown.size() && shown[at].case_index == place.case_index && shown[at].start == place.start; ++at) {
    json cell = json::object();
    place.material.add_prepared(runner.pictures_of(shown[at]), cell);
    cell.update({{"variant", shown[at].variant}, {"case", place.case_index}, {"start", place.start}});
    place.cells.push_back(std::move(cell));
  }
  place.material.print_left_out();
  return place;
}

}  // namespace

void add_cell_materials(json& data, const compare::CellRunner& runner, const std::vector<CellIndex>& shown,
                        const fs::path& folder, std::size_t most_bytes) {
  data["materials"] = data["parts"] = json::array();
  for (const char* name : {"pictures", "geometries", "scenes"}) data[name] = json::object();
  std::size_t bytes = page_bytes(data);
  for (std::size_t at = 0; at < shown.size();) {
    CellsOfStart place = next_place(runner, shown, at);
    const std::size_t more = growth(data, place);
    if (bytes + more <= most_bytes) {
      bytes += more;
      enter(data, std::move(place));
    } else {
      data["parts"].push_back(written_beside(std::move(place), folder / kFolder));
      bytes += json_text(data["parts"].back()).size() + 1;
    }
  }
}

bool is_part_name(const std::string& name) {
  return name.size() == 19 && name.ends_with(".js") && name.find_first_not_of("0123456789abcdef") == 16;
}

void remove_other_parts(const json& data, const fs::path& folder) {
  std::set<std::string> listed;
  for (const json& part : data.at("parts")) listed.insert(part.at("file"));
  std::error_code error, ignored;
  std::vector<fs::path> others;
  for (fs::directory_iterator at(folder / kFolder, error), end; !error && at != end; at.increment(error))
    if (const std::string name = at->path().filename().string(); is_part_name(name) && !listed.contains(name))
      others.push_back(at->path());
  for (const fs::path& file : others) fs::remove(file, ignored);
  if (listed.empty()) fs::remove(folder / kFolder, ignored);  // fails if anything else is in it, which then stays
}

}  // namespace marrow::cli
