// SPDX-License-Identifier: Apache-2.0
#pragma once
// marrow's values as YAML text that plugins/read takes back to the last bit: numbers are written in the shortest form
// that reads as the same double.
#include <string>

#include "marrow/domain/camera.hpp"
#include "marrow/domain/features.hpp"
#include "marrow/domain/list.hpp"
#include "marrow/domain/pose.hpp"
#include "marrow/domain/volume.hpp"

namespace marrow::files {

std::string number(double value);
/// In double quotes, with escapes.
std::string quoted(const std::string& text);
/// [x, y, z]
std::string vector(const Eigen::Ref<const Eigen::VectorXd>& values);
/// Rows below each other as a flow list, each line indented.
std::string matrix(const Eigen::Ref<const Eigen::MatrixXd>& values, const std::string& indent);

/// The keys of a transform (target, source, matrix), each line indented.
std::string transform(const RigidTransform& target_from_source, const std::string& indent);
/// A whole camera file.
std::string camera(const Camera& camera);
/// The keys `seeds` and `register` of a fragment, each line indented.
std::string seeds(const Seeds& seeds, const std::string& indent);
std::string pose(const Pose& pose);
std::string truth(const Truth& truth);
std::string shaft_lines(const ShaftLines& lines);

}  // namespace marrow::files
