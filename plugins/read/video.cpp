// SPDX-License-Identifier: Apache-2.0
#include "video.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

#include "marrow/domain/error.hpp"
#include "marrow/toolbox/files/input_file.hpp"

namespace marrow::read_sequence {
namespace {

namespace fs = std::filesystem;

cv::Mat as_grey(const cv::Mat& picture) {
  if (picture.channels() == 1) return picture.clone();
  cv::Mat grey;
  cv::cvtColor(picture, grey, cv::COLOR_BGR2GRAY);
  return grey;
}

std::vector<Image> decode(const fs::path& path, const files::FrameRange& range) {
  cv::VideoCapture video(path.string(), cv::CAP_FFMPEG);
  if (!video.isOpened())
    throw Error(path.string() + ": cannot be decoded as a video; it is damaged, or FFmpeg does not know its format");
  const double said = video.get(cv::CAP_PROP_FRAME_COUNT);
  std::vector<Image> images;
  cv::Mat picture;
  int count = 0;
  while ((range.last == 0 || count < range.last) && video.grab()) {
    ++count;
    if (count < range.first || (count - range.first) % range.every != 0) continue;
    if (!video.retrieve(picture) || picture.depth() != CV_8U)
      throw Error(path.string() + ": frame " + std::to_string(count) + " cannot be decoded");
    images.push_back({as_grey(picture)});
  }
  if (range.last == 0 && count < said)
    throw Error(path.string() + ": says that it has " + std::to_string(long(said)) + " frames, but only " +
                std::to_string(count) + " can be decoded; to read these, set last to " + std::to_string(count));
  files::frames_of(range, count, path.string());  // are there the first and the last?
  return images;
}

}  // namespace

bool is_video(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return char(std::tolower(c)); });
  constexpr std::array kKnown{".avi", ".mp4", ".m4v", ".mov", ".mkv", ".webm", ".wmv", ".mpg", ".mpeg"};
  return std::find(kKnown.begin(), kKnown.end(), extension) != kKnown.end();
}

std::vector<Image> read_video(const fs::path& path, const files::FrameRange& range) {
  files::InputFile(path).size();  // a regular file that can be read
  try {
    return decode(path, range);
  } catch (const cv::Exception& error) {
    throw Error(path.string() + ": cannot be decoded as a video: " + error.err);
  }
}

}  // namespace marrow::read_sequence
