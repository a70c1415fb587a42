// SPDX-License-Identifier: Apache-2.0
#include "camera_files.hpp"

#include <random>
#include <sstream>

#include "marrow/conformance.hpp"
#include "marrow/toolbox/files/atomic_write.hpp"

namespace marrow::conformance {
namespace {

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
  std::ostringstream text;
  text << "marrow-bead-board: 1\nsides:\n";
  for (const auto& [side, z] : {std::pair<std::string, double>{"lower", 0}, {"upper", 80}}) {
    text << "  " << side << ":\n";
    for (const auto& [key, diameter] : {std::pair<std::string, double>{"landmarks", 3}, {"beads", 1.5}}) {
      text << "    " << key << ":\n      diameter_mm: " << diameter << "\n      at_mm:\n";
      text.precision(12);
      for (const Bead& bead : board_beads())
        if (bead.diameter_mm == diameter && bead.centre_mm.z() == z)
          text << "        - [" << bead.centre_mm.x() << ", " << bead.centre_mm.y() << ", " << z << "]\n";
    }
  }
  return written("board.yaml", text.str());
}

std::filesystem::path points_file(const Camera& a, const Camera& b, bool mirrored) {
  std::ostringstream text;
  text.precision(12);
  text << "marrow-points: 1\npoints:\n";
  const auto place = [&](const Camera& camera, const Eigen::Vector3d& point) {
    const Eigen::Vector2d pixel = project(camera, point);
    text << "[" << (mirrored ? camera.width_px - 1 - pixel.x() : pixel.x()) << ", " << pixel.y() << "]";
  };
  for (const Bead& bead : board_beads()) {
    text << "  - {at_mm: [" << bead.centre_mm.x() << ", " << bead.centre_mm.y() << ", " << bead.centre_mm.z()
         << "], seen_px: {a: ";
    place(a, bead.centre_mm);
    text << ", b: ";
    place(b, bead.centre_mm);
    text << "}}\n";
  }
  return written(mirrored ? "mirrored.yaml" : "points.yaml", text.str());
}

std::filesystem::path xray_file(const std::string& name, double primary_deg, double secondary_deg) {
  const auto us = [](std::uint32_t tag, std::uint32_t value) { return element(tag, "US", little(value, 2)); };
  const auto ds = [](std::uint32_t tag, double value) { return element(tag, "DS", std::to_string(value)); };
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
