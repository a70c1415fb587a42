// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "marrow/toolbox/files/yaml_values.hpp"

namespace {

struct Options {
  std::filesystem::path path;
};

marrow::List<marrow::Seeds> seeds(const Options& options) { return marrow::files::read_seeds_file(options.path); }

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("read.seeds", seeds)
      .summary("Reads points inside each bone fragment from marrow's YAML")
      .out("seeds", "points per fragment in CT coordinates", marrow::over("fragment"))
      .option("path", &Options::path, "file with seeds", marrow::required());
}
