// SPDX-License-Identifier: Apache-2.0
#pragma once
// One call of a program: its inputs as files, its output as a file.
#include <filesystem>
#include <functional>
#include <marrow/plugin.hpp>
#include <string>
#include <vector>

namespace marrow::run {

// The inputs of a node as files in the formats that programs of others read.

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

struct ProgramOptions {
  std::vector<std::string> command, version_command;
  std::vector<std::filesystem::path> files;
  std::string output_file;
  double max_time_s = 3600;
  int max_memory_mb = 0;
};

/// Runs the command in a temporary folder of its own, and calls `read` with the file that it made. `formats`: those
/// that `read` understands. Throws Error if a place in the command is unknown, if the program fails or exceeds its
/// limits, or if it makes no such file; Cancelled if the run is stopped.
void with_output(const GivenInputs& inputs, const ProgramOptions& options, const std::vector<std::string>& formats,
                 Context& context, const std::function<void(const std::filesystem::path&)>& read);

// The inputs and options that all nodes that run a program have.

/// Declares them. The function takes the inputs in this order.
template <class Builder>
Builder& with_program(Builder& node) {
  return node.in("volume", "CT, or any volume; {volume.FORMAT} in the command: mha, nrrd, nii or nii.gz")
      .in("second_volume", "another volume, as for a registration; {second_volume.FORMAT}")
      .in("field", "bone; {field.FORMAT} is a volume that is 1 inside and 0 outside")
      .in("mesh", "surface in mm, LPS; {mesh.FORMAT}: stl, ply, obj or vtp")
      .in("image", "grey image; {image.FORMAT}: png or tif")
      .in("metrics", "figures; {metrics.json}")
      .option("command", &ProgramOptions::command,
              "the program and its arguments, one item each; no shell reads them, so blanks, quotes and $ are what "
              "they are; {volume.nii.gz} and the like become paths, {{ a brace",
              required())
      .option("version_command", &ProgramOptions::version_command,
              "a program and its arguments that print the version; what they print counts in the key, so another "
              "version does not read back what this one made",
              required())
      .option("files", &ProgramOptions::files,
              "scripts and parameter files that the command uses, as {files.1}, {files.2}; they count by their content")
      .option("output_file", &ProgramOptions::output_file,
              "for a program that names its output itself: the file's name below {output_folder}")
      .option("max_time_s", &ProgramOptions::max_time_s, "longest time that the program may take", at_least(0.001))
      .option("max_memory_mb", &ProgramOptions::max_memory_mb,
              "most memory that the program and all that it starts may use; 0: no limit", at_least(0), unit("MB"))
      .relation(at_least_one({"command"}))
      .relation(at_least_one({"version_command"}));
}

}  // namespace marrow::run
