// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/files/camera_file.hpp"

#include <Eigen/LU>
#include <charconv>
#include <cmath>
#include <sstream>

#include "marrow/base/number_text.hpp"
#include "marrow/base/plain_text.hpp"
#include "marrow/domain/decompositions.hpp"
#include "marrow/toolbox/files/input_file.hpp"
#include "marrow/toolbox/files/yaml_text.hpp"
#include "marrow/toolbox/files/yaml_values.hpp"

namespace marrow::files {
namespace {

/// Reads XMALab's text line by line.
class XmalabText {
 public:
  explicit XmalabText(const std::filesystem::path& path) : path_(path) {
    const InputFile file(path, true);
    if (file.size() > 65536)
      throw Error(path.string() +
                  ": expected a camera file: marrow's YAML (.yaml) or XMALab's text (image size, camera "
                  "matrix, rotation, translation)");
    stream_.str(plain_text(file.text(0, std::size_t(file.size()))));
  }

  /// Skips empty lines and expects a line with just this title.
  void title(const std::string& expected) {
    std::string line = next_line();
    while (line.empty() && stream_) line = next_line();
    if (line != expected) fail("expected '" + expected + "', got '" + line.substr(0, 40) + "'");
  }

  /// Expects that only empty lines are left, so that no further block is ignored silently.
  void end() {
    while (stream_)
      if (const std::string line = next_line(); !line.empty())
        fail("expected the end of the file after the translation, got '" + line.substr(0, 40) + "', which is not read" +
             (line.rfind("undistortion", 0) == 0 ? ": give images that are already undistorted, and take the block out"
                                                 : ""));
  }

  std::vector<double> numbers(std::size_t count) {
    const std::string line = next_line();
    std::vector<double> values;
    const char *at = line.data(), *end = line.data() + line.size();
    while (at != end) {
      while (at != end && (*at == ' ' || *at == ',' || *at == '\t')) ++at;
      if (at == end) break;
      double value = 0;
      const auto [stop, failure] = std::from_chars(at, end, value);
      if (failure != std::errc() || !std::isfinite(value)) break;
      values.push_back(value);
      at = stop;
    }
    if (values.size() != count || at != end)
      fail(formatted("expected {} numbers, got '{}'", count, line.substr(0, 60)));
    return values;
  }

  [[noreturn]] void fail(const std::string& text) const {
    throw Error(formatted("{}:{}: {}; an XMALab camera has the blocks image size, camera matrix, rotation, translation",
                          path_.string(), line_number_, text));
  }

 private:
  std::string next_line() {
    std::string line;
    std::getline(stream_, line);
    ++line_number_;
    while (!line.empty() && line.back() == ' ') line.pop_back();
    return line;
  }

