// SPDX-License-Identifier: Apache-2.0
#pragma once
// A pipeline's inputs and outputs as parameters of a command-line module of 3D Slicer.
#include <optional>
#include <string>
#include <vector>

#include "marrow/runtime/pipeline/pipeline.hpp"

namespace marrow::cli {

/// A parameter of Slicer's execution model.
struct SlicerParameter {
  std::string tag;   ///< the name of its element: image, transform, double, ...
  std::string name;  ///< letters, digits and '_'; its flag is --NAME
  std::string label, help;
  std::optional<std::string> default_text = {};
  std::string channel = {};               ///< input or output of a file or folder; empty: a value
  std::string end = {};                   ///< of the files' names; empty: any, or a folder
  std::vector<std::string> choices = {};  ///< of a string-enumeration
};

/// The tag for files whose names end like this, as `.mha`. An empty end stands for a folder.
std::string slicer_tag(const std::string& end);

/// A name with letters, digits and '_' only: every other character becomes '_'.
std::string slicer_name(const std::string& name);

/// The parameter of each of the pipeline's inputs, in their order. `pipeline` was read from its file without values of
/// inputs. The file is read again with other values, to see which options get them.
std::vector<SlicerParameter> slicer_inputs(const Pipeline& pipeline, const Catalogue& catalogue);

/// The description of a module in XML, which Slicer asks for by --xml.
std::string slicer_description(const Pipeline& pipeline, const std::vector<SlicerParameter>& inputs,
                               const std::vector<SlicerParameter>& outputs);

}  // namespace marrow::cli
