// SPDX-License-Identifier: Apache-2.0
// A case and all smaller files of YAML or text: cameras, calibrations, boards, points, landmarks, seeds, poses,
// holes of implants.
#include "tests/harness/without_registration.hpp"  // before the nodes

#include "plugins/read/case.cpp"

#include "implant_node.hpp"
#include "landmarks_node.hpp"
#include "marrow/camera/points_file.hpp"
#include "marrow/read/calibration_file.hpp"
#include "marrow/toolbox/calibration/board.hpp"
#include "marrow/toolbox/files/camera_file.hpp"
#include "target.hpp"

namespace {

using marrow::fuzz::put;

/// Writes the files that a case.yaml may name: an image of 4 x 4, a CT of 2 x 2 x 2 and a camera.
void put_case_files() {
  static constexpr unsigned char kPng[] = {
      137, 'P', 'N', 'G', 13, 10, 26,  10,  0,   0,   0, 13, 'I', 'H', 'D', 'R', 0,   0,   0,   4,   0,  0,  0,
      4,   8,   0,   0,   0,  0,  140, 154, 193, 162, 0, 0,  0,   11,  'I', 'D', 'A', 'T', 120, 218, 99, 96, 192,
      4,   0,   0,   20,  0,  1,  238, 'Z', 105, 9,   0, 0,  0,   0,   'I', 'E', 'N', 'D', 174, 'B', 96, 130};
  put("case/a.png", {reinterpret_cast<const char*>(kPng), sizeof kPng});
  put("case/ct.mha",
      "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nDimSize = 2 2 2\n"
      "ElementType = MET_SHORT\nElementDataFile = LOCAL\n0123456789abcdef");
  put("case/a.txt",
      "image size\n4,4\n\ncamera "
      "matrix\n1000,0,2\n0,1000,2\n0,0,1\n\nrotation\n1,0,0\n0,1,0\n0,0,1\n\ntranslation\n0\n0\n900\n");
}

void read(char format, std::string_view text) {
  marrow::Context context;
  if (format == 'c') put("case/case.yaml", text), read_case({marrow::fuzz::folder() / "case", {}}, context);
  if (format == 'm') marrow::files::read_camera_file(put("a.yaml", text));
  if (format == 'x') marrow::files::read_camera_file(put("a.txt", text));
  if (format == 'k') marrow::read::read_calibration_file(put("a.yaml", text));
  if (format == 'b') marrow::calibration::read_board_file(put("a.yaml", text));
  if (format == 'p') marrow::files::read_points_file(put("a.yaml", text));
  if (format == 'l') marrow::fuzz::read_landmarks(put("a.yaml", text));
  if (format == 'h') marrow::fuzz::read_implant_holes(put("a.yaml", text));
  if (format == 's') marrow::files::read_seeds_file(put("a.yaml", text));
  if (format == 'o') marrow::files::read_pose_file(put("a.yaml", text));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const bool once = (put_case_files(), true);
  (void)once;
  marrow::fuzz::Input input(data, size);
  const char format = input.choice("cmxkbplsoh");
  marrow::fuzz::expect_value_or_error([&] { read(format, input.rest); });
  return 0;
}
