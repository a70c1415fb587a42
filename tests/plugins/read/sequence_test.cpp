// SPDX-License-Identifier: Apache-2.0
#include <opencv2/videoio.hpp>

#include "marrow/toolbox/track/track_state.hpp"
#include "tests/plugins/read/dicom_text.hpp"
#include "tests/plugins/read/itk_files.hpp"
#include "tests/plugins/read/reading.hpp"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavutil/pixdesc.h>
}

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
  EXPECT_HAS(refusal, "run.avi: says that it has 10 frames, but only ");
  EXPECT_HAS(refusal, "can be decoded; to read these, set last to ");
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

constexpr int kWidth_px = 64, kHeight_px = 48;

/// Compressed frames, and what their AVI file says of them.
struct AviFrames {
  std::string codec;  ///< its four letters
  std::vector<std::string> frames{};
  std::string extra{};  ///< what the codec must know before the first frame
};

std::string avi_chunk(const std::string& name, const std::string& content) {
  return name + little(content.size(), 4) + content + std::string(content.size() % 2, '\0');
}

/// An AVI file written by hand, 10 frames a second.
std::string avi_file(const AviFrames& video) {
  const auto numbers = [](const std::vector<std::size_t>& all, int bytes) {
    std::string text;
    for (const std::size_t number : all) text += little(number, bytes);
    return text;
  };
  const std::size_t width = kWidth_px, height = kHeight_px, count = video.frames.size();
  const std::string main = numbers({100000, 0, 0, 0, count, 0, 1, 0, width, height, 0, 0, 0, 0}, 4);
  const std::string stream =
      "vids" + video.codec + numbers({0, 0, 0, 1, 10, 0, count, 0, 0, 0}, 4) + numbers({0, 0, width, height}, 2);
  const std::string format = numbers({40 + video.extra.size(), width, height}, 4) + numbers({1, 24}, 2) + video.codec +
                             numbers({0, 0, 0, 0, 0}, 4) + video.extra;
  std::string frames = "movi";
  for (const std::string& frame : video.frames) frames += avi_chunk("00dc", frame);
  const std::string header = "hdrl" + avi_chunk("avih", main) +
                             avi_chunk("LIST", "strl" + avi_chunk("strh", stream) + avi_chunk("strf", format));
  return avi_chunk("RIFF", "AVI " + avi_chunk("LIST", header) + avi_chunk("LIST", frames));
}

class DeepVideo : public InAFolder {
 protected:
  DeepVideo() { put(folder / "camera.txt", xmalab_camera(kWidth_px, kHeight_px)); }
  /// The frames of a file, as read.sequence gives them.
  std::vector<cv::Mat> read(const std::string& name) {
    const shipped::Options options{
        {"names", Texts{"a"}}, {"images", Texts{folder / name}}, {"cameras", Texts{folder / "camera.txt"}}};
    std::vector<cv::Mat> frames;
    for (const auto& frame : shipped::call("read.sequence", {}, options).at("frames").as_list<track::SequenceFrame>())
      frames.push_back(frame.views.at(0).image.pixels);
    return frames;
  }
  std::vector<cv::Mat> of(const std::string& name, const std::string& bytes) {
    put(folder / name, bytes);
    return read(name);
  }
};

/// Grey value of a pixel of the k-th frame; the values of all bits occur.
int ramp(int u, int v, int k, int bits) { return (u * 1021 + v * 997 + k * 10007) % (1 << bits); }

/// Frames of the ramp by FFmpeg's lossless encoder FFV1; `black` and `white` are the lowest and the highest value.
AviFrames ffv1(AVPixelFormat kind, int black, int white) {
  const int bits = av_pix_fmt_desc_get(kind)->comp[0].depth;
  AVCodecContext* encoder = avcodec_alloc_context3(avcodec_find_encoder(AV_CODEC_ID_FFV1));
  encoder->width = kWidth_px, encoder->height = kHeight_px, encoder->pix_fmt = kind, encoder->time_base = {1, 10};
  AviFrames video{"FFV1"};
  EXPECT_EQ(avcodec_open2(encoder, encoder->codec, nullptr), 0);
  video.extra.assign(reinterpret_cast<const char*>(encoder->extradata), std::size_t(encoder->extradata_size));
  AVFrame* frame = av_frame_alloc();
  AVPacket* packet = av_packet_alloc();
  for (int k = 0; k < 3; ++k) {
    frame->width = kWidth_px, frame->height = kHeight_px, frame->format = kind, frame->pts = k;
    EXPECT_EQ(av_frame_get_buffer(frame, 0), 0);
    for (int plane = 0; plane < av_pix_fmt_count_planes(kind); ++plane)
      for (int v = 0; v < kHeight_px; ++v)
        for (int u = 0; u < kWidth_px; ++u)
          reinterpret_cast<std::uint16_t*>(frame->data[plane] + v * frame->linesize[plane])[u] =
              std::uint16_t(plane == 0 ? black + ramp(u, v, k, bits) % (white - black + 1) : 1 << (bits - 1));
    EXPECT_EQ(avcodec_send_frame(encoder, frame), 0);
    EXPECT_EQ(avcodec_receive_packet(encoder, packet), 0);
    video.frames.emplace_back(reinterpret_cast<const char*>(packet->data), std::size_t(packet->size));
    av_packet_unref(packet);
    av_frame_unref(frame);
  }
  av_packet_free(&packet);
  av_frame_free(&frame);
  avcodec_free_context(&encoder);
  return video;
}

