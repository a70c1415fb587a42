// SPDX-License-Identifier: Apache-2.0
#include "plugins/write/picture.cpp"

#include <gtest/gtest.h>

#include "marrow/toolbox/files/volume_file.hpp"
#include "write/full_disk.hpp"

namespace {

using marrow::test::TemporaryFolder;

cv::Mat noise(int type, double top) {
  cv::Mat pixels(40, 60, type);
  cv::randu(pixels, 0, top);
  return pixels;
}

TEST(WritePicture, KeepsTheBitsOfAnImage) {
  const TemporaryFolder folder;
  for (const cv::Mat& pixels : {noise(CV_8U, 255), noise(CV_16U, 65535)}) {
    image({pixels}, (folder / "a.png").string());
    const cv::Mat read = marrow::files::read_image_file(folder / "a.png").pixels;
    EXPECT_EQ(marrow::hash_of(marrow::Image{read}), marrow::hash_of(marrow::Image{pixels}));
  }
  // A part of a larger image has gaps between its rows.
  const cv::Mat part = noise(CV_16U, 65535)(cv::Rect(3, 4, 20, 10));
  image({part}, (folder / "part.png").string());
  EXPECT_EQ(cv::countNonZero(marrow::files::read_image_file(folder / "part.png").pixels != part), 0);
}

TEST(WritePicture, ScalesFloatFromLeastToGreatest) {
  const TemporaryFolder folder;
  image({(cv::Mat_<float>(1, 3) << -2, 0, 2)}, (folder / "a.png").string());
  const cv::Mat read = marrow::files::read_image_file(folder / "a.png").pixels;
  EXPECT_EQ(read.at<std::uint16_t>(0, 0), 0);
  EXPECT_NEAR(read.at<std::uint16_t>(0, 1), 32768, 1);
  EXPECT_EQ(read.at<std::uint16_t>(0, 2), 65535);
  image({cv::Mat(2, 2, CV_32F, cv::Scalar(7))}, (folder / "flat.png").string());
  EXPECT_EQ(marrow::files::read_image_file(folder / "flat.png").pixels.at<std::uint16_t>(1, 1), 0);
}

TEST(WritePicture, EdgesAreWhiteOnBlack) {
  const TemporaryFolder folder;
  edge_map({6, 4, {{2.4f, 1.6f, 1, 0, 50}, {-3, 0, 1, 0, 50}, {5.4f, 3.4f, 0, 1, 9}}}, (folder / "edges.png").string());
  const cv::Mat read = marrow::files::read_image_file(folder / "edges.png").pixels;
  EXPECT_EQ(cv::countNonZero(read), 2);
  EXPECT_EQ(read.at<std::uint8_t>(2, 2), 255);
  EXPECT_EQ(read.at<std::uint8_t>(3, 5), 255);
}

TEST(WritePicture, ColoursAndFaults) {
  const TemporaryFolder folder;
  picture({noise(CV_8UC3, 255)}, (folder / "p.png").string());
  EXPECT_SAYS(marrow::files::read_image_file(folder / "p.png"), "has 3 channels");
  EXPECT_SAYS((picture({}, (folder / "q.png").string()), 0), "q.png: the image is empty, there is nothing to write");
  EXPECT_FALSE(std::filesystem::exists(folder / "q.png"));
}

TEST(WritePicture, FloatTiffIsWholeOrAnError) {
  const TemporaryFolder folder;
  const cv::Mat pixels = noise(CV_32F, 1);
  marrow::files::write_pixels(folder / "whole.tif", pixels);
  EXPECT_EQ(cv::countNonZero(marrow::files::read_image_file(folder / "whole.tif").pixels != pixels), 0);
  const auto size = std::filesystem::file_size(folder / "whole.tif");
  for (const std::uintmax_t bytes : {std::uintmax_t(0), size / 2, size - 100, size - 1}) {
    const marrow::test::FullDisk full(bytes);
    EXPECT_SAYS((marrow::files::write_pixels(folder / "half.tif", pixels), 0), "half.tif: cannot be written");
  }
}

TEST(WritePicture, FullDisk) {
  const TemporaryFolder folder;
  for (const rlim_t bytes : {0, 60, 4000})
    marrow::test::expect_full_disk_is_diagnosed(folder, "a.png", bytes,
                                                [](const std::string& path) { image({noise(CV_16U, 65535)}, path); });
}

}  // namespace
