// SPDX-License-Identifier: Apache-2.0
#pragma once
// Points of 3D Slicer: its markups (.mrk.json) and its older lists of fiducials (.fcsv).
#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

namespace marrow::exchange {

/// A control point with its label. `at_mm` is in LPS, as marrow's CT coordinates are.
struct MarkedPoint {
  std::string label;
  Eigen::Vector3d at_mm = Eigen::Vector3d::Zero();
};

/// Whether the extension is that of 3D Slicer's points: .mrk.json or .fcsv, in small or capital letters.
bool is_markups_file(const std::filesystem::path& path);

/// The points of a file of 3D Slicer, in the file's order. The file says whether its coordinates are LPS or RAS; the
/// result is always LPS. All lists of a .mrk.json are read. Points that are declared but not placed yet are left out.
/// Throws Error if the file is damaged, of another version or unit, or holds no point.
std::vector<MarkedPoint> read_markups(const std::filesystem::path& path);

/// A whole .mrk.json or .fcsv file in LPS. Numbers are written so that reading gives exactly the same ones.
std::string markups_json(const std::vector<MarkedPoint>& points);
std::string markups_fcsv(const std::vector<MarkedPoint>& points);

}  // namespace marrow::exchange
