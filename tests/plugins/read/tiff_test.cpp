// SPDX-License-Identifier: Apache-2.0
// TIFF stacks: what their descriptions tell about values and pages, and files that lie: fields of other kinds, pages of
// other sizes or over each other, directories in a circle.
#include <zlib.h>

#include "marrow/toolbox/files/volume_file.hpp"
#include "tests/plugins/read/damage.hpp"

namespace tiff_test {

using namespace marrow;
using namespace marrow::test;

/// A field of a directory.
struct Field {
  std::uint32_t value;
  int type = 4;
  std::uint32_t count = 1;
};
using Fields = std::map<int, Field>;

/// A page of one strip of 8 bits, which stands at `strip`.
Fields page(std::uint32_t width, std::uint32_t height, std::uint32_t strip = 8) {
  return {{256, {width}}, {257, {height}}, {258, {8}},      {259, {1}},
          {262, {1}},     {273, {strip}},  {278, {height}}, {279, {width * height}}};
}

/// The data, which begin at byte 8, then the directories. `next`: the page that is said to follow the last one.
std::string tiff(const std::string& data, const std::vector<Fields>& pages, int next = -1) {
  std::string bytes = "II" + number<std::uint16_t>(42) + number(std::uint32_t(8 + data.size())) + data;
  std::vector<std::size_t> places;
  for (const Fields& fields : pages) {
    places.push_back(bytes.size());
    bytes += number(std::uint16_t(fields.size()));
    for (const auto& [tag, field] : fields)
      bytes +=
          number(std::uint16_t(tag)) + number(std::uint16_t(field.type)) + number(field.count) + number(field.value);
    const bool is_last = &fields == &pages.back();
    bytes += number(std::uint32_t(!is_last ? bytes.size() + 4 : next >= 0 ? places[std::size_t(next)] : 0));
  }
  return bytes;
}

Fields but(Fields fields, const Fields& by) {
  for (const auto& [tag, field] : by) fields[tag] = field;
  return fields;
}

struct Page {
  std::string description;  ///< none where empty
  std::uint32_t format = 1, photometric = 1;
};

/// Pages of 2 x 1 pixels of 16 bits; page k holds 1000 (k + 1) and 1001 (k + 1).
std::string described(const std::vector<Page>& pages) {
  std::string data;
  std::vector<Fields> all;
  for (std::size_t k = 0; k < pages.size(); ++k) {
    const auto& [description, format, photometric] = pages[k];
    Fields fields = but(page(2, 1, std::uint32_t(8 + data.size())),
                        {{258, {16}}, {262, {photometric}}, {279, {4}}, {339, {format, 3}}});
    data += number(std::uint16_t(1000 * (k + 1))) + number(std::uint16_t(1001 * (k + 1)));
    const std::uint32_t at = std::uint32_t(8 + data.size());
    if (!description.empty()) fields[270] = {at, 2, std::uint32_t(description.size())};
    data += description;
    all.push_back(fields);
  }
  return tiff(data, all);
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

class Tiff : public InAFolder {
 protected:
  Volume volume(const std::string& bytes) {
    put(folder / "a.tif", bytes);
    files::VolumeReading reading;
    reading.voxel_size_mm = {1, 1, 1};
    return files::read_volume_file(folder / "a.tif", reading);
  }
  Volume volume(const std::vector<Page>& pages) { return volume(described(pages)); }
  Image image(const std::string& bytes, int frame = 0) {
    put(folder / "a.tif", bytes);
    return files::read_image_file(folder / "a.tif", frame);
  }
  Image image(const std::vector<Page>& pages, int frame = 0) { return image(described(pages), frame); }
  void expect_no_volume(const std::string& bytes, const std::string& text) {
    EXPECT_REFUSED(volume(bytes), "a.tif", text);
  }
  void expect_no_volume(const std::vector<Page>& pages, const std::string& text) {
    expect_no_volume(described(pages), text);
  }
};

// ImageJ keeps a CT, whose numbers have a sign, so.
TEST_F(Tiff, ImageJsCalibrationIsAppliedAndOthersAreRefused) {
  const std::string ct = "ImageJ=1.53t\nimages=2\nslices=2\ncf=0\nc0=-32768.0\nc1=1.0\nvunit=gray value\n";
  EXPECT_EQ(volume(pages_of(2, ct)).values, (std::vector<float>{-31768, -31767, -30768, -30766}));
  EXPECT_EQ(volume(pages_of(2, "ImageJ=1.53t\nimages=2\ncf=0\nc0=0\nc1=1\n")).values[0], 1000);
  const cv::Mat second = image(pages_of(2, "ImageJ=1.53t\r\nimages=2\r\ncf=0\r\nc0=100\r\nc1=-0.5\r\n"), 2).pixels;
  ASSERT_EQ(second.type(), CV_32F);
  EXPECT_EQ(second.at<float>(0, 0), -900);
  EXPECT_EQ(second.at<float>(0, 1), -901);
  const std::string start = "ImageJ=1.53t\nimages=2\nslices=2\n", line = start + "cf=0\nc0=1\nc1=2\n";
  for (const std::string function : {"1", "20", "21", "x"})
    expect_no_volume(pages_of(2, start + "cf=" + function + "\nc0=1\nc1=2\n"), "ImageJ's function " + function);
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
  const std::string plain = ome("SizeX=\"2\" SizeY=\"1\" SizeZ=\"2\" SizeC=\"2\" SizeT=\"1\"");
  std::string prefixed = with_each(plain, "<", "<o:");
  prefixed = with_each(with_each(with_each(prefixed, "<o:?", "<?"), "<o:/", "</o:"), "xmlns=", "xmlns:o=");
  const auto remarked = [&](const std::string& remark) {
    return with_each(plain, "<Image", "<!--" + remark + "--><Image");
  };
  for (const std::string& text :
       {plain, with_each(plain, "\"", "'"), with_each(plain, " Size", "\nSize"), with_each(plain, "SizeC=", "SizeC = "),
        prefixed, remarked(std::string(70000, 'x')), remarked(" <Pixels> ")})
    expect_no_volume(pages_of(4, text), "is an OME stack of 2 channels");
  expect_no_volume(pages_of(4, remarked(std::string(1 << 20, 'x'))), "bytes, more than the 1048576 that are read");
}

TEST_F(Tiff, OnlyOnePlainStackOfOmeIsAVolume) {
  const std::string sizes = "SizeZ=\"2\" SizeC=\"1\" SizeT=\"1\"";
  const auto planes = [](int first, int second) {
    return "<TiffData FirstZ=\"" + std::to_string(first) + "\" IFD=\"0\" PlaneCount=\"1\"/><TiffData FirstZ=\"" +
           std::to_string(second) + "\" IFD=\"1\" PlaneCount=\"1\"><UUID FileName=\"a\">u</UUID></TiffData>";
  };
  for (const std::string& data : {planes(0, 1), std::string("<TiffData IFD='0' PlaneCount='2'/>"), std::string()})
    EXPECT_EQ(volume(pages_of(2, ome(sizes, data))).grid.size[2], 2) << data;
  for (const std::string& text :
       {ome(sizes, planes(1, 0)), ome(sizes, "<TiffData IFD=\"1\"/>"), ome(sizes, "<TiffData FirstC=\"1\"/>"),
        ome("SizeZ=\"2\" SizeT=\"1\""), ome("SizeC=1 SizeT=1"), "<!DOCTYPE OME []>" + ome(sizes),
        std::string("<OME><BinaryOnly MetadataFile=\"a.ome\"/></OME>")})
    expect_no_volume(pages_of(2, text), "is not that of one stack of slices");
  expect_no_volume(pages_of(2, ome("SizeZ=\"1\" SizeC=\"&#50;\" SizeT=\"1\"")), "is an OME stack of 2 channels");
  expect_no_volume(pages_of(4, ome(sizes)), "tells of 2 of the 4 pages");
  expect_no_volume(pages_of(1, ome(sizes)), "its description tells of 2 pages, but it has 1");
  const std::string image_text = "<Image><Pixels " + sizes + "/></Image>";
  expect_no_volume(pages_of(4, "<OME>" + image_text + image_text + "</OME>"), "is an OME file of 2 images");
}

TEST_F(Tiff, OfOtherProgramsWhosePagesAreNoSlices) {
  const auto stack = [](const std::string& description) {
    const Fields first = but(page(2, 2), {{270, {12, 2, std::uint32_t(description.size())}}});
    return tiff(little(8, 4) + description, {first, page(2, 2)});
  };
  for (const auto& [description, said] :
       {std::pair{"ImageJ=1.54f\nimages=2\nchannels=2\n", "is an ImageJ stack of 2 channels"},
        {"ImageJ=1.54f\nimages=2\nframes=2\n", "is an ImageJ stack of 2 frames"},
        {"<?xml version=\"1.0\"?><OME><Image><Pixels SizeX=\"2\" SizeZ=\"1\" SizeC=\"2\" SizeT=\"1\"/></Image></OME>",
         "is an OME stack of 2 channels, whose pages are not slices of one volume"},
        {"<OME><Pixels SizeC=\"1\" SizeT=\"2\"/></OME>", "is an OME stack of 2 times"},
        {"{\"shape\": [2, 1, 2, 2, 2]}", "is an array of 4 dimensions, [2, 1, 2, 2, 2]"},
        {"{\"axes\": \"TZYX\", \"shape\": [2, 2, 2, 2]}", "is an array of 4 dimensions, [2, 2, 2, 2]"},
        {"{\"shape\": [2, 2, 2], \"axes\": \"TYX\"}", "is a stack of times"},
        {"{\"shape\": [2, 2, 2], \"truncated\": true}", "its first page stands for several"}})
    expect_no_volume(stack(description), said);
  for (const char* slices :
       {"ImageJ=1.54f\nimages=2\nslices=2\nchannels=1\n", "{\"shape\": [2, 2, 2]}",
        "{\"shape\": [1, 2, 2, 2], \"axes\": \"TZYX\"}", "{\"shape\": [2, 2, 2], \"axes\": \"ZYX\"}",
        "<OME><Pixels SizeC=\"1\" SizeT=\"1\"/></OME>"})
    EXPECT_EQ(volume(stack(slices)).grid.size, (std::array<int, 3>{2, 2, 2})) << slices;
}

TEST_F(Tiff, WhoseZeroIsWhiteAndFieldsOfKindsThatAreNotRead) {
  const Fields white = but(page(2, 2), {{262, {0}}});
  EXPECT_EQ(volume(tiff(little(8, 4), {white, white})).values,
            (std::vector<float>{247, 255, 255, 255, 247, 255, 255, 255}));
  const Fields with_sign = but(white, {{339, {2}}});
  expect_no_volume(tiff(little(8, 4), {with_sign, with_sign}),
                   "its zero is white (PhotometricInterpretation WhiteIsZero)");
  expect_no_volume(tiff(little(8, 4), {but(page(2, 2), {{339, {2, 2}}})}),
                   "is cut off or damaged: only 0 pages are whole (libtiff: Incompatible type for \"SampleFormat\")");
}

TEST_F(Tiff, PagesOfDifferentSizes) {
  const std::string data(40000, 'x');
  const auto sizes = [&](std::uint32_t first, std::uint32_t second) {
    const std::string bytes = tiff(data + data, {page(8, first), page(8, second, 8 + 40000)});
    return bytes;
  };
  for (const auto& [first, second] : {std::pair{8, 5000}, {5000, 8}, {8, 9}})
    expect_no_volume(sizes(std::uint32_t(first), std::uint32_t(second)), "page 2 has another size");
  EXPECT_NO_THROW(volume(sizes(8, 8)));
}

TEST_F(Tiff, WhosePagesRunInACircleOrShareTheirBytes) {
  const Fields one = page(2, 2);
  EXPECT_EQ(volume(tiff(little(8, 4), {one, one})).grid.size, (std::array<int, 3>{2, 2, 2}));
  expect_no_volume(tiff(little(8, 4), {one}, 0), "only 1 pages are whole (libtiff: TIFF directory 0 has IFD looping");
  expect_no_volume(tiff(little(8, 4), {one, one}, 0),
                   "only 2 pages are whole (libtiff: TIFF directory 1 has IFD looping");
  // Small files must not take long. The pixels of all pages are the same 60000 bytes; so are the fields of the second
  // file, which are unknown and so read each time.
  Fields fields = page(300, 200);
  for (const bool has_unknown : {false, true}) {
    for (int tag = 40000; has_unknown && tag < 40040; ++tag) fields[tag] = {8, 3, 30000};
    expect_no_volume(tiff(std::string(60000, '\1'), std::vector<Fields>(100, fields)), "its pages lie over each other");
  }
}

// A wrong bit in Deflate often gives other pixels, which only the checksum at its end tells.
TEST_F(Tiff, WhoseChecksumIsWrong) {
  std::string pixels(400, '\0'), packed(1000, '\0');
  for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] = char(i * i % 251);
  uLongf length = packed.size();
  ASSERT_EQ(compress(reinterpret_cast<Bytef*>(packed.data()), &length, reinterpret_cast<const Bytef*>(pixels.data()),
                     pixels.size()),
            Z_OK);
  packed.resize(length);
  const Fields deflated = but(page(20, 20), {{259, {8}}, {279, {std::uint32_t(length)}}});
  EXPECT_EQ(image(tiff(packed, {deflated})).pixels.at<std::uint8_t>(19, 19), 399 * 399 % 251);
  packed.back() = char(packed.back() ^ 1);
  EXPECT_SAYS(image(tiff(packed, {deflated})), "a strip of its pixels does not hold");
}

}  // namespace tiff_test
