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
      .summary(
          "Reads a pose from marrow's YAML, for example a start that was found by hand, or the result of another run")
      .out("pose", "pose of the model in the world")
      .option("path", &Options::path, "pose file", marrow::required());
}
