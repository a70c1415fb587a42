// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <set>
#include <vector>
#include "marrow/run/program_call.hpp"
#include "marrow/run/volume_out.hpp"
#include "marrow/toolbox/field/interior.hpp"
#include "marrow/toolbox/files/volume_file.hpp"

namespace {

using namespace marrow;
using namespace run;

std::string labels_in(const Volume& labelled) {
  constexpr std::size_t kShown = 20;
  std::set<float> found;
  for (const float value : labelled.values)
    if (value != 0 && found.size() <= kShown) found.insert(value);
  std::string text;
  for (const float value : found) text += (text.empty() ? "" : ", ") + short_number(value, 6);
  return text.empty() ? "all voxels are 0" : "there are " + text + (found.size() > kShown ? " and more" : "");
}

/// The signed distance in mm, up to `band_mm`, to the surface of the voxels with one of these labels; without labels,
/// of all that are not 0. The surface lies midway between a voxel inside and one outside. Throws Error if no voxel is
/// inside, and names the labels that there are.
SignedField field_of_labels(const Volume& labelled, const std::vector<double>& labels, double band_mm) {
  const Grid& grid = labelled.grid;
  const auto is_inside = [&](std::size_t at) {
    const double value = labelled.values[at];
    return labels.empty() ? value != 0 : std::find(labels.begin(), labels.end(), value) != labels.end();
  };
  std::vector<bool> inside(labelled.values.size());
  for (std::size_t at = 0; at < inside.size(); ++at) inside[at] = is_inside(at);
  if (std::find(inside.begin(), inside.end(), true) == inside.end())
    throw Error("the labels that the program made have no voxel " +
                (labels.empty() ? std::string("inside") : "of these labels") + ": " + labels_in(labelled));
  SignedField field{grid, std::vector<float>(inside.size())};
  const std::size_t steps[] = {1, std::size_t(grid.size[0]), std::size_t(grid.size[0]) * std::size_t(grid.size[1])};
  for (int z = 0; z < grid.size[2]; ++z)
    for (int y = 0; y < grid.size[1]; ++y)
      for (int x = 0; x < grid.size[0]; ++x) {
        const std::size_t at = grid.offset(x, y, z);
        const int index[] = {x, y, z};
        double distance_mm = band_mm;
        for (std::size_t k = 0; k < 3; ++k) {
          const bool differs = (index[k] > 0 && inside[at - steps[k]] != inside[at]) ||
                               (index[k] + 1 < grid.size[k] && inside[at + steps[k]] != inside[at]);
          if (differs) distance_mm = std::min(distance_mm, 0.5 * grid.spacing_mm[Eigen::Index(k)]);
        }
        field.values_mm[at] = float(inside[at] ? -distance_mm : distance_mm);
      }
  field::march_distances(grid, field.values_mm, band_mm);
  return field;
}

struct Options : ProgramOptions {
  std::vector<double> labels;
  double band_mm = 4;
};

SignedField program(const Volume* volume, const Volume* second_volume, const SignedField* field, const Mesh* mesh,
                    const Image* image, const Metrics* metrics, const Options& options, Context& context) {
  Volume labelled;
  with_output({volume, second_volume, field, mesh, image, metrics}, options, formats_of_volumes(), context,
              [&](const std::filesystem::path& file) { labelled = files::read_volume_file(file, {}); });
  return field_of_labels(labelled, options.labels, options.band_mm);
}

}  // namespace

MARROW_PLUGIN(plugin) {
  auto&& node = plugin.node("run.program_field", program);
  with_program(node.summary("Runs a program that segments: a mask or labels become the field of one bone"))
      .out("field", "signed distance to the surface of what the volume in {output.FORMAT} marks, midway between voxels")
      .option("labels", &Options::labels, "the labels that are this bone; none: all voxels that are not 0")
      .option("band_mm", &Options::band_mm, "distances are right up to this one", at_least(0.1));
}
