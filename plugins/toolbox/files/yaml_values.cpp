// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/files/yaml_values.hpp"

#include <Eigen/LU>
#include <cmath>

#include "marrow/base/number_text.hpp"
#include "marrow/toolbox/files/yaml_text.hpp"

namespace marrow::files {
namespace {

void check_frame(const YamlMap& map, const std::string& key, const std::string& expected) {
  const auto frame = map.text(key);
  if (frame && *frame != expected)
    map.fault(key,
              key + ": expected the frame '" + expected + "', got '" + *frame + "'; this file holds another transform");
}

std::optional<FragmentFrame> frame_from(const YAML::Node& node, YamlFile& file) {
  const YamlMap map(file, node, "fragment_frame", {"origin_mm", "axes", "anatomical"});
  const auto origin = map.vector3("origin_mm");
  const auto axes = map.matrix("axes", 3, 3);
  if (!origin || !axes) return std::nullopt;
  try {
    check_rigid({"ct", "fragment", *axes, *origin}, "fragment_frame: axes");
  } catch (const Error& error) {
    map.fault("axes", error.what());
    return std::nullopt;
  }
  return FragmentFrame{*origin, *axes, map.boolean_or("anatomical", true)};
}

constexpr double kSquare = 5e-4;  // directions of few digits are at right angles to this

/// A number within limits, which the fault names.
std::optional<double> number_within(const YamlMap& map, const std::string& key, double least, double most) {
  const auto value = map.number(key);
  if (!value || (*value >= least && *value <= most)) return value;
  map.fault(key, key + ": expected " + number(least) + " to " + number(most) + ", got " + number(*value));
  return std::nullopt;
}

/// The camera of an isocentric C-arm from its angles and distances. The isocentre is the origin of the world.
std::optional<Camera> camera_by_c_arm(const YAML::Node& node, int width_px, int height_px, YamlFile& file,
                                      geometry::CameraDeviations& deviations) {
  const YamlMap map(file, node, "c_arm",
                    {"alpha_deg", "beta_deg", "source_to_detector_mm", "source_to_isocentre_mm", "pixel_mm"});
  const auto alpha_deg = number_within(map, "alpha_deg", -90, 90), beta_deg = number_within(map, "beta_deg", -180, 180);
  const auto detector_mm = stated_number_within(map, "source_to_detector_mm", 1, 10000),
             isocentre_mm = stated_number_within(map, "source_to_isocentre_mm", 1, 10000),
             pixel_mm = stated_number_within(map, "pixel_mm", 0.001, 100);
  if (!alpha_deg || !beta_deg || !detector_mm || !isocentre_mm || !pixel_mm) return std::nullopt;
  if (isocentre_mm->value >= detector_mm->value) {
    map.fault("source_to_isocentre_mm",
              "source_to_isocentre_mm: the isocentre lies between source and detector; expected less than "
              "source_to_detector_mm");
    return std::nullopt;
  }
  deviations = deviations_by_distances(*detector_mm, *isocentre_mm, *pixel_mm);
  const CArm arm{width_px,           height_px,           Eigen::Vector2d::Constant(pixel_mm->value),
                 detector_mm->value, isocentre_mm->value, Eigen::Vector3d::Zero()};
  return carm_camera(arm, world_from_camera_rotation(radians(*alpha_deg), radians(*beta_deg)));
}

/// The camera from its matrices.
std::optional<Camera> camera_by_matrices(const YamlMap& map, int width_px, int height_px, YamlFile& file) {
  const auto intrinsics = map.matrix("intrinsics", 3, 3);
  const auto transform_node = map.required("camera_from_world");
  if (!transform_node) return std::nullopt;
  const YamlMap transform_map(file, *transform_node, "camera_from_world", transform_keys());
  const auto transform = transform_from(transform_map, Camera{}.camera_from_world);
  if (!intrinsics || !transform) return std::nullopt;
  return Camera{width_px, height_px, *intrinsics, *transform};
}

/// Whether the key `distortion` could be read.
bool take_measured(const YamlMap& map, CameraInFile& camera) {
  if (map.has("radial_distortion")) {
    map.fault("distortion", "distortion: 'radial_distortion' is given, too; keep one of the two");
    return false;
  }
  const auto measured = distortion_from(map.node("distortion"), map.file());
  if (!measured) return false;
  if (measured->width_px != camera.camera.width_px || measured->height_px != camera.camera.height_px) {
    map.fault("distortion",
              formatted("distortion: it is of images of {} x {} pixels, the camera of {} x {}", measured->width_px,
                        measured->height_px, camera.camera.width_px, camera.camera.height_px));
    return false;
  }
  camera.measured = *measured;
  return true;
}

/// The camera from a matrix of any scale and sign. Of the two signs, that one is taken with which the image is seen
/// from the source, as marrow takes images. For an image that is seen from the detector, the object then lies behind
/// the camera, which the nodes that use it say.
std::optional<Camera> camera_by_matrix(const YamlMap& map, int width_px, int height_px) {
  const auto matrix = map.matrix("projection_matrix", 3, 4);
  if (!matrix) return std::nullopt;
  const double sign = matrix->leftCols<3>().determinant() < 0 ? -1 : 1;
  const auto found = camera_of_projection(sign * *matrix, {width_px, height_px});
  if (found) return found->camera;
  map.fault("projection_matrix", "projection_matrix: does not project along rays from a source");
  return std::nullopt;
}

std::optional<Camera> camera_by_detector(const YamlMap& map, int width_px, int height_px) {
  const YamlMap keys(map.file(), map.node("detector"), "detector",
                     {"source_mm", "corner_mm", "centre_mm", "columns", "rows", "pixel_mm"});
  const auto detector = detector_from(keys, width_px, height_px);
  if (!detector) return std::nullopt;
  const auto found = camera_of_projection(projection_of(*detector), {width_px, height_px});
  if (found && !found->is_mirrored) return found->camera;
  map.fault("detector",
            "detector: the image is seen from the detector, and marrow takes images that are seen from the source: "
            "mirror it left to right, change the sign of 'columns', and give the corner that is the first then");
  return std::nullopt;
}

std::optional<Matrix6d> covariance_from(const YamlMap& map) {
  const auto covariance = map.matrix("covariance", 6, 6);
  if (!covariance) return std::nullopt;
  try {
    check_covariance(*covariance, "covariance");
  } catch (const Error& error) {
    map.fault("covariance", error.what());
    return std::nullopt;
  }
  return Matrix6d(*covariance);
}

/// Pairs of evaluations and the least cost after them.
std::vector<Pose::Progress> convergence_from(const YamlMap& map) {
  std::vector<Pose::Progress> convergence;
  const YAML::Node list = map.node("convergence");
  if (!list.IsSequence()) {
    map.fault("convergence", "convergence: expected a list, got " + yaml_described(list));
    return convergence;
  }
  for (const YAML::Node& item : list) {
    const bool is_pair = item.IsSequence() && item.size() == 2;
    const std::optional<std::int64_t> evaluations = is_pair ? yaml_integer(item[0]) : std::nullopt;
    const std::optional<double> cost = is_pair ? yaml_number(item[1]) : std::nullopt;
    if (evaluations && cost && std::abs(*evaluations) <= 1'000'000'000)
      convergence.push_back({int(*evaluations), *cost});
    else
      map.file().fault(item.Mark(),
                       map.what() + ": convergence: expected a pair [evaluations, cost], got " + yaml_described(item));
  }
  return convergence;
}

/// A number, or what number() writes for one that is not finite.
std::optional<double> any_number_from(const YamlMap& map, const std::string& key) {
  const YAML::Node node = map.node(key);
  const std::string text = node.IsDefined() && node.IsScalar() ? node.Scalar() : "";
  for (const double value : {std::nan(""), HUGE_VAL, -HUGE_VAL})
    if (text == number(value)) return value;
  return map.number(key);
}

std::vector<Metric> figures_from(const YamlMap& map) {
  std::vector<Metric> figures;
  const YAML::Node list = map.node("figures");
  if (!list.IsSequence()) {
    map.fault("figures", "figures: expected a list, got " + yaml_described(list));
    return figures;
  }
  for (const YAML::Node& item : list) {
    const YamlMap figure(map.file(), item, "a figure", {"name", "value", "unit"});
    const auto name = figure.text("name");
    const auto value = any_number_from(figure, "value");
    const auto unit = figure.has("unit") ? figure.text("unit") : "";
    if (name && value && unit) figures.push_back({*name, *value, *unit});
  }
  return figures;
}

}  // namespace

const std::vector<std::string>& transform_keys() {
  static const std::vector<std::string> kKeys{"target", "source", "rotation", "translation_mm", "matrix"};
  return kKeys;
}

std::optional<RigidTransform> transform_from(const YamlMap& map, const RigidTransform& expected) {
  if (!map.valid()) return std::nullopt;
  RigidTransform transform = expected;
  check_frame(map, "target", expected.target);
  if (!expected.source.empty())
    check_frame(map, "source", expected.source);
  else if (const auto source = map.text("source"))
    transform.source = *source;
  if (map.has("matrix")) {
    for (const char* key : {"rotation", "translation_mm"})
      if (map.has(key)) map.fault(key, std::string(key) + ": 'matrix' already gives it; keep one of the two");
    const auto matrix = map.matrix("matrix", 4, 4);
    if (!matrix) return std::nullopt;
    if (matrix->row(3) != Eigen::RowVector4d(0, 0, 0, 1)) {
      map.fault("matrix", "matrix: the last row of a rigid transform is [0, 0, 0, 1]");
      return std::nullopt;
    }
    transform.rotation = matrix->topLeftCorner<3, 3>();
    transform.translation_mm = matrix->topRightCorner<3, 1>();
  } else {
    const auto rotation = map.matrix("rotation", 3, 3);
    const auto translation = map.vector3("translation_mm");
    if (!rotation || !translation) return std::nullopt;
    transform.rotation = *rotation;
    transform.translation_mm = *translation;
  }
  try {
    check_rigid(transform, map.has("matrix") ? "matrix" : "rotation");
  } catch (const Error& error) {
    map.fault(map.has("matrix") ? "matrix" : "rotation", error.what());
    return std::nullopt;
  }
  return transform;
}

std::optional<Detector> detector_from(const YamlMap& map, int width_px, int height_px) {
  const bool has_corner = map.has("corner_mm");
  if (has_corner && map.has("centre_mm"))
    map.fault("centre_mm", "centre_mm: 'corner_mm' already says where the detector is; keep one of the two");
  const auto source = map.vector3("source_mm"), place = map.vector3(has_corner ? "corner_mm" : "centre_mm"),
             columns = map.vector3("columns"), rows = map.vector3("rows");
  const auto pixel = map.numbers("pixel_mm", 2);
  if (!source || !place || !columns || !rows || !pixel) return std::nullopt;
  if (!(columns->norm() > 0 && rows->norm() > 0) || std::abs(columns->normalized().dot(rows->normalized())) > kSquare) {
    map.fault("rows", "rows: expected a direction at a right angle to 'columns'");
    return std::nullopt;
  }
  if (!((*pixel)[0] > 0 && (*pixel)[1] > 0)) {
    map.fault("pixel_mm", "pixel_mm: expected the width and the height of a pixel, more than 0");
    return std::nullopt;
  }
  Detector detector{*source, *place, columns->normalized(), rows->normalized(), {(*pixel)[0], (*pixel)[1]}};
  if (!has_corner)
    detector.corner_mm -=
        0.5 * (width_px - 1) * (*pixel)[0] * detector.columns + 0.5 * (height_px - 1) * (*pixel)[1] * detector.rows;
  const double away_mm = (detector.corner_mm - *source).dot(detector.columns.cross(detector.rows));
  if (std::abs(away_mm) > 1) return detector;
  map.fault("source_mm", "source_mm: the source lies in the detector's plane");
  return std::nullopt;
}

std::optional<CameraInFile> camera_from(const YAML::Node& node, YamlFile& file) {
  const YamlMap map(file, node, "camera",
                    {"marrow-camera", "width_px", "height_px", "intrinsics", "radial_distortion", "camera_from_world",
                     "c_arm", "projection_matrix", "detector", "distortion", "deviations"});
  if (map.has("marrow-camera")) check_version(map, "marrow-camera");
  const auto width = map.integer("width_px"), height = map.integer("height_px");
  const int width_px = width.value_or(0), height_px = height.value_or(0);
  // Three keys say all by themselves.
  std::string whole;
  for (const std::string key : {"c_arm", "projection_matrix", "detector"}) {
    if (!map.has(key)) continue;
    if (!whole.empty()) map.fault(key, key + ": '" + whole + "' already gives the camera; keep one of the two");
    if (whole.empty()) whole = key;
  }
  if (!whole.empty())
    for (const char* key : {"intrinsics", "camera_from_world"})
      if (map.has(key)) map.fault(key, std::string(key) + ": '" + whole + "' already gives it; keep one of the two");
  geometry::CameraDeviations deviations;
  const std::optional<Camera> camera = whole == "c_arm"
                                           ? camera_by_c_arm(map.node("c_arm"), width_px, height_px, file, deviations)
                                       : whole == "projection_matrix" ? camera_by_matrix(map, width_px, height_px)
                                       : whole == "detector"          ? camera_by_detector(map, width_px, height_px)
                                                             : camera_by_matrices(map, width_px, height_px, file);
  deviations = with_deviations(map, deviations);
  if (!camera || !width || !height) return std::nullopt;
  CameraInFile result{{*camera, {}}, {}, deviations};
  if (map.has("distortion") && !take_measured(map, result)) return std::nullopt;
  if (map.has("radial_distortion")) {
    const auto terms = map.vector3("radial_distortion");
    if (!terms) return std::nullopt;
    for (int i = 0; i < 3; ++i) result.distortion.k[std::size_t(i)] = (*terms)[i];
  }
  try {
    check_camera(result.camera, "camera");
    check_distortion(camera->intrinsics, result.distortion, width_px, height_px, "camera");
  } catch (const Error& error) {
    file.fault(node.Mark(), error.what());
    return std::nullopt;
  }
  return result;
}

Seeds seeds_from(const YamlMap& map, const std::string& fragment) {
  return {fragment, map.points("seeds"), map.boolean_or("register", true)};
}

void check_version(const YamlMap& map, const std::string& key) {
  const auto version = map.integer(key);
  if (version && *version != 1)
    map.fault(key, formatted("{}: this program reads version 1, the file is of version {}", key, *version));
}

Pose read_pose_file(const std::filesystem::path& path) {
  YamlFile file(path);
  std::vector<std::string> keys = transform_keys();
  for (const char* key : {"marrow-pose", "fragment_frame", "predicted_deviation", "covariance", "warnings", "cost",
                          "evaluations", "convergence"})
    keys.push_back(key);
  const YamlMap map(file, file.root(), "pose", keys);
  check_version(map, "marrow-pose");
  Pose pose;
  if (map.has("source") && map.text("source") == "world")
    map.fault("source",
              "source: expected the frame of what was registered, such as 'ct' or 'implant', got 'world'; this file "
              "holds another transform");
  if (const auto transform = transform_from(map, {"world", ""})) pose.world_from_model = *transform;
  if (map.has("fragment_frame"))
    if (const auto frame = frame_from(map.node("fragment_frame"), file)) pose.frame = *frame;
  // predicted_deviation is only for human readers; the covariance contains it.
  if (map.has("covariance")) pose.covariance = covariance_from(map);
  pose.warnings = map.texts_or_none("warnings");
  if (map.has("cost")) pose.cost = map.number("cost").value_or(0);
  if (map.has("evaluations")) pose.evaluations = map.integer("evaluations").value_or(0);
  if (map.has("convergence")) pose.convergence = convergence_from(map);
  file.finish();
  return pose;
}

Verdict read_verdict_file(const std::filesystem::path& path) {
  YamlFile file(path);
  const YamlMap map(file, file.root(), "verdict",
                    {"marrow-verdict", "judgement", "failure_probability", "reasons", "remedies", "figures"});
  check_version(map, "marrow-verdict");
  Verdict verdict;
  if (const auto name = map.text("judgement")) {
    const auto judgement = judgement_named(*name);
    if (!judgement) map.fault("judgement", "judgement: expected trusted, doubtful or wrong, got '" + *name + "'");
    verdict.judgement = judgement.value_or(Judgement::doubtful);
  }
  if (const auto probability = any_number_from(map, "failure_probability")) {
    if (!(std::isnan(*probability) || (*probability >= 0 && *probability <= 1)))
      map.fault("failure_probability",
                "failure_probability: expected a number from 0 to 1, or .nan if it is not known, got " +
                    number(*probability));
    verdict.failure_probability = *probability;
  }
  verdict.reasons = map.texts_or_none("reasons");
  verdict.remedies = map.texts_or_none("remedies");
  if (map.has("figures")) verdict.figures = figures_from(map);
  file.finish();
  return verdict;
}

List<Seeds> read_seeds_file(const std::filesystem::path& path) {
  YamlFile file(path);
  const YamlMap map(file, file.root(), "seeds", {"marrow-seeds", "fragments"});
  check_version(map, "marrow-seeds");
  List<Seeds> seeds;
  if (const auto fragments = map.required("fragments")) {
    const YamlMap by_name(file, *fragments, "fragments", FreeKeys{});
    if (by_name.valid() && by_name.keys().empty() && !file.has_faults())
      map.fault("fragments", "fragments: expected fragments by name");
    for (const std::string& name : by_name.keys())
      seeds.add(name,
                seeds_from(YamlMap(file, by_name.node(name), "fragment '" + name + "'", {"seeds", "register"}), name));
  }
  file.finish();
  return seeds;
}

}  // namespace marrow::files
