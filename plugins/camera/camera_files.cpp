// SPDX-License-Identifier: Apache-2.0
#include "camera_files.hpp"

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

}  // namespace marrow::conformance
