// SPDX-License-Identifier: Apache-2.0
#pragma once
// The inputs of a node as files in the formats that programs of others read.
#include <filesystem>
#include <string>
#include <vector>

#include "marrow/domain/features.hpp"
#include "marrow/domain/image.hpp"
#include "marrow/domain/mesh.hpp"
#include "marrow/domain/volume.hpp"

namespace marrow::run {

/// The inputs of a node that runs a program. Those that are not wired are null.
struct GivenInputs {
  const Volume* volume = nullptr;
  const Volume* second_volume = nullptr;
  const SignedField* field = nullptr;
  const Mesh* mesh = nullptr;
  const Image* image = nullptr;
  const Metrics* metrics = nullptr;
};

/// The names of the inputs, and the formats that each can be written in.
std::vector<std::string> names_of_inputs();
std::vector<std::string> formats_of_input(const std::string& name);

/// Whether the input is wired.
bool is_given(const GivenInputs& inputs, const std::string& name);

/// Writes an input that is wired. Throws Error if the file cannot hold it.
void write_input(const GivenInputs& inputs, const std::string& name, const std::string& format,
                 const std::filesystem::path& file);

/// A surface in mm and LPS as binary STL, whose coordinates have 32 bits, or as binary PLY with 64.
std::string stl_bytes(const Mesh& mesh);
std::string ply_bytes(const Mesh& mesh);

}  // namespace marrow::run
