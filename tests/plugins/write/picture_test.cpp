// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "marrow/toolbox/files/volume_file.hpp"
#include "marrow/write/picture_out.hpp"
#include "tests/plugins/write/full_disk.hpp"
#include "tests/plugins/write/writing.hpp"

namespace picture_test {

using marrow::test::TemporaryFolder;
using writing::write;

cv::Mat noise(int type, double top) {
  cv::Mat pixels(40, 60, type);
  cv::randu(pixels, 0, top);
  return pixels;
}

TEST(WritePicture, KeepsTheBitsOfAnImage) {
  const TemporaryFolder folder;
  for (const cv::Mat& pixels : {noise(CV_8U, 255), noise(CV_16U, 65535)}) {
    write(marrow::Image{pixels}, folder / "a.png");
    const cv::Mat read = marrow::files::read_image_file(folder / "a.png").pixels;
    EXPECT_EQ(marrow::hash_of(marrow::Image{read}), marrow::hash_of(marrow::Image{pixels}));
  }
  // A part of a larger image has gaps between its rows.
  const cv::Mat part = noise(CV_16U, 65535)(cv::Rect(3, 4, 20, 10));
  write(marrow::Image{part}, folder / "part.png");
  EXPECT_EQ(cv::countNonZero(marrow::files::read_image_file(folder / "part.png").pixels != part), 0);
}

TEST(WritePicture, ScalesFloatFromLeastToGreatest) {
  const TemporaryFolder folder;
  write(marrow::Image{(cv::Mat_<float>(1, 3) << -2, 0, 2)}, folder / "a.png");
  const cv::Mat read = marrow::files::read_image_file(folder / "a.png").pixels;
  EXPECT_EQ(read.at<std::uint16_t>(0, 0), 0);
  EXPECT_NEAR(read.at<std::uint16_t>(0, 1), 32768, 1);
  EXPECT_EQ(read.at<std::uint16_t>(0, 2), 65535);
  write(marrow::Image{cv::Mat(2, 2, CV_32F, cv::Scalar(7))}, folder / "flat.png");
  EXPECT_EQ(marrow::files::read_image_file(folder / "flat.png").pixels.at<std::uint16_t>(1, 1), 0);
}

TEST(WritePicture, EdgesAreWhiteOnBlack) {
  const TemporaryFolder folder;
  write(marrow::EdgeMap{6, 4, {{2.4f, 1.6f, 1, 0, 50}, {-3, 0, 1, 0, 50}, {5.4f, 3.4f, 0, 1, 9}}},
        folder / "edges.png");
  const cv::Mat read = marrow::files::read_image_file(folder / "edges.png").pixels;
  EXPECT_EQ(cv::countNonZero(read), 2);
  EXPECT_EQ(read.at<std::uint8_t>(2, 2), 255);
  EXPECT_EQ(read.at<std::uint8_t>(3, 5), 255);
}

TEST(WritePicture, ColoursAndFaults) {
  const TemporaryFolder folder;
  write(marrow::Picture{noise(CV_8UC3, 255)}, folder / "p.png");
  EXPECT_SAYS(marrow::files::read_image_file(folder / "p.png"), "has colours: the pixel at column 1 of row 1 has red");
  EXPECT_SAYS(write(marrow::Picture(), folder / "q.png"), "q.png: the image is empty, there is nothing to write");
  EXPECT_FALSE(std::filesystem::exists(folder / "q.png"));
}

TEST(WritePicture, FloatTiffIsWholeOrAnError) {
  const TemporaryFolder folder;
  const cv::Mat pixels = noise(CV_32F, 1);
  marrow::write::write_pixels(folder / "whole.tif", pixels);
  EXPECT_EQ(cv::countNonZero(marrow::files::read_image_file(folder / "whole.tif").pixels != pixels), 0);
  const auto size = std::filesystem::file_size(folder / "whole.tif");
  for (const std::uintmax_t bytes : {std::uintmax_t(0), size / 2, size - 100, size - 1}) {
    const marrow::test::FullDisk full(bytes);
    EXPECT_SAYS((marrow::write::write_pixels(folder / "half.tif", pixels), 0), "half.tif: cannot be written");
  }
}

TEST(WritePicture, FullDisk) {
  const TemporaryFolder folder;
  for (const rlim_t bytes : {0, 60, 4000})
    marrow::test::expect_full_disk_is_diagnosed(
        folder, "a.png", bytes, [](const std::string& path) { write(marrow::Image{noise(CV_16U, 65535)}, path); });
}

}  // namespace picture_test
