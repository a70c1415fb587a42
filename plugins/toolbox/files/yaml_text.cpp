// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/files/yaml_text.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "header_lines.hpp"
#include "marrow/base/number_text.hpp"

namespace marrow::files {
namespace {

using YAML::BeginMap, YAML::EndMap, YAML::BeginSeq, YAML::EndSeq, YAML::Flow, YAML::Key, YAML::Value;
using YAML::Comment, YAML::DoubleQuoted;

/// A word is written plainly. Any other name is quoted: it may be "yes" or "1", or hold a colon or a line break.
bool is_word(const std::string& text) {
  const auto is_of_word = [](unsigned char c) { return std::isalnum(c) || c == '_' || c == '-'; };
  static const char* const kNoTexts[] = {"true", "false", "yes", "no", "on", "off", "null", "y", "n"};
  const std::string small = in_small_letters(text);
  return !text.empty() && std::isalpha(static_cast<unsigned char>(text[0])) &&
         std::all_of(text.begin(), text.end(), is_of_word) &&
         std::find(std::begin(kNoTexts), std::end(kNoTexts), small) == std::end(kNoTexts);
}

void put_name(YAML::Emitter& out, const std::string& name) {
  if (!is_word(name)) out << DoubleQuoted;
  out << name;
}

/// The name as put_name() writes it, in one line.
std::string written(const std::string& name) {
  YAML::Emitter out;
  put_name(out, name);
  return out.c_str();
}

/// Begins a list of lines. The emitter would put an empty one into a line below its key.
void begin_list(YAML::Emitter& out, bool is_empty) {
  if (is_empty) out << Flow;
  out << BeginSeq;
}

void put_texts(YAML::Emitter& out, const char* key, const std::vector<std::string>& texts) {
  out << Key << key << Value;
  begin_list(out, texts.empty());
  for (const std::string& text : texts) out << DoubleQuoted << text;
  out << EndSeq;
}

void put_segment(YAML::Emitter& out, const LineSegment& line) {
  out << Flow << BeginMap;
  put_vector(out << Key << "from_px" << Value, line.from_px);
  put_vector(out << Key << "to_px" << Value, line.to_px);
  out << EndMap;
}

/// The keys `left` and `right`.
template <class Pair>
void put_borders(YAML::Emitter& out, const Pair& pair) {
  put_segment(out << Key << "left" << Value, pair.left);
  put_segment(out << Key << "right" << Value, pair.right);
}

/// Standard deviations for human readers: degrees about and mm along the fragment's axes.
void put_deviations(YAML::Emitter& out, const Matrix6d& covariance, const FragmentFrame& frame) {
  Eigen::Vector3d rotation_deg, translation_mm;
  for (int i = 0; i < 3; ++i) {
    rotation_deg[i] = degrees(std::sqrt(covariance(i, i)));
    translation_mm[i] = std::sqrt(covariance(3 + i, 3 + i));
  }
  out << Key << "predicted_deviation" << Value
      << Comment(frame.is_anatomical
                     ? "one standard deviation about and along the fragment's frontal, lateral and long axes"
                     : "one standard deviation about and along the axes of fragment_frame")
      << BeginMap;
  put_vector(out << Key << "rotation_deg" << Value, rotation_deg);
  put_vector(out << Key << "translation_mm" << Value, translation_mm);
  out << EndMap;
}

void put_seen(YAML::Emitter& out, const Landmarks::Seen& seen) {
  if (seen.deviation_px > 0)
    put_vector(out, Eigen::Vector3d(seen.pixel.x(), seen.pixel.y(), seen.deviation_px));
  else
    put_vector(out, seen.pixel);
}

/// The axes and the origin of the CT: what a pose has that came with no frame.
bool is_of_ct(const FragmentFrame& frame) {
  return !frame.is_anatomical && frame.origin_mm.isZero(0) && frame.axes == Eigen::Matrix3d::Identity();
}

void put_frame(YAML::Emitter& out, const FragmentFrame& frame) {
  out << Key << "fragment_frame" << Value
      << Comment(frame.is_anatomical
                     ? "the axes that the deviations are about, in CT coordinates; columns: frontal, lateral, long"
                     : "the axes that the deviations are about, in CT coordinates; they are not those of the bone")
      << BeginMap;
  put_vector(out << Key << "origin_mm" << Value, frame.origin_mm);
  put_matrix(out << Key << "axes" << Value, frame.axes);
  if (!frame.is_anatomical) out << Key << "anatomical" << Value << false;
  out << EndMap;
}

void put_convergence(YAML::Emitter& out, const std::vector<Pose::Progress>& steps) {
  out << Key << "convergence" << Value << Comment("evaluations, and the least cost after them") << BeginSeq;
  for (const Pose::Progress& step : steps) out << Flow << BeginSeq << step.evaluations << number(step.cost) << EndSeq;
  out << EndSeq;
}

}  // namespace

std::string number(double value) {
  if (std::isnan(value)) return ".nan";
  if (std::isinf(value)) return value < 0 ? "-.inf" : ".inf";
  return shortest_number(value);
}

void put_vector(YAML::Emitter& out, const Eigen::Ref<const Eigen::VectorXd>& values) {
  out << Flow << BeginSeq;
  for (const double value : values) out << number(value);
  out << EndSeq;
}

void put_matrix(YAML::Emitter& out, const Eigen::Ref<const Eigen::MatrixXd>& values) {
  out << BeginSeq;
  for (Eigen::Index r = 0; r < values.rows(); ++r) put_vector(out, values.row(r).transpose());
  out << EndSeq;
}

void put_transform(YAML::Emitter& out, const RigidTransform& t) {
  Eigen::Matrix4d whole = Eigen::Matrix4d::Identity();
  whole.topLeftCorner<3, 3>() = t.rotation;
  whole.topRightCorner<3, 1>() = t.translation_mm;
  put_name(out << Key << "target" << Value, t.target);
  put_name(out << Key << "source" << Value, t.source);
  out << Key << "matrix" << Value << Comment(written(t.target) + "_from_" + written(t.source) + ", mm");
  put_matrix(out, whole);
}

void put_seeds(YAML::Emitter& out, const Seeds& seeds) {
  out << Key << "seeds" << Value << Comment("mm, in CT coordinates") << BeginSeq;
  for (const Eigen::Vector3d& point : seeds.points_mm) put_vector(out, point);
  out << EndSeq << Key << "register" << Value << seeds.wanted;
}

std::string text_of(const YAML::Emitter& out) { return std::string(out.c_str(), out.size()) + "\n"; }

std::string camera(const Camera& camera) {
  YAML::Emitter out;
  out << BeginMap << Key << "marrow-camera" << Value << 1;
  out << Key << "width_px" << Value << camera.width_px << Key << "height_px" << Value << camera.height_px;
  out << Key << "intrinsics" << Value << Comment("pixel = intrinsics * camera point, divided by the third coordinate");
  put_matrix(out, camera.intrinsics);
  out << Key << "camera_from_world" << Value << BeginMap;
  put_transform(out, camera.camera_from_world);
  out << EndMap << EndMap;
  return text_of(out);
}

std::string pose(const Pose& pose) {
  YAML::Emitter out;
  out << BeginMap << Key << "marrow-pose" << Value << 1;
  put_transform(out, pose.world_from_model);
  if (pose.covariance) put_deviations(out, *pose.covariance, pose.frame);
  put_texts(out, "warnings", pose.warnings);
  if (std::isfinite(pose.cost)) out << Key << "cost" << Value << number(pose.cost);
  out << Key << "evaluations" << Value << pose.evaluations;
  if (!is_of_ct(pose.frame) || pose.covariance) put_frame(out, pose.frame);
  if (pose.covariance && pose.covariance->allFinite()) {
    out << Key << "covariance" << Value << Comment("of rotation [rad] and translation [mm] about and along these axes");
    put_matrix(out, *pose.covariance);
  }
  if (!pose.convergence.empty()) put_convergence(out, pose.convergence);
  out << EndMap;
  return text_of(out);
}

std::string truth(const Truth& truth) {
  YAML::Emitter out;
  out << BeginMap << Key << "marrow-truth" << Value << 1;
  put_transform(out, truth.world_from_model);
  out << EndMap;
  return text_of(out);
}

std::string verdict(const Verdict& verdict) {
  YAML::Emitter out;
  out << BeginMap << Key << "marrow-verdict" << Value << 1;
  out << Key << "judgement" << Value << name_of(verdict.judgement);
  out << Key << "failure_probability" << Value << number(verdict.failure_probability);
  put_texts(out, "reasons", verdict.reasons);
  put_texts(out, "remedies", verdict.remedies);
  out << Key << "figures" << Value;
  begin_list(out, verdict.figures.empty());
  for (const Metric& figure : verdict.figures) {
    out << Flow << BeginMap << Key << "name" << Value << DoubleQuoted << figure.name;
    out << Key << "value" << Value << number(figure.value);
    if (!figure.unit.empty()) out << Key << "unit" << Value << DoubleQuoted << figure.unit;
    out << EndMap;
  }
  out << EndSeq << EndMap;
  return text_of(out);
}

std::string shaft_lines(const ShaftLines& lines) {
  YAML::Emitter out;
  out << BeginMap << Key << "marrow-shaft-lines" << Value << 1;
  put_borders(out, lines);
  out << Key << "width_mm" << Value << number(lines.width_mm);
  out << Key << "width_deviation_mm" << Value << number(lines.width_deviation_mm);
  out << Key << "log_likelihood" << Value << number(lines.log_likelihood);
  out << Key << "rejected" << Value;
  begin_list(out, lines.rejected.empty());
  for (const ShaftLines::Rejected& pair : lines.rejected) {
    put_borders(out << BeginMap, pair);
    out << Key << "reason" << Value << DoubleQuoted << pair.reason << EndMap;
  }
  out << EndSeq << EndMap;
  return text_of(out);
}

std::string seeds(const Seeds& seeds) {
  YAML::Emitter out;
  out << BeginMap << Key << "marrow-seeds" << Value << 1;
  out << Key << "fragments" << Value << BeginMap << Key << DoubleQuoted << seeds.fragment << Value << BeginMap;
  put_seeds(out, seeds);
  out << EndMap << EndMap << EndMap;
  return text_of(out);
}

std::string landmarks(const Landmarks& landmarks, const std::string& fragment) {
  YAML::Emitter out;
  out << BeginMap << Key << "marrow-landmarks" << Value << 1;
  out << Key << "fragments" << Value << BeginMap << Key << DoubleQuoted << fragment << Value << BeginMap;
  out << Key << "points" << Value << Comment("mm, in CT coordinates") << BeginMap;
  for (const auto& point : landmarks.points)
    put_vector(out << Key << DoubleQuoted << point.name << Value, point.model_mm);
  out << EndMap;
  std::vector<std::string> views;
  for (const auto& seen : landmarks.seen)
    if (std::find(views.begin(), views.end(), seen.view) == views.end()) views.push_back(seen.view);
  const bool states_deviation =
      std::any_of(landmarks.seen.begin(), landmarks.seen.end(), [](const auto& seen) { return seen.deviation_px > 0; });
  const char* const form = states_deviation ? "px, [u, v, deviation] by view" : "px, [u, v] by view";
  if (!views.empty()) out << Key << "seen" << Value << Comment(form) << BeginMap;
  for (const std::string& view : views) {
    out << Key << DoubleQuoted << view << Value << BeginMap;
    for (const auto& seen : landmarks.seen)
      if (seen.view == view) put_seen(out << Key << DoubleQuoted << seen.name << Value, seen);
    out << EndMap;
  }
  if (!views.empty()) out << EndMap;
  if (!landmarks.tracked.empty()) {
    out << Key << "tracked" << Value << Comment("mm, in the world") << BeginMap;
    for (const auto& tracked : landmarks.tracked)
      put_vector(out << Key << DoubleQuoted << tracked.name << Value, tracked.world_mm);
    out << EndMap;
  }
  out << EndMap << EndMap << EndMap;
  return text_of(out);
}

}  // namespace marrow::files
