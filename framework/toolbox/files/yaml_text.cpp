// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/files/yaml_text.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdio>

namespace marrow::files {
namespace {

std::string segment(const LineSegment& line) {
  return "{from_px: " + vector(line.from_px) + ", to_px: " + vector(line.to_px) + "}";
}

/// A word is written plainly. Any other name is quoted: it may be "yes" or "1", or hold a colon or a line break.
std::string name(const std::string& text) {
  const auto is_of_word = [](unsigned char c) { return std::isalnum(c) || c == '_' || c == '-'; };
  static const char* const kNoTexts[] = {"true", "false", "yes", "no", "on", "off", "null", "y", "n"};
  std::string small = text;
  for (char& c : small) c = char(std::tolower(static_cast<unsigned char>(c)));
  const bool is_word = !text.empty() && std::isalpha(static_cast<unsigned char>(text[0])) &&
                       std::all_of(text.begin(), text.end(), is_of_word) &&
                       std::find(std::begin(kNoTexts), std::end(kNoTexts), small) == std::end(kNoTexts);
  return is_word ? text : quoted(text);
}

/// Standard deviations for human readers: degrees about and mm along the fragment's axes.
std::string deviations(const Matrix6d& covariance) {
  Eigen::Vector3d rotation_deg, translation_mm;
  for (int i = 0; i < 3; ++i) {
    rotation_deg[i] = degrees(std::sqrt(covariance(i, i)));
    translation_mm[i] = std::sqrt(covariance(3 + i, 3 + i));
  }
  return "predicted_deviation:  # one standard deviation about and along the fragment's frontal, lateral and long "
         "axes\n  rotation_deg: " +
         vector(rotation_deg) + "\n  translation_mm: " + vector(translation_mm) + "\n";
}

}  // namespace

std::string number(double value) {
  if (std::isnan(value)) return ".nan";
  if (std::isinf(value)) return value < 0 ? "-.inf" : ".inf";
  char text[32];
  return std::string(text, std::to_chars(text, text + sizeof text, value).ptr);
}

std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const unsigned char c : text) {
    char escape[8];
    if (c == '"' || c == '\\')
      result += std::string("\\") + char(c);
    else if (c < 0x20)
      result += (std::snprintf(escape, sizeof escape, "\\x%02X", c), escape);
    else
      result += char(c);
  }
  return result + "\"";
}

std::string vector(const Eigen::Ref<const Eigen::VectorXd>& values) {
  std::string text = "[";
  for (Eigen::Index i = 0; i < values.size(); ++i) text += (i ? ", " : "") + number(values[i]);
  return text + "]";
}

std::string matrix(const Eigen::Ref<const Eigen::MatrixXd>& values, const std::string& indent) {
  std::string text;
  for (Eigen::Index r = 0; r < values.rows(); ++r) text += indent + "- " + vector(values.row(r).transpose()) + "\n";
  return text;
}

std::string transform(const RigidTransform& t, const std::string& indent) {
  Eigen::Matrix4d whole = Eigen::Matrix4d::Identity();
  whole.topLeftCorner<3, 3>() = t.rotation;
  whole.topRightCorner<3, 1>() = t.translation_mm;
  const std::string target = name(t.target), source = name(t.source);
  return indent + "target: " + target + "\n" + indent + "source: " + source + "\n" + indent + "matrix:  # " + target +
         "_from_" + source + ", mm\n" + matrix(whole, indent + "  ");
}

std::string camera(const Camera& camera) {
  return "marrow-camera: 1\nwidth_px: " + std::to_string(camera.width_px) +
         "\nheight_px: " + std::to_string(camera.height_px) +
         "\nintrinsics:  # pixel = intrinsics * camera point, divided by the third coordinate\n" +
         matrix(camera.intrinsics, "  ") + "camera_from_world:\n" + transform(camera.camera_from_world, "  ");
}

std::string seeds(const Seeds& seeds, const std::string& indent) {
  std::string text = indent + "seeds:  # mm, in CT coordinates\n";
  for (const Eigen::Vector3d& point : seeds.points_mm) text += indent + "  - " + vector(point) + "\n";
  return text + indent + "register: " + (seeds.wanted ? "true" : "false") + "\n";
}

std::string pose(const Pose& pose) {
  std::string text = "marrow-pose: 1\n" + transform(pose.world_from_model, "");
  if (pose.covariance) text += deviations(*pose.covariance);
  text += "warnings:" + std::string(pose.warnings.empty() ? " []" : "") + "\n";
  for (const std::string& warning : pose.warnings) text += "  - " + quoted(warning) + "\n";
  if (std::isfinite(pose.cost)) text += "cost: " + number(pose.cost) + "\n";
  text += "evaluations: " + std::to_string(pose.evaluations) + "\n";
  text +=
      "fragment_frame:  # the axes that the deviations are about, in CT coordinates; columns: frontal, lateral, long\n";
  text += "  origin_mm: " + vector(pose.frame.origin_mm) + "\n  axes:\n" + matrix(pose.frame.axes, "    ");
  if (pose.covariance && pose.covariance->allFinite())
    text += "covariance:  # of rotation [rad] and translation [mm] about and along these axes\n" +
            matrix(*pose.covariance, "  ");
  if (!pose.convergence.empty()) text += "convergence:  # evaluations, and the least cost after them\n";
  for (const Pose::Progress& step : pose.convergence)
    text += "  - [" + std::to_string(step.evaluations) + ", " + number(step.cost) + "]\n";
  return text;
}

std::string truth(const Truth& truth) { return "marrow-truth: 1\n" + transform(truth.world_from_model, ""); }

std::string shaft_lines(const ShaftLines& lines) {
  std::string text = "marrow-shaft-lines: 1\nleft: " + segment(lines.left) + "\nright: " + segment(lines.right) +
                     "\nwidth_mm: " + number(lines.width_mm) +
                     "\nwidth_deviation_mm: " + number(lines.width_deviation_mm) +
                     "\nlog_likelihood: " + number(lines.log_likelihood) +
                     "\nrejected:" + (lines.rejected.empty() ? " []" : "") + "\n";
  for (const ShaftLines::Rejected& pair : lines.rejected)
    text += "  - left: " + segment(pair.left) + "\n    right: " + segment(pair.right) +
            "\n    reason: " + quoted(pair.reason) + "\n";
  return text;
}

}  // namespace marrow::files
