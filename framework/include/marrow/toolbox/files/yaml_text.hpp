// SPDX-License-Identifier: Apache-2.0
#pragma once
// marrow's values as YAML text. Numbers are written in the shortest form that reads as the same double, so plugins/read
// gets back exactly the same values.
#include <string>

#include "marrow/domain/camera.hpp"
#include "marrow/domain/features.hpp"
#include "marrow/domain/list.hpp"
#include "marrow/domain/pose.hpp"
#include "marrow/domain/volume.hpp"

namespace marrow::files {

std::string number(double value);
/// Text in double quotes, with escapes.
std::string quoted(const std::string& text);
/// [x, y, z]
std::string vector(const Eigen::Ref<const Eigen::VectorXd>& values);
/// One line for each row, as a list of flow lists, each line indented.
std::string matrix(const Eigen::Ref<const Eigen::MatrixXd>& values, const std::string& indent);

/// The keys of a transform (target, source, matrix), each line indented.
std::string transform(const RigidTransform& target_from_source, const std::string& indent);
/// A whole camera file.
std::string camera(const Camera& camera);
/// The keys `seeds` and `register` of a fragment, each line indented.
std::string seeds(const Seeds& seeds, const std::string& indent);
/// Whole files.
std::string pose(const Pose& pose);
std::string truth(const Truth& truth);
std::string shaft_lines(const ShaftLines& lines);

}  // namespace marrow::files
