// SPDX-License-Identifier: Apache-2.0
#include "marrow/run/program_call.hpp"
#include "marrow/toolbox/exchange/surface_file.hpp"

namespace {

using namespace marrow;

Mesh program(const Volume* volume, const Volume* second_volume, const SignedField* field, const Mesh* mesh,
             const Image* image, const Metrics* metrics, const run::ProgramOptions& options, Context& context) {
  Mesh made;
  run::with_output({volume, second_volume, field, mesh, image, metrics}, options, {"stl", "ply", "obj", "vtp"}, context,
                   [&](const std::filesystem::path& file) { made = exchange::read_surface_file(file, 1, context); });
  return made;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  auto&& node = plugin.node("run.program_mesh", program);
  run::with_program(node.summary("Runs a program that makes a surface"))
      .out("mesh",
           "the surface in {output.FORMAT}, in mm: stl, ply, obj or vtp; where it says SPACE=RAS, it becomes LPS");
}
