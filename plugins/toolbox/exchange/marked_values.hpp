// SPDX-License-Identifier: Apache-2.0
#pragma once
// marrow's landmarks and seeds as points of 3D Slicer, and back.
#include "marrow/domain/landmarks.hpp"
#include "marrow/domain/list.hpp"
#include "marrow/domain/volume.hpp"
#include "marrow/toolbox/exchange/markups.hpp"

namespace marrow::exchange {

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
