// SPDX-License-Identifier: Apache-2.0
// Formats of other programs: points, transforms, surfaces, cameras and trials. HDF5 and VTK read .h5 and .vtp
// themselves, and reserve as much memory as a damaged file asks for. The limits of the nodes' own process stop them, so
// these two formats are not tried here.
#include "marrow/read/projections.hpp"
#include "marrow/toolbox/exchange/autoscoper_trial.hpp"
#include "marrow/toolbox/exchange/itk_transform.hpp"
#include "marrow/toolbox/exchange/marked_values.hpp"
#include "marrow/toolbox/exchange/maya_camera.hpp"
#include "marrow/toolbox/exchange/plastimatch_camera.hpp"
#include "marrow/toolbox/exchange/surface_file.hpp"
#include "target.hpp"

namespace {

using namespace marrow::exchange;
using marrow::fuzz::put;

void read(char format, std::string_view text) {
  const ImageSize size{{64, 48}, {0.5}, {}};
  if (format == 'j') read_marked_landmarks(put("a.mrk.json", text));
  if (format == 'f') read_marked_seeds(put("a.fcsv", text), "");
  if (format == 't') read_itk_transform(put("a.tfm", text), "world", "ct");
  if (format == 'o') read_surface_file(put("a.obj", text), 1, marrow::Context());
  if (format == 'p') read_plastimatch_camera(put("a.txt", text), size);
  if (format == 'm') read_maya_camera(put("a.csv", text));
  if (format == 'a') volume_of_bone(read_autoscoper_trial(put("a.cfg", text)), "rad", "a.cfg");
  if (format == 'r') marrow::read::read_projections(put("a.xml", text), {}, size, Mirror::upside_down, 1);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  marrow::fuzz::Input input(data, size);
  const char format = input.choice("jftoprma");
  marrow::fuzz::expect_value_or_error([&] { read(format, input.rest); });
  return 0;
}
