// SPDX-License-Identifier: Apache-2.0
#include "marrow/run/metrics_file.hpp"
#include "marrow/run/program_call.hpp"

namespace {

using namespace marrow;

Metrics program(const Volume* volume, const Volume* second_volume, const SignedField* field, const Mesh* mesh,
                const Image* image, const Metrics* metrics, const run::ProgramOptions& options, Context& context) {
  Metrics made;
  run::with_output({volume, second_volume, field, mesh, image, metrics}, options, {"json"}, context,
                   [&](const std::filesystem::path& file) { made = run::read_metrics(file); });
  return made;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  auto&& node = plugin.node("run.program_metrics", program);
  run::with_program(node.summary("Runs a program that makes figures"))
      .out("metrics",
           "the figures in {output.json}: {\"name\": 1.5}, or with units {\"name\": {\"value\": 1.5, \"unit\": "
           "\"mm\"}}");
}
