// SPDX-License-Identifier: Apache-2.0
#include "marrow/run/program_call.hpp"
#include "marrow/toolbox/files/volume_file.hpp"

namespace {

using namespace marrow;

Image program(const Volume* volume, const Volume* second_volume, const SignedField* field, const Mesh* mesh,
              const Image* image, const Metrics* metrics, const run::ProgramOptions& options, Context& context) {
  Image made;
  run::with_output({volume, second_volume, field, mesh, image, metrics}, options, {"png", "tif"}, context,
                   [&](const std::filesystem::path& file) { made = files::read_image_file(file); });
  return made;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  auto&& node = plugin.node("run.program_image", program);
  run::with_program(node.summary("Runs a program that makes a grey image"))
      .out("image", "the image in {output.FORMAT}: png or tif");
}