// FFmpeg's encoder without loss takes the ramp, so the values that must come back are known.
TEST_F(DeepVideo, GreyOf10To16BitsKeepsThemAndBrightnessBecomesLevels) {
  for (const auto& [kind, bits] :
       {std::pair{AV_PIX_FMT_GRAY10LE, 10}, {AV_PIX_FMT_GRAY12LE, 12}, {AV_PIX_FMT_GRAY16LE, 16}}) {
    const std::vector<cv::Mat> frames = of("deep.avi", avi_file(ffv1(kind, 0, (1 << bits) - 1)));
    ASSERT_EQ(frames.size(), 3u);
    ASSERT_EQ(frames[2].type(), CV_16U) << bits;
    for (int v = 0; v < kHeight_px; ++v)
      for (int u = 0; u < kWidth_px; ++u) ASSERT_EQ(frames[2].at<std::uint16_t>(v, u), ramp(u, v, 2, bits)) << bits;
  }
  // By ITU-R BT.709, 10 bits of brightness run from 64 (black) to 940 (white). (v - 64) / 876 * 1023 is the level.
  const cv::Mat frame = of("colour.avi", avi_file(ffv1(AV_PIX_FMT_YUV444P10LE, 64, 940))).at(1);
  ASSERT_EQ(frame.type(), CV_16U);
  for (int u = 0; u < kWidth_px; ++u) {
    const int stored = 64 + ramp(u, 3, 1, 10) % 877;
    EXPECT_EQ(frame.at<std::uint16_t>(3, u), std::lround((stored - 64) / 876.0 * 1023)) << stored;
  }
}

TEST_F(DeepVideo, PngFramesOf16BitsAreThoseThatItkWrote) {
  AviFrames video{"MPNG"};
  for (int k = 0; k < 2; ++k)
    video.frames.push_back(itk_bytes(".png", marrow::test::ramp<std::uint16_t>({64, 48}, 21, k * 500)));
  const std::vector<cv::Mat> frames = of("named.bin", avi_file(video));  // the content tells that it is a video
  ASSERT_EQ(frames.size(), 2u);
  ASSERT_EQ(frames[1].type(), CV_16U);
  EXPECT_EQ(frames[1].at<std::uint16_t>(2, 5), (2 * 64 + 5) * 21 + 500);
}

TEST_F(DeepVideo, AFrameThatCannotBeDecodedIsNamed) {
  AviFrames video = ffv1(AV_PIX_FMT_GRAY12LE, 0, 4095);
  video.codec = "ZZZZ";
  EXPECT_SAYS(of("odd.avi", avi_file(video)),
              "odd.avi: its frames are compressed by 'ZZZZ', for which FFmpeg has no decoder here; convert it, to FFV1 "
              "for example");
}

// Frames in other files are not part of the key of the result: a change of them would go unnoticed.
TEST_F(DeepVideo, ListsOfOtherFilesAreRefusedAndNamesArePatternsOfNothing) {
  put(folder / "good.avi", avi_file(ffv1(AV_PIX_FMT_GRAY12LE, 0, 4095)));
  const std::vector<std::pair<std::string, std::string>> lists{
      {"ffconcat version 1.0\nfile good.avi\n", "is a list of files (ffconcat), not a video"},
      {"#EXTM3U\n#EXT-X-TARGETDURATION:1\n#EXTINF:1,\ngood.avi\n#EXT-X-ENDLIST\n", "is a playlist (M3U8), not a video"},
      {"v=0\no=- 0 0 IN IP4 127.0.0.1\ns=x\nm=video 5004 RTP/AVP 96\n",
       "is a description of a stream (SDP), not a video"},
      {"<?xml version=\"1.0\"?>\n<MPD xmlns=\"urn:mpeg:dash:schema:mpd:2011\"></MPD>\n",
       "is a description of a stream (DASH), not a video"}};
  for (const auto& [content, words] : lists)
    for (const char* name : {"list.avi", "list.mp4", "list.txt"}) {
      EXPECT_SAYS(of(name, content),
                  std::string(name) + ": " + words +
                      ": the frames are in other files, whose changes would go unnoticed; name the video "
                      "itself, or a folder of images");
    }
  EXPECT_SAYS(
      of("no.mov", "hello"),
      "no.mov: is not a video, or is damaged at its start; marrow reads AVI, MP4, MOV, MKV, WebM, WMV and MPEG");
  // FFmpeg takes a name with % for a pattern of many images. Here the file's content alone counts.
  put(folder / "a%03d.png", avi_file(ffv1(AV_PIX_FMT_GRAY12LE, 0, 4095)));
  write_itk(folder / "a001.png", filled<std::uint8_t>({64, 48}, 0));
  EXPECT_EQ(read("a%03d.png").size(), 3u);
}

// A MOV may name the file with its frames in the box 'dref' (ISO 14496-12, 8.7.2): flag 1 means this file.
TEST_F(DeepVideo, AMovWhoseFramesAreElsewhereIsRefused) {
  const auto box = [](const std::string& name, const std::string& content) {
    const std::string bytes = little(content.size() + 8, 4);
    return std::string(bytes.rbegin(), bytes.rend()) + name + content;
  };
  const auto mov = [&](char flag) {
    using namespace std::string_literals;
    const std::string reference = box("url ", "\0\0\0"s + flag + (flag ? "" : "file:///tmp/other.mov\0"s));
    return box("ftyp", "qt  \0\0\0\0"s) +
           box("moov",
               box("trak", box("mdia", box("minf", box("dinf", box("dref", "\0\0\0\0\0\0\0\1"s + reference))))));
  };
  EXPECT_SAYS(of("away.mov", mov(0)),
              "away.mov: its frames are in another file, which it names; save it as one self-contained file");
  EXPECT_SAYS(of("here.mov", mov(1)), "here.mov: holds no pictures that FFmpeg finds");
}

}  // namespace sequence_test