  std::filesystem::path path_;
  std::istringstream stream_;
  int line_number_ = 0;
};

Eigen::Matrix3d read_matrix(XmalabText& text) {
  Eigen::Matrix3d matrix;
  for (int r = 0; r < 3; ++r) {
    const std::vector<double> row = text.numbers(3);
    matrix.row(r) = Eigen::RowVector3d(row[0], row[1], row[2]);
  }
  return matrix;
}

Camera read_xmalab(const std::filesystem::path& path) {
  XmalabText text(path);
  Camera camera;
  text.title("image size");
  const std::vector<double> size = text.numbers(2);  // width, height, as XMALab writes them
  if (size[0] < 1 || size[1] < 1 || size[0] > 65536 || size[1] > 65536) text.fail("the image size is out of range");
  camera.width_px = int(size[0]);
  camera.height_px = int(size[1]);
  text.title("camera matrix");
  camera.intrinsics = read_matrix(text);
  text.title("rotation");
  const Eigen::Matrix3d rotation = read_matrix(text);
  // The file has 12 digits only. The nearest exact rotation is taken.
  const Eigen::Matrix3d nearest = nearest_orthogonal(rotation);
  if ((nearest - rotation).cwiseAbs().maxCoeff() > 1e-4 || nearest.determinant() < 0)
    text.fail("the matrix under 'rotation' is not a rotation");
  camera.camera_from_world.rotation = nearest;
  text.title("translation");
  for (int i = 0; i < 3; ++i) camera.camera_from_world.translation_mm[i] = text.numbers(1)[0];
  text.end();
  check_camera(camera, path.string());
  return camera;
}

/// A number within limits, which the fault names.
std::optional<double> number_within(const YamlMap& map, const std::string& key, double least, double most,
                                    const std::string& named) {
  const auto value = map.number(key);
  if (!value || (*value >= least && *value <= most)) return value;
  map.fault(key, named + ": expected " + number(least) + " to " + number(most) + ", got " + number(*value));
  return std::nullopt;
}

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

void straighten(View& view, const CameraInFile& camera) {
  if (!camera.measured.is_none())
    distortion::straighten(view, camera.measured);
  else if (!camera.distortion.is_none())
    remove_distortion(view, camera.distortion);
}

cv::Mat1b straightened_mask(const cv::Mat1b& original, const CameraInFile& camera) {
  return camera.measured.is_none() ? marrow::straightened_mask(original, camera.camera.intrinsics, camera.distortion)
                                   : distortion::straightened_mask(original, camera.measured);
}

cv::Mat1b original_mask(const cv::Mat1b& straight, const CameraInFile& camera) {
  return camera.measured.is_none() ? marrow::original_mask(straight, camera.camera.intrinsics, camera.distortion)
                                   : distortion::original_mask(straight, camera.measured);
}

CameraInFile read_camera_file(const std::filesystem::path& path) {
  if (path.extension() != ".yaml" && path.extension() != ".yml") return {{read_xmalab(path), {}}, {}};
  YamlFile file(path);
  const auto camera = camera_from(file.root(), file);
  if (!file.root()["marrow-camera"]) file.fault(file.root().Mark(), "camera: key 'marrow-camera' is missing");
  file.finish();
  return *camera;
}

std::optional<StatedNumber> stated_number_within(const YamlMap& map, const std::string& key, double least,
                                                 double most) {
  if (!map.node(key).IsDefined() || !map.node(key).IsMap()) {
    const auto value = number_within(map, key, least, most, key);
    if (!value) return std::nullopt;
    return StatedNumber{*value, std::nullopt};
  }
  const YamlMap both(map.file(), map.node(key), key, {"value", "deviation"});
  const auto value = number_within(both, "value", least, most, key + ": value"),
             deviation = number_within(both, "deviation", 0, most, key + ": deviation");
  if (!value || !deviation) return std::nullopt;
  return StatedNumber{*value, *deviation};
}

geometry::CameraDeviations deviations_by_distances(const StatedNumber& source_to_detector_mm,
                                                   const StatedNumber& source_to_isocentre_mm,
                                                   const StatedNumber& pixel_mm) {
  geometry::CameraDeviations stated;
  if (source_to_detector_mm.deviation || pixel_mm.deviation)
    stated.focal_percent = 100 * std::hypot(source_to_detector_mm.deviation.value_or(0) / source_to_detector_mm.value,
                                            pixel_mm.deviation.value_or(0) / pixel_mm.value);
  stated.source_mm = source_to_isocentre_mm.deviation;
  return stated;
}

geometry::CameraDeviations with_deviations(const YamlMap& map, geometry::CameraDeviations known) {
  if (!map.has("deviations")) return known;
  const YamlMap stated(map.file(), map.node("deviations"), "deviations",
                       {"turn_deg", "shift_mm", "focal_percent", "centre_px", "source_mm"});
  const auto take = [&](const std::string& key, double most, std::optional<double>& deviation) {
    if (!stated.has(key)) return;
    if (deviation)
      return stated.fault(key, key + ": the deviations of the distances already give it; keep one of the two");
    deviation = number_within(stated, key, 0, most, key);
  };
  take("turn_deg", 45, known.turn_deg);
  take("shift_mm", 1000, known.shift_mm);
  take("focal_percent", 50, known.focal_percent);
  take("centre_px", 10000, known.centre_px);
  take("source_mm", 1000, known.source_mm);
  return known;
}

std::optional<ProjectionCamera> camera_of_projection(const Projection& pixel_from_world,
                                                     const Eigen::Vector2i& size_px) {
  const double scale = pixel_from_world.row(2).head<3>().norm();
  if (!pixel_from_world.allFinite() || !(scale > 1e-12)) return std::nullopt;
  const Projection p = pixel_from_world / scale;
  const Eigen::RowVector3d z = p.row(2).head<3>();
  // Decomposes P row by row: what the axes found so far leave of a row is along the next axis.
  const double v0 = p.row(1).head<3>().dot(z);
  const Eigen::RowVector3d y_scaled = p.row(1).head<3>() - v0 * z;
  const double f_v = y_scaled.norm();
  const Eigen::RowVector3d y = y_scaled / f_v, x = y.cross(z);
  const double u0 = p.row(0).head<3>().dot(z), skew = p.row(0).head<3>().dot(y), f_u = p.row(0).head<3>().dot(x);
  if (!(f_v > 1e-9) || !(std::abs(f_u) > 1e-9)) return std::nullopt;
  ProjectionCamera found;
  found.is_mirrored = f_u < 0;
  Camera& camera = found.camera;
  camera.width_px = size_px.x();
  camera.height_px = size_px.y();
  camera.intrinsics << f_u, skew, u0, 0, f_v, v0, 0, 0, 1;
  Eigen::Matrix3d axes;
  axes << x, y, z;
  camera.camera_from_world.rotation = nearest_orthogonal(axes);
  Eigen::Vector3d& t = camera.camera_from_world.translation_mm;
  t.z() = p(2, 3);
  t.y() = (p(1, 3) - v0 * t.z()) / f_v;
  t.x() = (p(0, 3) - u0 * t.z() - skew * t.y()) / f_u;
  return found;
}

Projection projection_of(const Detector& detector) {
  Eigen::Matrix3d axes;
  axes << detector.pixel_mm.x() * detector.columns, detector.pixel_mm.y() * detector.rows,
      detector.corner_mm - detector.source_mm;
  Projection p;
  p.leftCols<3>() = axes.inverse();
  p.col(3) = -p.leftCols<3>() * detector.source_mm;
  return p;
}

std::string likely_unit(double length_mm, double least_mm, double most_mm, double scale) {
  static constexpr struct {
    const char* name;
    double mm;
  } kUnits[] = {{"cm", 10}, {"m", 1000}, {"inches", 25.4}, {"micrometres", 0.001}};
  for (const auto& unit : kUnits)
    if (length_mm * unit.mm >= least_mm && length_mm * unit.mm <= most_mm)
      return formatted("; looks like {}: give scale: {:.6g}", unit.name, scale * unit.mm);
  return {};
}

std::string doubt_about_distance(const Camera& camera, double scale) {
  constexpr double kNearest_mm = 200, kFarthest_mm = 5000, kItself_mm = 1e-6;
  const double distance_mm = source_position_mm(camera).norm();
  if (distance_mm < kItself_mm || (distance_mm >= kNearest_mm && distance_mm <= kFarthest_mm)) return {};
  return formatted("the X-ray source is {:.4g} mm from the world's origin, where devices have 200 to 5000",
                   distance_mm) +
         likely_unit(distance_mm, kNearest_mm, kFarthest_mm, scale);
}

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
