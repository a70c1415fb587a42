// SPDX-License-Identifier: Apache-2.0
#pragma once
// AVI files of compressed frames, written by hand.
#include <string>
#include <vector>

namespace marrow::test {

struct AviFrames {
  std::string codec;  ///< its four letters
  int width = 0, height = 0;
  std::vector<std::string> frames{};
  std::string extra{};  ///< what the codec must know before the first frame
};

inline std::string little_endian(std::size_t number, int bytes) {
  std::string text;
  for (int i = 0; i < bytes; ++i) text += char(number >> 8 * i & 0xFF);
  return text;
}

inline std::string avi_chunk(const std::string& name, const std::string& content) {
  return name + little_endian(content.size(), 4) + content + std::string(content.size() % 2, '\0');
}

/// 10 frames a second.
inline std::string avi_file(const AviFrames& video) {
  const auto numbers = [](const std::vector<std::size_t>& all, int bytes) {
    std::string text;
    for (const std::size_t number : all) text += little_endian(number, bytes);
    return text;
  };
  const std::size_t width = std::size_t(video.width), height = std::size_t(video.height), count = video.frames.size();
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

}  // namespace marrow::test
