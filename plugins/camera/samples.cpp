// SPDX-License-Identifier: Apache-2.0
#include "samples.hpp"

#include <Eigen/LU>
#include <cmath>
#include <random>

#include "marrow/base/number_text.hpp"
#include "marrow/conformance.hpp"
#include "marrow/toolbox/files/atomic_write.hpp"
#include "marrow/toolbox/files/yaml_text.hpp"

namespace marrow::conformance {
namespace {

using YAML::BeginMap, YAML::EndMap, YAML::BeginSeq, YAML::EndSeq, YAML::Key, YAML::Value;

/// A place in one line, each number with 12 digits.
void put_place(YAML::Emitter& out, const Eigen::Ref<const Eigen::VectorXd>& place) {
  out << YAML::Flow << BeginSeq;
  for (const double coordinate : place) out << YAML::DoublePrecision(12) << coordinate;
  out << EndSeq;
}

std::filesystem::path written(const std::string& name, const std::string& text) {
  const std::filesystem::path path = files_folder() / name;
  files::write_text(path, text);
  return path;
}

std::string little(std::uint32_t value, int width) {
  std::string bytes;
  for (int i = 0; i < width; ++i) bytes += char(value >> (8 * i));
  return bytes;
}

/// A DICOM element in the transfer syntax Explicit VR Little Endian.
std::string element(std::uint32_t tag, const std::string& kind, std::string value) {
  if (value.size() % 2) value += kind == "UI" ? '\0' : ' ';
  const bool is_long = kind == "OW" || kind == "OB";
  const std::string length =
      is_long ? little(0, 2) + little(std::uint32_t(value.size()), 4) : little(std::uint32_t(value.size()), 2);
  return little(tag >> 16, 2) + little(tag & 0xFFFF, 2) + kind + length + value;
}

constexpr int kSide_px = 320;
constexpr double kOut_px = 6, kTurn_px = -2;  ///< of a point at half the side from the middle

std::vector<Eigen::Vector2d> dots_px() {
  std::vector<Eigen::Vector2d> dots;
  const double step = 14, cosine = std::cos(0.1745), sine = std::sin(0.1745);
  for (int row = -14; row <= 14; ++row)
    for (int column = -14; column <= 14; ++column) {
      const Eigen::Vector2d at(162 + step * (cosine * column - sine * row),
                               157 + step * (sine * column + cosine * row));
      if ((at.array() > 12).all() && (at.array() < kSide_px - 12).all()) dots.push_back(at);
    }
  return dots;
}

/// Where a point of the straight image is seen: pincushion and S-shape about the middle, 320 x 320 pixels.
Eigen::Vector2d plate_seen_px(const Eigen::Vector2d& ideal_px) {
  const Eigen::Vector2d off = (ideal_px.array() - 0.5 * (kSide_px - 1)) / (0.5 * kSide_px);
  return ideal_px + off.squaredNorm() * (kOut_px * off + kTurn_px * Eigen::Vector2d(-off.y(), off.x()));
}

}  // namespace

const std::vector<Bead>& board_beads() {
  static const std::vector<Bead> kBeads = [] {
    std::mt19937 random(5);
    const auto uniform = [&] { return double(random()) / 4294967296.0 - 0.5; };
    std::vector<Bead> beads;
    for (const double z : {0.0, 80.0})
      for (int place = 0; place < 25; ++place) {
        const Eigen::Vector3d centre(26 * (place % 5 - 2) + 12 * uniform(), 26 * (place / 5 - 2) + 12 * uniform(), z);
        const bool is_large = place == 6 || place == 8 || place == 13 || place == 16 || place == 11 || place == 18;
        if (place != 12) beads.push_back({centre, is_large ? 3.0 : 1.5});
      }
    return beads;
  }();
  return kBeads;
}

std::filesystem::path board_file() {
  YAML::Emitter out;
  out << BeginMap << Key << "marrow-bead-board" << Value << 1 << Key << "sides" << Value << BeginMap;
  for (const auto& [side, z] : {std::pair<std::string, double>{"lower", 0}, {"upper", 80}}) {
    out << Key << side << Value << BeginMap;
    for (const auto& [key, diameter] : {std::pair<std::string, double>{"landmarks", 3}, {"beads", 1.5}}) {
      out << Key << key << Value << BeginMap << Key << "diameter_mm" << Value << diameter;
      out << Key << "at_mm" << Value << BeginSeq;
      for (const Bead& bead : board_beads())
        if (bead.diameter_mm == diameter && bead.centre_mm.z() == z) put_place(out, bead.centre_mm);
      out << EndSeq << EndMap;
    }
    out << EndMap;
  }
  out << EndMap << EndMap;
  return written("board.yaml", files::text_of(out));
}

std::filesystem::path points_file(const Camera& a, const Camera& b, bool mirrored) {
  const auto seen = [&](const Camera& camera, const Bead& bead) {
    Eigen::Vector2d pixel = project(camera, bead.centre_mm);
    if (mirrored) pixel.x() = camera.width_px - 1 - pixel.x();
    return pixel;
  };
  YAML::Emitter out;
  out << BeginMap << Key << "marrow-points" << Value << 1 << Key << "points" << Value << BeginSeq;
  for (const Bead& bead : board_beads()) {
    put_place(out << YAML::Flow << BeginMap << Key << "at_mm" << Value, bead.centre_mm);
    out << Key << "seen_px" << Value << BeginMap;
    put_place(out << Key << "a" << Value, seen(a, bead));
    put_place(out << Key << "b" << Value, seen(b, bead));
    out << EndMap << EndMap;
  }
  out << EndSeq << EndMap;
  return written(mirrored ? "mirrored.yaml" : "points.yaml", files::text_of(out));
}

std::filesystem::path xray_file(const std::string& name, double primary_deg, double secondary_deg) {
  const auto us = [](std::uint32_t tag, std::uint32_t value) { return element(tag, "US", little(value, 2)); };
  const auto ds = [](std::uint32_t tag, double value) { return element(tag, "DS", formatted("{:f}", value)); };
  const std::string meta =
      element(0x00020001, "OB", std::string("\0\1", 2)) + element(0x00020010, "UI", "1.2.840.10008.1.2.1");
  const std::string header = element(0x00080016, "UI", "1.2.840.10008.5.1.4.1.1.12.1") +
                             element(0x00080060, "CS", "XA") + ds(0x00181110, 1000) + ds(0x00181111, 600) +
                             element(0x00181164, "DS", "0.3\\0.4") + element(0x00181500, "CS", "STATIC") +
                             ds(0x00181510, primary_deg) + ds(0x00181511, secondary_deg) +
                             element(0x00185100, "CS", "HFS");
  const std::string image = us(0x00280002, 1) + element(0x00280004, "CS", "MONOCHROME2") + us(0x00280010, 48) +
                            us(0x00280011, 64) + us(0x00280100, 16) + us(0x00280101, 16) + us(0x00280102, 15) +
                            us(0x00280103, 0) + element(0x7FE00010, "OW", std::string(2 * 64 * 48, '\1'));
  return written(name + ".dcm", std::string(128, '\0') + "DICM" +
                                    element(0x00020000, "UL", little(std::uint32_t(meta.size()), 4)) + meta + header +
                                    image);
}

Picture chessboard_picture(const Camera& camera, const Eigen::Vector3d& middle_mm) {
  constexpr double kSquare_mm = 20;
  const Eigen::Matrix3d& turn = camera.camera_from_world.rotation;
  Eigen::Matrix3d pixel_from_board;
  pixel_from_board << turn.leftCols<2>(), middle_mm - turn * Eigen::Vector3d(80, 50, 0);
  const Eigen::Matrix3d board_from_pixel = (camera.intrinsics * pixel_from_board).inverse();
  cv::Mat pixels(camera.height_px, camera.width_px, CV_8UC3);
  for (int v = 0; v < camera.height_px; ++v)
    for (int u = 0; u < camera.width_px; ++u) {
      int dark = 0;
      for (int k = 0; k < 4; ++k) {
        const Eigen::Vector2d at =
            (board_from_pixel * Eigen::Vector3d(u - 0.25 + 0.5 * (k & 1), v - 0.25 + 0.5 * (k >> 1), 1)).hnormalized() /
            kSquare_mm;
        const int column = int(std::floor(at.x())), row = int(std::floor(at.y()));
        dark += column >= -1 && column <= 8 && row >= -1 && row <= 5 && (column + row) % 2 == 0;
      }
      pixels.at<cv::Vec3b>(v, u) = cv::Vec3b::all(std::uint8_t(230 - 50 * dark));
    }
  return {pixels};
}

Image plate_image() {
  cv::Mat image(kSide_px, kSide_px, CV_16U, cv::Scalar(9000));
  for (const Eigen::Vector2d& dot : dots_px()) {
    const Eigen::Vector2d at = plate_seen_px(dot);
    for (int v = std::max(0, int(at.y()) - 9); v <= std::min(kSide_px - 1, int(at.y()) + 9); ++v)
      for (int u = std::max(0, int(at.x()) - 9); u <= std::min(kSide_px - 1, int(at.x()) + 9); ++u) {
        const double squared = (Eigen::Vector2d(u, v) - at).squaredNorm();
        image.at<std::uint16_t>(v, u) = std::uint16_t(image.at<std::uint16_t>(v, u) + 8000 * std::exp(-squared / 8));
      }
  }
  return {image};
}

distortion::PlatePoints plate_points() {
  distortion::PlatePoints points{kSide_px, kSide_px, {}, {}, {}};
  for (const Eigen::Vector2d& dot : dots_px()) points.add(dot, plate_seen_px(dot));
  return points;
}

distortion::Distortion plate_distortion() {
  distortion::Distortion exact;
  exact.width_px = exact.height_px = kSide_px;
  exact.degree = 3;
  exact.terms_px.assign(distortion::terms_of(3), Eigen::Vector2d::Zero());
  exact.terms_px[6] = exact.terms_px[8] = {kOut_px, kTurn_px};
  exact.terms_px[7] = exact.terms_px[9] = {-kTurn_px, kOut_px};
  exact.area_px = {{10, 10}, {310, 10}, {310, 310}, {10, 310}};
  return exact;
}

marrow::Value plate_distortions() {
  List<distortion::Distortion> list;
  list.add("first", plate_distortion());
  distortion::Distortion none = plate_distortion();
  none.terms_px.assign(none.terms_px.size(), Eigen::Vector2d::Zero());
  list.add("second", none);
  return marrow::Value::of<distortion::Distortion>(list, "view");
}

double plate_distance_px(const distortion::Distortion& found) {
  double worst = 0;
  for (int v = 30; v <= 290; v += 20)
    for (int u = 30; u <= 290; u += 20)
      worst = std::max(worst, (seen_pixel(found, Eigen::Vector2d(u, v)) - plate_seen_px({u, v})).norm());
  return worst;
}

}  // namespace marrow::conformance
