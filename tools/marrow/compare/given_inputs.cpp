// SPDX-License-Identifier: Apache-2.0
// Inputs on the command line of `marrow compare`. They become an experiment file of their own, which extends the given
// one. So the cells, a cluster's tasks and the next command all read the same experiment.
#include <yaml-cpp/yaml.h>

#include "commands.hpp"
#include "compare/comparison.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/base/text_file.hpp"

namespace marrow::cli {

namespace fs = std::filesystem;

fs::path experiment_with_inputs(const CompareRequest& request) {
  if (request.inputs.empty()) return request.file;
  std::error_code failure;
  if (!fs::is_regular_file(request.file, failure))
    throw Error(printable(request.file.string()) + ": there is no such experiment");
  YAML::Emitter text;
  text.SetSeqFormat(YAML::Flow);
  text << YAML::Comment("The experiment that it extends, with inputs of a command line.") << YAML::BeginMap;
  text << YAML::Key << "experiment" << YAML::Value << 1;
  text << YAML::Key << "extends" << YAML::Value << fs::canonical(request.file).string();
  text << YAML::Key << "inputs" << YAML::Value << YAML::BeginMap;
  for (const auto& [name, value] : pairs_of(request.inputs, "name=value")) {
    // A path of the command line starts here, one of an experiment at the folder of its file.
    const bool is_here = !value.empty() && fs::exists(value, failure);
    text << YAML::Key << name << YAML::Value << (is_here ? fs::absolute(value).lexically_normal().string() : value);
  }
  text << YAML::EndMap << YAML::EndMap;
  const std::string whole = std::string(text.c_str()) + "\n";
  const fs::path file = fs::path("runs") / "compare" / (request.file.stem().string() + ".yaml");
  if (fs::exists(file, failure)) {
    if (read_text_file(file, kMostSourceBytes) == whole) return file;
    throw Error(
        printable(file.string()) +
        ": holds this experiment with other inputs; go on with that file, or remove it and its folder of results");
  }
  fs::create_directories(file.parent_path(), failure);
  write_text_file(file, whole);
  if (!request.quiet) say_note("the experiment with these inputs is " + printable(file.string()));
  return file;
}

}  // namespace marrow::cli
