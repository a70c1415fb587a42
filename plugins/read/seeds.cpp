// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "marrow/toolbox/exchange/markups.hpp"
#include "marrow/toolbox/files/yaml_values.hpp"

namespace {

struct Options {
  std::filesystem::path path;
  std::string fragment;
};

marrow::List<marrow::Seeds> seeds(const Options& options) {
  if (marrow::exchange::is_markups_file(options.path))
    return marrow::exchange::read_marked_seeds(options.path, options.fragment);
  if (!options.fragment.empty())
    throw marrow::Error(options.path.string() +
                        ": names its fragments itself; fragment is only for files of 3D Slicer, so leave it out");
  return marrow::files::read_seeds_file(options.path);
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("read.seeds", seeds)
      .summary("Reads points inside each bone fragment from marrow's YAML or from 3D Slicer's points")
      .out("seeds", "points per fragment in CT coordinates", marrow::over("fragment"))
      .option("path", &Options::path, "file with seeds; .mrk.json or .fcsv: 3D Slicer's, any other: marrow's YAML",
              marrow::required())
      .option(
          "fragment", &Options::fragment,
          "only for 3D Slicer's files: the fragment of all points; if empty, each point's label names it, without a "
          "number at its end");
}
