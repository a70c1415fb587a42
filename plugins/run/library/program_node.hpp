// SPDX-License-Identifier: Apache-2.0
#pragma once
// The inputs and options that all nodes that run a program have.
#include <marrow/plugin.hpp>

#include "marrow/run/program_call.hpp"

namespace marrow::run {

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
