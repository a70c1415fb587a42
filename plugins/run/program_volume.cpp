// SPDX-License-Identifier: Apache-2.0
#include "marrow/run/program_call.hpp"
#include "marrow/run/volume_out.hpp"
#include "marrow/toolbox/files/volume_file.hpp"

namespace {

using namespace marrow;

Volume program(const Volume* volume, const Volume* second_volume, const SignedField* field, const Mesh* mesh,
               const Image* image, const Metrics* metrics, const run::ProgramOptions& options, Context& context) {
  Volume made;
  run::with_output({volume, second_volume, field, mesh, image, metrics}, options, run::formats_of_volumes(), context,
                   [&](const std::filesystem::path& file) { made = files::read_volume_file(file, {}); });
  return made;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  auto&& node = plugin.node("run.program_volume", program);
  run::with_program(node.summary("Runs a program that makes a volume"))
      .out("volume", "the volume in {output.FORMAT}: mha, nrrd, nii or nii.gz; patient axes are LPS");
}
