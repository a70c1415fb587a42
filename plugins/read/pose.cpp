// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "marrow/toolbox/files/yaml_values.hpp"

namespace {

struct Options {
  std::filesystem::path path;
};

marrow::Pose pose(const Options& options) { return marrow::files::read_pose_file(options.path); }

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("read.pose", pose)
      .summary("Pose from marrow's YAML, such as a start that was found by hand or the result of another run")
      .out("pose", "where the model lies in the world")
      .option("path", &Options::path, "pose file", marrow::required());
}
