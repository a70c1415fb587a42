// SPDX-License-Identifier: Apache-2.0
#include "marrow/run/labelled_field.hpp"
#include "marrow/run/program_node.hpp"
#include "marrow/run/volume_out.hpp"
#include "marrow/toolbox/files/volume_file.hpp"

namespace {

using namespace marrow;

struct Options : run::ProgramOptions {
  std::vector<double> labels;
  double band_mm = 4;
};

SignedField program(const Volume* volume, const Volume* second_volume, const SignedField* field, const Mesh* mesh,
                    const Image* image, const Metrics* metrics, const Options& options, Context& context) {
  Volume labelled;
  run::with_output({volume, second_volume, field, mesh, image, metrics}, options, run::formats_of_volumes(), context,
                   [&](const std::filesystem::path& file) { labelled = files::read_volume_file(file, {}); });
  return run::field_of_labels(labelled, options.labels, options.band_mm);
}

}  // namespace

MARROW_PLUGIN(plugin) {
  auto&& node = plugin.node("run.program_field", program);
  run::with_program(node.summary("Runs a program that segments: a mask or labels become the field of one bone"))
      .out("field", "signed distance to the surface of what the volume in {output.FORMAT} marks, midway between voxels")
      .option("labels", &Options::labels, "the labels that are this bone; none: all voxels that are not 0")
      .option("band_mm", &Options::band_mm, "distances are right up to this one", at_least(0.1));
}
