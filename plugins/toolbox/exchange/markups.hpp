// SPDX-License-Identifier: Apache-2.0
#pragma once
// Points of 3D Slicer: its markups (.mrk.json) and its older lists of fiducials (.fcsv), and marrow's landmarks and
// seeds as such points, and back.
#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "marrow/domain/features.hpp"
#include "marrow/domain/list.hpp"
#include "marrow/domain/volume.hpp"

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

/// The points in the file as landmarks of one fragment; their labels are their names. Throws Error as read_markups()
/// does, and for a label that is empty, is not a valid name, or occurs twice.
Landmarks read_marked_landmarks(const std::filesystem::path& path);

/// The points in the file as seeds. A point's label names its fragment, and may end with a number, because 3D Slicer
/// numbers points: "distal-1" and "distal-2" are seeds of "distal". If `fragment` is given, all points are its seeds.
/// Throws Error as read_markups() does, and for a label that names no fragment.
List<Seeds> read_marked_seeds(const std::filesystem::path& path, const std::string& fragment);

/// The points of the model, and the seeds with the labels that read_marked_seeds() takes. Throw Error for a coordinate
/// that is not finite.
std::vector<MarkedPoint> marked_points(const Landmarks& landmarks);
std::vector<MarkedPoint> marked_points(const Seeds& seeds);

}  // namespace marrow::exchange
