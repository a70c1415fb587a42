// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/files/distortion_file.hpp"

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/toolbox/files/yaml_text.hpp"
#include "marrow/toolbox/files/yaml_values.hpp"

namespace marrow::files {
namespace {

constexpr std::size_t kMostCorners = 10000;
constexpr double kMostNodes = 1e6;

std::vector<Eigen::Vector2d> places_from(const YamlMap& map, const std::string& key, std::size_t count) {
  std::vector<Eigen::Vector2d> places;
  if (const auto rows = map.matrix(key, int(count), 2))
    for (int row = 0; row < rows->rows(); ++row) places.emplace_back((*rows)(row, 0), (*rows)(row, 1));
  return places;
}

void take_terms(const YamlMap& map, distortion::Distortion& d) {
  d.degree = map.integer("degree").value_or(0);
  if (d.degree < 0 || d.degree > 9)
    map.fault("degree", formatted("degree: expected 0 to 9, got {}", d.degree));
  else
    d.terms_px = places_from(map, "terms_px", distortion::terms_of(d.degree));
}

void take_lattice(const YamlMap& map, distortion::Distortion& d) {
  const YamlMap lattice(map.file(), map.node("lattice"), "lattice", {"step_px", "shifts_px"});
  d.step_px = lattice.number("step_px").value_or(0);
  if (!(d.step_px >= 1) || !(double(d.width_px) * d.height_px / (d.step_px * d.step_px) <= kMostNodes))
    return lattice.fault("step_px", formatted("step_px: {} is too small", d.step_px));
  d.lattice_px = places_from(lattice, "shifts_px", std::size_t(lattice_columns(d)) * std::size_t(lattice_rows(d)));
}

void take_area(const YamlMap& map, distortion::Distortion& d) {
  const auto area = map.required("area_px");
  if (!area) return;
  if (!area->IsSequence() || area->size() < 3 || area->size() > kMostCorners)
    return map.fault("area_px", "area_px: expected a list of at least 3 corners [u, v]");
  d.area_px = places_from(map, "area_px", area->size());
}

void put_places(YAML::Emitter& out, const char* key, const std::vector<Eigen::Vector2d>& places) {
  Eigen::MatrixXd rows(Eigen::Index(places.size()), 2);
  for (std::size_t i = 0; i < places.size(); ++i) rows.row(Eigen::Index(i)) = places[i].transpose();
  put_matrix(out << YAML::Key << key << YAML::Value, rows);
}

}  // namespace

std::optional<distortion::Distortion> distortion_from(const YAML::Node& node, YamlFile& file) {
  const YamlMap map(file, node, "distortion",
                    {"marrow-distortion", "width_px", "height_px", "degree", "terms_px", "lattice", "area_px",
                     "residual_px", "validated_px"});
  if (!map.valid()) return std::nullopt;
  if (map.has("marrow-distortion")) check_version(map, "marrow-distortion");
  distortion::Distortion d;
  const auto width = map.integer("width_px"), height = map.integer("height_px");
  if (!width || !height) return std::nullopt;
  d.width_px = *width;
  d.height_px = *height;
  if (d.width_px < 2 || d.height_px < 2 || d.width_px > 65536 || d.height_px > 65536) {
    map.fault("width_px", formatted("width_px, height_px: expected 2 to 65536, got {} and {}", *width, *height));
    return std::nullopt;
  }
  take_terms(map, d);
  if (map.has("lattice")) take_lattice(map, d);
  take_area(map, d);
  d.residual_px = map.number("residual_px").value_or(0);
  d.validated_px = map.number("validated_px").value_or(0);
  if (d.terms_px.empty() || d.area_px.empty()) return std::nullopt;  // said above
  try {
    check_distortion(d, "distortion");
  } catch (const Error& error) {
    file.fault(node.Mark(), error.what());
    return std::nullopt;
  }
  return d;
}

distortion::Distortion read_distortion_file(const std::filesystem::path& path) {
  YamlFile file(path);
  const auto distortion = distortion_from(file.root(), file);
  if (!file.root()["marrow-distortion"])
    file.fault(file.root().Mark(), "distortion: key 'marrow-distortion' is missing");
  file.finish();
  return *distortion;
}

std::string distortion_text(const distortion::Distortion& d) {
  using YAML::Key, YAML::Value;
  YAML::Emitter out;
  out << YAML::BeginMap << Key << "marrow-distortion" << Value << 1;
  out << Key << "width_px" << Value << d.width_px << Key << "height_px" << Value << d.height_px;
  out << Key << "degree" << Value << d.degree;
  out << YAML::Comment(
      "seen = ideal + terms of 1, x, y, x^2, x y, y^2, ...; x, y: pixels from the middle over half the "
      "longer side");
  put_places(out, "terms_px", d.terms_px);
  if (!d.lattice_px.empty()) {
    out << Key << "lattice" << Value << YAML::BeginMap << Key << "step_px" << Value << number(d.step_px);
    put_places(out, "shifts_px", d.lattice_px);
    out << YAML::EndMap;
  }
  put_places(out, "area_px", d.area_px);
  out << YAML::Comment("corners of the part of the straight image that was measured");
  out << Key << "residual_px" << Value << number(d.residual_px) << Key << "validated_px" << Value
      << number(d.validated_px) << YAML::EndMap;
  return text_of(out);
}

}  // namespace marrow::files
