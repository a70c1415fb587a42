// SPDX-License-Identifier: Apache-2.0
#pragma once
// marrow's values as YAML. Numbers are written in the shortest form that reads as the same double, so plugins/read gets
// back exactly the same values.
#include <yaml-cpp/emitter.h>

#include <string>

#include "marrow/domain/camera.hpp"
#include "marrow/domain/features.hpp"
#include "marrow/domain/verdict.hpp"
#include "marrow/domain/volume.hpp"

namespace marrow::files {

/// The shortest text that reads as the same double. YAML's words .nan, .inf and -.inf for what is not finite.
std::string number(double value);

/// Puts the value [x, y, z] in one line.
void put_vector(YAML::Emitter& out, const Eigen::Ref<const Eigen::VectorXd>& values);
/// Puts a list of rows, each in a line of its own.
void put_matrix(YAML::Emitter& out, const Eigen::Ref<const Eigen::MatrixXd>& values);
/// Puts the keys `target`, `source` and `matrix` into the map that was begun.
void put_transform(YAML::Emitter& out, const RigidTransform& target_from_source);
/// Puts the keys `seeds` and `register` of one fragment into the map that was begun.
void put_seeds(YAML::Emitter& out, const Seeds& seeds);

/// What was put, with a line break at its end, as files have it.
std::string text_of(const YAML::Emitter& out);

/// Whole files.
std::string camera(const Camera& camera);
std::string pose(const Pose& pose);
std::string truth(const Truth& truth);
std::string verdict(const Verdict& verdict);
std::string shaft_lines(const ShaftLines& lines);
std::string seeds(const Seeds& seeds);
std::string landmarks(const Landmarks& landmarks, const std::string& fragment);

}  // namespace marrow::files
