// SPDX-License-Identifier: Apache-2.0
// Surfaces: STL and PLY, as text and as bytes.
#include "marrow/toolbox/files/mesh_file.hpp"
#include "target.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  marrow::fuzz::Input input(data, size);
  const char format = input.choice("sp");
  const std::filesystem::path path = marrow::fuzz::put(format == 's' ? "a.stl" : "a.ply", input.rest);
  marrow::fuzz::expect_value_or_error([&] { marrow::files::read_mesh_file(path, 1); });
  return 0;
}
