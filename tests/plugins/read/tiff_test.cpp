// SPDX-License-Identifier: Apache-2.0
// What the description of a TIFF tells about its values and its pages.
#include <gtest/gtest.h>

#include "marrow/domain/image.hpp"
#include "marrow/toolbox/files/volume_file.hpp"
#include "tests/plugins/read/files.hpp"
#include "tests/plugins/read/hostile.hpp"

namespace tiff_test {

using namespace marrow::test;

struct Page {
  std::string description;  ///< none where empty
  int format = 1, photometric = 1;
};

/// Pages of 2 x 1 pixels of 16 bits; page k holds 1000 (k + 1) and 1001 (k + 1).
std::string tiff(const std::vector<Page>& pages) {
  std::string bytes = "II" + number<std::uint16_t>(42) + number<std::uint32_t>(8);
  for (std::size_t k = 0; k < pages.size(); ++k) {
    const std::uint32_t entries = pages[k].description.empty() ? 9 : 10,
                        data = std::uint32_t(bytes.size()) + 2 + 12 * entries + 4;
    const std::string samples = number(std::uint16_t(1000 * (k + 1))) + number(std::uint16_t(1001 * (k + 1)));
    bytes += number(std::uint16_t(entries)) + tiff_entry(256, 4, 1, 2) + tiff_entry(257, 4, 1, 1) +
             tiff_entry(258, 4, 1, 16) + tiff_entry(259, 4, 1, 1) +
             tiff_entry(262, 4, 1, std::uint32_t(pages[k].photometric));
    if (entries == 10) bytes += tiff_entry(270, 2, std::uint32_t(pages[k].description.size()), data + 4);
    bytes += tiff_entry(273, 4, 1, data) + tiff_entry(278, 4, 1, 1) + tiff_entry(279, 4, 1, 4) +
             tiff_entry(339, 3, 1, std::uint32_t(pages[k].format));
    const std::uint32_t next = data + 4 + std::uint32_t(pages[k].description.size());
    bytes += number(k + 1 == pages.size() ? 0u : next) + samples + pages[k].description;
  }
  return bytes;
}

std::vector<Page> pages_of(std::size_t count, const std::string& description_of_first) {
  std::vector<Page> pages(count);
  pages[0].description = description_of_first;
  return pages;
}

std::string ome(const std::string& sizes, const std::string& data = "<TiffData/>") {
  return "<?xml version=\"1.0\"?><OME xmlns=\"http://www.openmicroscopy.org/Schemas/OME/2016-06\"><Image "
         "ID=\"Image:0\"><Pixels " +
         sizes + ">" + data + "</Pixels></Image></OME>";
}

class Tiff : public testing::Test {
 protected:
  marrow::Volume volume(const std::vector<Page>& pages) {
    put(folder / "a.tif", tiff(pages));
    marrow::files::VolumeReading reading;
    reading.voxel_size_mm = {1, 1, 1};
    return marrow::files::read_volume_file(folder / "a.tif", reading);
  }
  marrow::Image image(const std::vector<Page>& pages, int frame = 0) {
    put(folder / "a.tif", tiff(pages));
    return marrow::files::read_image_file(folder / "a.tif", frame);
  }
  void expect_no_volume(const std::vector<Page>& pages, const std::string& text) {
    EXPECT_REFUSED(volume(pages), "a.tif", text);
  }
  TemporaryFolder folder;
};

// ImageJ keeps a CT, whose numbers have a sign, so.
TEST_F(Tiff, ImageJsCalibrationIsApplied) {
  const std::string ct = "ImageJ=1.53t\nimages=2\nslices=2\ncf=0\nc0=-32768.0\nc1=1.0\nvunit=gray value\n";
  EXPECT_EQ(volume(pages_of(2, ct)).values, (std::vector<float>{-31768, -31767, -30768, -30766}));
  EXPECT_EQ(volume(pages_of(2, "ImageJ=1.53t\nimages=2\ncf=0\nc0=0\nc1=1\n")).values[0], 1000);
  const cv::Mat second = image(pages_of(2, "ImageJ=1.53t\r\nimages=2\r\ncf=0\r\nc0=100\r\nc1=-0.5\r\n"), 2).pixels;
  ASSERT_EQ(second.type(), CV_32F);
  EXPECT_EQ(second.at<float>(0, 0), -900);
  EXPECT_EQ(second.at<float>(0, 1), -901);
}

TEST_F(Tiff, OtherCalibrationsOfImageJAreRefused) {
  const std::string start = "ImageJ=1.53t\nimages=2\nslices=2\n", line = start + "cf=0\nc0=1\nc1=2\n";
  for (const char* function : {"1", "20", "21", "x"})
    expect_no_volume(pages_of(2, start + "cf=" + function + "\nc0=1\nc1=2\n"),
                     std::string("ImageJ's function ") + function);
  expect_no_volume(pages_of(2, start + "c0=1\nc1=2\n"), "ImageJ's function (none)");
  for (const char* numbers : {"c0=nan\nc1=1\n", "c0=1\n", "c0=1\nc1=0\n", "c0=1\nc1=inf\n", "c0=1e\nc1=1\n"})
    expect_no_volume(pages_of(2, start + "cf=0\n" + numbers), "two numbers expected, the second not 0");
  expect_no_volume({{line, 2}, {"", 2}}, "not whole numbers of 8 or 16 bits without sign");
  expect_no_volume({{line, 1, 0}, {"", 1, 0}}, "its zero is white");
  expect_no_volume({{line}, {start + "cf=0\nc0=5\nc1=2\n"}}, "page 2 is calibrated otherwise than page 1");
}

TEST_F(Tiff, ImagesWithoutADirectoryAreMissed) {
  const std::string four = "ImageJ=1.53t\nimages=4\nslices=4\n";
  for (const std::size_t count : {1u, 2u}) {
    EXPECT_SAYS(image(pages_of(count, four), 1),
                "its description tells of 4 pages, but it has " + std::to_string(count));
    expect_no_volume(pages_of(count, four), "its description tells of 4 pages");
  }
  EXPECT_SAYS(image(pages_of(1, "{\"shape\": [4, 1, 2]}")), "its description tells of 4 pages");
  EXPECT_EQ(volume(pages_of(4, four)).grid.size[2], 4);
  EXPECT_EQ(image(pages_of(4, four), 3).pixels.at<std::uint16_t>(0, 0), 3000);
}

TEST_F(Tiff, TwoStacksInOneFileAreNoVolume) {
  std::vector<Page> pages = pages_of(4, "{\"shape\": [2, 1, 2]}");
  pages[2] = pages[0];
  expect_no_volume(pages, "is a file of several stacks (its first page tells of 2 of the 4 pages)");
  expect_no_volume(pages_of(4, "ImageJ=1.53t\nimages=2\nslices=2\n"), "tells of 2 of the 4 pages");
  expect_no_volume(pages_of(4, "{\"shape\": [1, 2]}"), "tells of 1 of the 4 pages");
  EXPECT_EQ(volume({{"{\"shape\": [1, 2]}"}, {"{\"shape\": [1, 2]}"}}).grid.size[2], 2);  // written page by page
  EXPECT_EQ(image(pages, 3).pixels.at<std::uint16_t>(0, 0), 3000);                        // of images, one is picked
}

TEST_F(Tiff, OmeIsReadAsXmlIs) {
  const std::string sizes = "SizeX=\"2\" SizeY=\"1\" SizeZ=\"2\" SizeC=\"2\" SizeT=\"1\"";
  const auto each = [](std::string text, const std::string& from, const std::string& to) {
    for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
      text.replace(at, from.size(), to);
    return text;
  };
  const std::string plain = ome(sizes);
  std::string prefixed = each(plain, "<", "<o:");
  prefixed = each(each(each(prefixed, "<o:?", "<?"), "<o:/", "</o:"), "xmlns=", "xmlns:o=");
  for (const std::string& text :
       {plain, each(plain, "\"", "'"), each(plain, " Size", "\nSize"), each(plain, "SizeC=", "SizeC = "), prefixed,
        each(plain, "<Image", "<!--" + std::string(70000, 'x') + "--><Image"),
        each(plain, "<Image", "<!-- <Pixels> --><Image")})
    expect_no_volume(pages_of(4, text), "is an OME stack of 2 channels");
  expect_no_volume(pages_of(4, each(plain, "<Image", "<!--" + std::string(1 << 20, 'x') + "--><Image")),
                   "bytes, more than the 1048576 that are read");
}

TEST_F(Tiff, OnlyOnePlainStackOfOmeIsAVolume) {
  const std::string sizes = "SizeZ=\"2\" SizeC=\"1\" SizeT=\"1\"", not_plain = "is not that of one stack of slices";
  const auto planes = [](int first, int second) {
    return "<TiffData FirstZ=\"" + std::to_string(first) + "\" IFD=\"0\" PlaneCount=\"1\"/><TiffData FirstZ=\"" +
           std::to_string(second) + "\" IFD=\"1\" PlaneCount=\"1\"><UUID FileName=\"a\">u</UUID></TiffData>";
  };
  for (const std::string& data : {planes(0, 1), std::string("<TiffData IFD='0' PlaneCount='2'/>"), std::string()})
    EXPECT_EQ(volume(pages_of(2, ome(sizes, data))).grid.size[2], 2) << data;
  expect_no_volume(pages_of(2, ome(sizes, planes(1, 0))), not_plain);
  expect_no_volume(pages_of(2, ome(sizes, "<TiffData IFD=\"1\"/>")), not_plain);
  expect_no_volume(pages_of(2, ome(sizes, "<TiffData FirstC=\"1\"/>")), not_plain);
  for (const char* other : {"SizeZ=\"2\" SizeT=\"1\"", "SizeC=1 SizeT=1"})
    expect_no_volume(pages_of(2, ome(other)), not_plain);
  expect_no_volume(pages_of(2, ome("SizeZ=\"1\" SizeC=\"&#50;\" SizeT=\"1\"")), "is an OME stack of 2 channels");
  expect_no_volume(pages_of(2, "<!DOCTYPE OME []>" + ome(sizes)), not_plain);
  expect_no_volume(pages_of(2, "<OME><BinaryOnly MetadataFile=\"a.ome\"/></OME>"), not_plain);
  expect_no_volume(pages_of(4, ome(sizes)), "tells of 2 of the 4 pages");
  expect_no_volume(pages_of(1, ome(sizes)), "its description tells of 2 pages, but it has 1");
  const std::string image_text = "<Image><Pixels " + sizes + "/></Image>";
  expect_no_volume(pages_of(4, "<OME>" + image_text + image_text + "</OME>"), "is an OME file of 2 images");
}

}  // namespace tiff_test
