// SPDX-License-Identifier: Apache-2.0
#include <opencv2/videoio.hpp>

#include "marrow/toolbox/track/sequence.hpp"
#include "tests/plugins/read/dicom_text.hpp"
#include "tests/plugins/read/itk_files.hpp"
#include "tests/plugins/read/reading.hpp"

namespace sequence_test {

using namespace marrow;
using namespace marrow::test;
using Eigen::Vector3d;
using track::SequenceFrame;
using Path = std::filesystem::path;
using Texts = std::vector<std::string>;

/// An image of 6 x 4 pixels, all of one grey value.
void put_image(const Path& path, int grey, unsigned height = 4) {
  std::filesystem::create_directories(path.parent_path());
  write_itk(path, filled<std::uint8_t>({6, height}, grey));
}

class ReadSequence : public InAFolder {
 protected:
  ReadSequence() {
    for (const int number : {9, 10, 11, 12})
      for (const char* view : {"a", "b"})
        put_image(folder / "both" / (std::string(view) + "_" + std::to_string(number) + ".png"), 10 * number);
    put(folder / "camera.txt", xmalab_camera(6, 4));
    options["names"] = Texts{"a", "b"};
    options["images"] = Texts{folder / "both", folder / "both"};
    options["patterns"] = Texts{"a_*.png", "b_*.png"};
    options["cameras"] = Texts{folder / "camera.txt", folder / "camera.txt"};
  }
  List<SequenceFrame> frames() {
    return shipped::call("read.sequence", {}, options).at("frames").as_list<SequenceFrame>();
  }
  /// One view from one path.
  void take(const Path& path, const std::string& camera = "camera.txt") {
    options = {{"names", Texts{"a"}}, {"images", Texts{path}}, {"cameras", Texts{folder / camera}}};
  }
  /// The grey value of each frame's only view.
  std::vector<int> greys() {
    std::vector<int> values;
    for (const SequenceFrame& frame : frames()) {
      const cv::Mat& pixels = frame.views.at(0).image.pixels;
      values.push_back(pixels.depth() == CV_8U ? pixels.at<std::uint8_t>(1, 1) : pixels.at<std::uint16_t>(1, 1));
    }
    return values;
  }
  shipped::Options options;
};

TEST_F(ReadSequence, FilesOfAFolderInTheOrderOfTheirNumbers) {
  const auto read = frames();
  EXPECT_EQ(read.names(), (Texts{"0001", "0002", "0003", "0004"}));
  for (std::size_t i = 0; i < 4; ++i) {
    ASSERT_EQ(read[i].views.size(), 2u);
    EXPECT_EQ(read[i].views[1].name, "b");
    EXPECT_EQ(read[i].views[1].image.pixels.at<std::uint8_t>(0, 0), 90 + 10 * int(i));
    EXPECT_EQ(read[i].views[1].camera.camera_from_world.translation_mm.z(), 600);
  }
  const auto views = shipped::call("track.views", {{"frame", shipped::item(read[2])}}).at("views");
  EXPECT_EQ(views.as_list<View>().names(), (Texts{"a", "b"}));
  EXPECT_EQ(views.as_list<View>()[0].image.pixels.at<std::uint8_t>(0, 0), 110);
}

TEST_F(ReadSequence, PartsOfItAreNamedByTheirPlaceInTheWhole) {
  options["first"] = std::int64_t(2);
  options["every"] = std::int64_t(2);
  EXPECT_EQ(frames().names(), (Texts{"0002", "0004"}));
  options["last"] = std::int64_t(3);
  EXPECT_EQ(frames().names(), (Texts{"0002"}));
  EXPECT_EQ(frames()[0].views[0].image.pixels.at<std::uint8_t>(0, 0), 100);
  options["last"] = std::int64_t(5);
  EXPECT_SAYS(frames(), "both: has 4 frames; there is no frame 5");
  options["last"] = std::int64_t(1);
  EXPECT_SAYS(frames(), "both: the last frame to be read, 1, lies before the first, 2");
}

// A folder of a device: DICOM files without an ending, a directory of them, and a picture of one.
TEST_F(ReadSequence, ImagesAreKnownByTheirContent) {
  const Path device = folder / "device";
  for (const int number : {1, 2}) {
    const std::string pixels = "OW:" + std::string(2 * 24, char(number));
    put(device / ("IM" + std::to_string(number)), dicom_file(but(fluoroscopy(), {{0x7FE00010, pixels}})));
  }
  put(device / "DICOMDIR", dicom_file({}));
  put(device / "preview.jpg", "\xFF\xD8\xFF\xE0");
  put(device / "notes.txt", "two images");
  take(device);
  EXPECT_EQ(greys(), (std::vector<int>{0x0101, 0x0202}));
}

TEST_F(ReadSequence, FoldersInFoldersByAPattern) {
  for (const int number : {1, 2, 10}) put_image(folder / "deep" / std::to_string(number) / "a" / "image.png", number);
  take(folder / "deep");
  EXPECT_SAYS(frames(), "deep: no image (PNG, TIFF, DICOM, ...) is in it; the folder is empty");
  options["patterns"] = Texts{"*/a/image.png"};
  EXPECT_SAYS(
      frames(),
      "deep: image 3 is missing between '2/a/image.png' and '10/a/image.png'; a bone is followed in even steps of "
      "time: put a blank image of the same size there, or move the images behind the gap to a folder of their own");
  std::filesystem::rename(folder / "deep" / "10", folder / "deep" / "3");
  EXPECT_EQ(greys(), (std::vector<int>{1, 2, 10}));
}

TEST_F(ReadSequence, PagesOfATiffAndFramesOfADicomFile) {
  write_itk(folder / "stack.tif", ramp<std::uint8_t>({6, 4, 3}, 1 / 24.0, 5.01));
  take(folder / "stack.tif");
  EXPECT_EQ(greys(), (std::vector<int>{5, 6, 7}));
  options["first"] = std::int64_t(3);
  EXPECT_EQ(greys(), (std::vector<int>{7}));
  const std::string pixels = fluoroscopy().at(0x7FE00010);
  put(folder / "run.dcm",
      dicom_file(
          but(fluoroscopy(), {{0x00280008, "IS:3"}, {0x7FE00010, pixels + std::string(48, '\1') + pixels.substr(3)}})));
  take(folder / "run.dcm");
  EXPECT_EQ(greys(), (std::vector<int>{101, 257, 101}));
  options["patterns"] = Texts{"*"};
  EXPECT_SAYS(frames(), "run.dcm: a pattern chooses files of a folder, but this is not a folder; leave it out");
}

class Video : public ReadSequence {
 protected:
  /// Ten frames, the k-th of grey value 20 k.
  Video() {
    cv::VideoWriter writer(video.string(), cv::CAP_OPENCV_MJPEG, cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 10,
                           {64, 48}, true);
    for (int k = 1; k <= 10; ++k) writer.write(cv::Mat(48, 64, CV_8UC3, cv::Scalar::all(20 * k)));
    writer.release();
    put(folder / "video.txt", xmalab_camera(64, 48));
    take(video, "video.txt");
  }
  const Path video = folder / "run.avi";
};

TEST_F(Video, IsReadAsGrey) {
  const std::vector<int> found = greys();
  ASSERT_EQ(found.size(), 10u);
  for (int k = 0; k < 10; ++k) EXPECT_NEAR(found[std::size_t(k)], 20 * (k + 1), 3);
  EXPECT_EQ(frames()[0].views[0].image.pixels.type(), CV_8U);
  options["every"] = std::int64_t(4);
  EXPECT_EQ(frames().names(), (Texts{"0001", "0005", "0009"}));
}

TEST_F(Video, ThatIsCutOffIsNotTakenForAShorterOne) {
  std::filesystem::resize_file(video, std::filesystem::file_size(video) * 2 / 3);
  const std::string refusal = shipped::refusal("read.sequence", {}, options);
  EXPECT_NE(refusal.find("run.avi: says that it has 10 frames, but only "), std::string::npos) << refusal;
  EXPECT_NE(refusal.find("can be decoded; to read these, set last to "), std::string::npos) << refusal;
  options["last"] = std::int64_t(3);
  EXPECT_EQ(greys().size(), 3u);
  put(video, "no video at all");
  EXPECT_SAYS(frames(), "run.avi: is not a video, or is damaged at its start");
}

TEST_F(ReadSequence, DiagnosesFaults) {
  put_image(folder / "both" / "b_11.png", 1, 5);
  EXPECT_SAYS(
      frames(),
      "b_11.png: frame 3 has 6 x 5 pixels of 8 bits, but the first one 6 x 4 of 8; all frames of a view must be alike");
  std::filesystem::remove(folder / "both" / "b_12.png");
  put_image(folder / "both" / "b_11.png", 1);
  EXPECT_SAYS(frames(), "view 'b' has 3 frames, but view 'a' has 4 (");
  put_image(folder / "both" / "b_012.png", 1);
  put_image(folder / "both" / "b_12.png", 1);
  EXPECT_SAYS(frames(), "both: two images have the same number: 'b_012.png' and 'b_12.png'; remove one of them");
  options["patterns"] = Texts{"*.png", "b_*.png"};
  EXPECT_SAYS(frames(),
              "both: the images differ in more than a number: 'a_10.png' and 'b_9.png'; name those of one sequence by "
              "a pattern, as 'frontal_*.png'");
  options["patterns"] = Texts{"c_*.png", "b_*.png"};
  EXPECT_SAYS(frames(),
              "both: no file in it fits the pattern 'c_*.png'; there are 'a_10.png', 'a_11.png', 'a_12.png', "
              "'a_9.png', 'b_012.png' and 4 more");
  put(folder / "camera.txt", xmalab_camera(7, 4));
  take(folder / "both");
  options["patterns"] = Texts{"a_*.png"};
  EXPECT_SAYS(frames(), "view 'a': the image has 6 x 4 pixels, but its camera is for 7 x 4");
  take(folder / "nowhere");
  EXPECT_SAYS(frames(), "nowhere");
}

TEST_F(ReadSequence, FilesOutsideTheFolderAreRefused) {
  put_image(folder / "elsewhere.png", 1);
  std::filesystem::create_symlink(folder / "elsewhere.png", folder / "both" / "a_13.png");
  EXPECT_SAYS(frames(), "a_13.png");
}

TEST_F(ReadSequence, ACameraForEachName) {
  List<Camera> cameras;
  cameras.add("a", Camera{6, 4, Vector3d(10, 10, 1).asDiagonal(), {"camera", "world"}});
  options.erase("cameras");
  EXPECT_EQ(shipped::refusal("read.sequence", {{"camera", shipped::list(cameras, "view")}}, options),
            "view 'b' has no camera of that name; there are 'a'");
  EXPECT_TRUE(shipped::declares("read.sequence", same_length({"names", "images"})));
  EXPECT_TRUE(shipped::declares("read.sequence", as_many_or_none("patterns", "names")));
  EXPECT_TRUE(shipped::declares("read.sequence", exactly_one({"in.camera", "cameras"})));
  EXPECT_TRUE(shipped::declares("read.sequence", as_many_or_none("cameras", "names")));
}

}  // namespace sequence_test
