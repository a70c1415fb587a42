// SPDX-License-Identifier: Apache-2.0
// Writes implants, to be read by read.implant, and plans for a drill.
#include "marrow/toolbox/geometry/implant.hpp"
#include <Eigen/Geometry>
#include <bit>
#include <cmath>
#include <cstring>
#include <marrow/plugin.hpp>
#include "marrow/toolbox/files/yaml_text.hpp"
#include "marrow/write/json_out.hpp"

namespace {

namespace fs = std::filesystem;
using marrow::geometry::Implant, marrow::geometry::LockingPlan;
using YAML::BeginMap, YAML::EndMap, YAML::Key, YAML::Value;

static_assert(std::endian::native == std::endian::little, "the numbers of an STL file are little-endian");

/// Binary STL: a header of 80 bytes, the number of triangles, then for each its normal, its corners and two bytes.
std::string stl(const marrow::Mesh& mesh) {
  std::string bytes = "marrow, mm, frame implant";
  bytes.resize(80, ' ');
  const auto append = [&](const auto& value) { bytes.append(reinterpret_cast<const char*>(&value), sizeof value); };
  append(std::uint32_t(mesh.triangles.size()));
  const auto append_vector = [&](const Eigen::Vector3d& vector) {
    for (const double value : vector) append(float(value));
  };
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3d &a = mesh.vertices_mm[t[0]], &b = mesh.vertices_mm[t[1]], &c = mesh.vertices_mm[t[2]];
    append_vector((b - a).cross(c - a).normalized());
    for (const Eigen::Vector3d* corner : {&a, &b, &c}) append_vector(*corner);
    append(std::uint16_t(0));
  }
  return bytes;
}

void implant(const Implant& implant, const std::string& path) {
  marrow::geometry::check_implant(implant, path);
  marrow::files::write_atomically(path, [&](const fs::path& folder) {
    fs::create_directory(folder);
    marrow::files::write_plainly(folder / "surface.stl", {stl(implant.surface)});
    YAML::Emitter out;
    out << BeginMap << Key << "marrow-implant" << Value << 1 << Key << "holes" << Value << BeginMap;
    for (const marrow::geometry::Hole& hole : implant.holes) {
      out << Key << YAML::DoubleQuoted << hole.name << Value << BeginMap << Key << "centre_mm" << Value;
      marrow::files::put_vector(out, hole.centre_mm);
      out << Key << "axis" << Value;
      marrow::files::put_vector(out, hole.axis);
      out << Key << "diameter_mm" << Value << marrow::files::number(hole.diameter_mm) << EndMap;
    }
    out << EndMap << EndMap;
    marrow::files::write_plainly(folder / "holes.yaml", {marrow::files::text_of(out)});
  });
}

nlohmann::ordered_json numbers(const Eigen::Vector3d& vector) { return {vector.x(), vector.y(), vector.z()}; }

/// A number that is not known is null.
nlohmann::ordered_json known(double value) {
  return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json();
}

void plan(const LockingPlan& plan, const std::string& path) {
  nlohmann::ordered_json json = {
      {"frame", "world"},
      {"c_arm",
       {{"isocentre_mm", numbers(plan.isocentre_mm)}, {"source_to_isocentre_mm", plan.source_to_isocentre_mm}}},
      {"drills", nlohmann::ordered_json::array()}};
  for (const LockingPlan::Drill& drill : plan.drills)
    json["drills"].push_back({{"hole", drill.hole},
                              {"centre_mm", numbers(drill.centre_mm)},
                              {"direction", numbers(drill.direction)},
                              {"guide_mm", numbers(drill.guide_mm)},
                              {"diameter_mm", drill.diameter_mm},
                              {"predicted_deviation_deg", known(drill.deviation_deg)},
                              {"predicted_deviation_mm", known(drill.deviation_mm)},
                              {"alpha_deg", drill.alpha_deg},
                              {"beta_deg", drill.beta_deg},
                              {"doubts", drill.doubts}});
  marrow::write::write_json(path, json);
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.writer<Implant>("", implant, "folder with holes.yaml and surface.stl, to be read by read.implant");
  plugin.writer<LockingPlan>(".json", plan, "place, direction, deviations and C-arm angles for each hole");
}
