// SPDX-License-Identifier: Apache-2.0
// Damaged images, in the formats of cameras and of X-ray systems.
#include <gtest/gtest.h>

#include "marrow/toolbox/files/volume_file.hpp"
#include "marrow/toolbox/files/xray_header.hpp"
#include "tests/plugins/read/damaged.hpp"
#include "tests/plugins/read/dicom_text.hpp"

namespace damaged_images_test {

using namespace damaged;
using namespace marrow::test;
using Path = std::filesystem::path;

void image_at(const Path& path) { marrow::files::read_image_file(path); }

TEST(Damaged, Png) {
  const TemporaryFolder folder;
  expect_handled(folder, written(folder, "a.png", picture(), true, 60), image_at);
}

TEST(Damaged, Tiff) {
  const TemporaryFolder folder;
  for (const bool compressed : {false, true}) {
    Sample sample = written(folder, compressed ? "packed.tif" : "a.tif", picture(), compressed, 0);
    // ITK writes the directory behind the pixels, so the whole file counts as the header whose bytes are flipped.
    sample.header_bytes = sample.bytes.size();
    const std::string width = std::string("\0\1\3\0\1\0\0\0\x3C\0", 10);  // ImageWidth, SHORT, 1, 60
    if (sample.bytes.find(width) != std::string::npos)
      sample.lies.push_back({width, std::string("\0\1\4\0\1\0\0\0\x60\xEA\0\0", 12).substr(0, 10)});
    expect_handled(folder, sample, image_at);
  }
}

std::string fluoroscopy_file(int width, int height) {
  Elements elements = fluoroscopy();
  elements[0x00280010] = "US:" + std::to_string(height);
  elements[0x00280011] = "US:" + std::to_string(width);
  elements[0x7FE00010] = "OW:" + std::string(std::size_t(width * height * 2), 'x');
  return dicom_file(elements);
}

TEST(Damaged, DicomImage) {
  const TemporaryFolder folder;
  Sample sample{"a.dcm", fluoroscopy_file(48, 32), 0, {}, false};
  sample.header_bytes = sample.bytes.size() - 48 * 32 * 2;
  const std::string rows = dicom_element(0x00280010, "US", little(32, 2));
  const std::string pixels = little(48 * 32 * 2, 4);
  sample.lies = {{rows, dicom_element(0x00280010, "US", little(60000, 2))},
                 {pixels, little(0xFFFFFFF0u, 4)},
                 {pixels, little(48 * 32 * 2 + 2, 4)},
                 {dicom_element(0x00280100, "US", little(16, 2)), dicom_element(0x00280100, "US", little(64, 2))},
                 {dicom_element(0x00280002, "US", little(1, 2)), dicom_element(0x00280002, "US", little(30000, 2))},
                 {dicom_element(0x00280010, "US", little(32, 2)), dicom_element(0x00280008, "IS", "999999999 ") + rows},
                 {rows, dicom_element(0x00280010, "US", little(0, 2))},
                 {"CS" + little(2, 2) + "XA", "CS" + little(0xFFFE, 2) + "XA"}};
  expect_handled(folder, sample, image_at);
  // The camera needs only the header, so a file with damaged pixels may be accepted.
  expect_handled(folder, sample, [](const Path& path) { marrow::files::read_xray_geometry(path, 1, {}); });
}

}  // namespace damaged_images_test
