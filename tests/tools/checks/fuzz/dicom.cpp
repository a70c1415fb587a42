// SPDX-License-Identifier: Apache-2.0
// DICOM: an image, the geometry in its header, a slice among the others of a series, and segments.
#include "marrow/toolbox/files/label_file.hpp"
#include "marrow/toolbox/files/volume_file.hpp"
#include "marrow/toolbox/files/xray_header.hpp"
#include "target.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  marrow::fuzz::Input input(data, size);
  const char way = input.choice("ixfsl");
  const std::filesystem::path path = marrow::fuzz::put("series/a.dcm", input.rest);
  marrow::fuzz::expect_value_or_error([&] {
    if (way == 'i') marrow::files::read_image_file(path);
    if (way == 'f') marrow::files::read_image_file(path, 2);
    if (way == 'x') marrow::files::read_xray_geometry(path, 1, {});
    if (way == 'l') marrow::files::read_label_file(path);
    if (way == 's') marrow::files::read_volume_file(path.parent_path(), {});
  });
  return 0;
}
