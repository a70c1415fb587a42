// SPDX-License-Identifier: Apache-2.0
// Surfaces, volumes and pictures are read back as they were written; on a full disk the old file stays.
#include <opencv2/core.hpp>

#include "marrow/toolbox/files/mesh_file.hpp"
#include "marrow/toolbox/files/volume_file.hpp"
#include "marrow/write/picture_out.hpp"
#include "tests/plugins/write/full_disk.hpp"
#include "tests/plugins/write/writing.hpp"

namespace values_test {

using namespace marrow;
using namespace marrow::test;
using writing::write;

using WriteMesh = InAFolder;
using WriteVolume = InAFolder;

Mesh surface() {
  return {{{0, 0, 0}, {1.0 / 3, 0, 0}, {0, 1e-9, 0}, {0, 0, 12345.678}},
          {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}},
          "ct"};
}

Volume volume(int size) {
  Volume value;
  value.grid.size = {size, size, size};
  value.grid.origin_mm = {1, 2, 3};
  for (int i = 0; i < size * size * size; ++i) value.values.push_back(float((i * 7919) % 4001) * 0.37f - 1000);
  return value;
}

cv::Mat noise(int type, double top) {
  cv::Mat pixels(40, 60, type);
  cv::randu(pixels, 0, top);
  return pixels;
}

TEST_F(WriteMesh, ReadsBackTheSameToTheLastBit) {
  write(surface(), folder / "m.ply");
  EXPECT_EQ(hash_of(files::read_mesh_file(folder / "m.ply", 1)), hash_of(surface()));
  Mesh odd = surface();
  odd.frame = "ct\nelement vertex 1000000\r\x1b[2J";
  write(odd, folder / "m.ply");
  EXPECT_EQ(files::read_mesh_file(folder / "m.ply", 1).vertices_mm.size(), 4u) << "the frame adds nothing";
}

TEST_F(WriteVolume, ReadsBackTheSame) {
  const Volume written = volume(9);
  write(written, folder / "ct.mha");
  EXPECT_EQ(hash_of(files::read_volume_file(folder / "ct.mha", {})), hash_of(written));
  write(SignedField{written.grid, written.values}, folder / "field.mha");
  EXPECT_EQ(files::read_volume_file(folder / "field.mha", {}).values, written.values);
  EXPECT_SAYS(write(Volume(), folder / "empty.mha"), "the volume is empty");
  EXPECT_FALSE(std::filesystem::exists(folder / "empty.mha"));
}

class WritePicture : public InAFolder {
 protected:
  template <class T>
  cv::Mat written(const T& value) {
    write(value, folder / "a.png");
    return files::read_image_file(folder / "a.png").pixels;
  }
};

TEST_F(WritePicture, KeepsTheBitsOfAnImage) {
  for (const cv::Mat& pixels : {noise(CV_8U, 255), noise(CV_16U, 65535)})
    EXPECT_EQ(hash_of(Image{written(Image{pixels})}), hash_of(Image{pixels}));
  // A part of a larger image has gaps between its rows.
  const cv::Mat part = noise(CV_16U, 65535)(cv::Rect(3, 4, 20, 10));
  EXPECT_EQ(cv::countNonZero(written(Image{part}) != part), 0);
}

TEST_F(WritePicture, ScalesFloatFromLeastToGreatest) {
  const cv::Mat read = written(Image{(cv::Mat_<float>(1, 3) << -2, 0, 2)});
  EXPECT_EQ(read.at<std::uint16_t>(0, 0), 0);
  EXPECT_NEAR(read.at<std::uint16_t>(0, 1), 32768, 1);
  EXPECT_EQ(read.at<std::uint16_t>(0, 2), 65535);
  EXPECT_EQ(written(Image{cv::Mat(2, 2, CV_32F, cv::Scalar(7))}).at<std::uint16_t>(1, 1), 0);
}

TEST_F(WritePicture, EdgesAreWhiteOnBlack) {
  const cv::Mat read = written(EdgeMap{6, 4, {{2.4f, 1.6f, 1, 0, 50}, {-3, 0, 1, 0, 50}, {5.4f, 3.4f, 0, 1, 9}}});
  EXPECT_EQ(cv::countNonZero(read), 2);
  EXPECT_EQ(read.at<std::uint8_t>(2, 2), 255);
  EXPECT_EQ(read.at<std::uint8_t>(3, 5), 255);
}

TEST_F(WritePicture, ColoursAndFaults) {
  EXPECT_SAYS(written(Picture{noise(CV_8UC3, 255)}), "has colours: the pixel at column 1 of row 1 has red");
  EXPECT_SAYS(write(Picture(), folder / "q.png"), "q.png: the image is empty, there is nothing to write");
  EXPECT_FALSE(std::filesystem::exists(folder / "q.png"));
}

TEST_F(WritePicture, FloatTiffIsWholeOrAnError) {
  const cv::Mat pixels = noise(CV_32F, 1);
  marrow::write::write_pixels(folder / "whole.tif", pixels);
  EXPECT_EQ(cv::countNonZero(files::read_image_file(folder / "whole.tif").pixels != pixels), 0);
  const auto size = std::filesystem::file_size(folder / "whole.tif");
  for (const std::uintmax_t bytes : {std::uintmax_t(0), size / 2, size - 100, size - 1}) {
    const FullDisk full(bytes);
    EXPECT_SAYS((marrow::write::write_pixels(folder / "half.tif", pixels), 0), "half.tif: cannot be written");
  }
}

template <class T>
void expect_full_disk_is_diagnosed(const std::string& name, const std::vector<rlim_t>& limits, const T& value) {
  const TemporaryFolder folder;
  for (const rlim_t bytes : limits)
    test::expect_full_disk_is_diagnosed(folder, name, bytes, [&](const std::string& path) { write(value, path); });
}

TEST(WriteValues, OnAFullDiskKeepTheOldFile) {
  expect_full_disk_is_diagnosed("m.ply", {0, 100, 300}, surface());
  expect_full_disk_is_diagnosed("ct.mha", {0, 100, 5000}, volume(20));
  expect_full_disk_is_diagnosed("a.png", {0, 60, 4000}, Image{noise(CV_16U, 65535)});
  Pose pose;
  pose.warnings = {std::string(100, 'x')};
  expect_full_disk_is_diagnosed("p.yaml", {0, 200}, pose);
}

}  // namespace values_test
