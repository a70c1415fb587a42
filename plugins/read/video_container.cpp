// SPDX-License-Identifier: Apache-2.0
#include "video.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <string_view>

#include "marrow/base/error.hpp"
#include "marrow/toolbox/files/header_lines.hpp"

namespace marrow::read {
namespace {

namespace fs = std::filesystem;
using files::InputFile;
using namespace std::string_view_literals;

constexpr std::size_t kHeadBytes = 1024;

bool has_at(std::string_view head, std::size_t at, std::string_view mark) {
  return at <= head.size() && head.substr(at, mark.size()) == mark;
}

/// A transport stream begins each packet of 188 bytes (192 with a time stamp before each) with the same byte.
bool is_transport_stream(std::string_view head) {
  for (const auto& [first, step] : {std::pair<std::size_t, std::size_t>{0, 188}, {4, 192}}) {
    bool is_one = head.size() > first + 3 * step;
    for (std::size_t i = 0; i < 4 && is_one; ++i) is_one = head[first + i * step] == '\x47';
    if (is_one) return true;
  }
  return false;
}

bool is_mov(std::string_view head) {
  // Still pictures (HEIC, AVIF) begin in the same way.
  for (const std::string_view picture : {"heic", "heix", "mif1", "avif"})
    if (has_at(head, 4, "ftyp") && has_at(head, 8, picture)) return false;
  if (has_at(head, 4, "mdat")) return true;
  for (const std::string_view box : {"ftyp", "moov", "wide", "free", "skip"})
    if (has_at(head, 0, "\0"sv) && has_at(head, 4, box)) return true;  // all of them are short
  return false;
}

const char* container_of(std::string_view head) {
  if (has_at(head, 0, "RIFF") && has_at(head, 8, "AVI ")) return "avi";
  if (is_mov(head)) return "mov";
  if (has_at(head, 0, "\x1A\x45\xDF\xA3")) return "matroska";
  if (has_at(head, 0, "\x30\x26\xB2\x75\x8E\x66\xCF\x11")) return "asf";
  if (has_at(head, 0, "\0\0\x01\xBA"sv)) return "mpeg";
  if (has_at(head, 0, "\0\0\x01\xB3"sv)) return "mpegvideo";
  return is_transport_stream(head) ? "mpegts" : nullptr;
}

/// The kind of a list of other files; empty if it is not a list.
std::string name_of_list(std::string_view head) {
  struct Known {
    std::string_view mark;
    const char* name;
  };
  static constexpr Known kLists[] = {{"ffconcat", "a list of files (ffconcat)"},
                                     {"#EXTM3U", "a playlist (M3U8)"},
                                     {"[playlist]", "a playlist (PLS)"},
                                     {"v=0", "a description of a stream (SDP)"},
                                     {"<MPD", "a description of a stream (DASH)"},
                                     {"<smil", "a playlist (SMIL)"},
                                     {"<asx", "a playlist (ASX)"}};
  if (has_at(head, 0, "\xEF\xBB\xBF")) head.remove_prefix(3);
  if (has_at(head, 0, "<?xml")) head.remove_prefix(std::min(head.find('<', 1), head.size()));
  for (const Known& list : kLists)
    if (has_at(head, 0, list.mark)) return list.name;
  return {};
}

bool is_named_like_a_video(const fs::path& path) {
  const std::string extension = files::in_small_letters(path.extension().string());
  constexpr std::array kKnown{".avi", ".mp4", ".m4v", ".mov", ".mkv", ".webm", ".wmv", ".mpg", ".mpeg", ".ts", ".m2ts"};
  return std::find(kKnown.begin(), kKnown.end(), extension) != kKnown.end();
}

/// The boxes of a MOV that lead to where the samples of its tracks are.
class MovBoxes {
 public:
  explicit MovBoxes(const InputFile& file) : file_(file), window_(file) {}

  /// Throws Error if a track's samples are in another file. Boxes that are cut off are left to the decoder.
  void check(std::uint64_t at, std::uint64_t end, int depth = 0) {
    while (end - at >= 8 && ++count_ < kMostBoxes) {
      std::uint64_t bytes = window_.number(at, 4, true), head = 8;
      const std::string kind = window_.text(at + 4, 4);
      if (bytes == 1 && end - at >= 16) bytes = window_.number(at + 8, 8, true), head = 16;
      if (bytes == 0) bytes = end - at;
      if (bytes < head || bytes > end - at) return;
      if (kind == "dref" && depth == 5) check_references(at + head, at + bytes);
      if (depth < 5 && kind == kWay[depth]) check(at + head, at + bytes, depth + 1);
      at += bytes;
    }
  }

 private:
  static constexpr std::uint64_t kMostBoxes = 100000;
  static constexpr std::string_view kWay[] = {"moov", "trak", "mdia", "minf", "dinf"};

  void check_references(std::uint64_t at, std::uint64_t end) {
    constexpr std::uint64_t kInThisFile = 1;
    at += 8;  // version, flags, count
    while (at < end && end - at >= 12) {
      const std::uint64_t bytes = window_.number(at, 4, true), flags = window_.number(at + 9, 3, true);
      if (!(flags & kInThisFile))
        throw Error(file_.path().string() +
                    ": its frames are in another file, which it names; save it as one self-contained file (in "
                    "QuickTime: Export; with FFmpeg: -c copy)");
      if (bytes < 12 || bytes > end - at) return;
      at += bytes;
    }
  }

  const InputFile& file_;
  files::FileWindow window_;
  std::uint64_t count_ = 0;
};

}  // namespace

const char* video_container(const fs::path& path) {
  const InputFile file(path);
  const std::string head = file.text(0, std::size_t(std::min<std::uint64_t>(file.size(), kHeadBytes)));
  if (const std::string list = name_of_list(head); !list.empty())
    throw Error(path.string() + ": is " + list +
                ", not a video: the frames are in other files, whose changes would go unnoticed; name the video "
                "itself, or a folder of images");
  const char* const container = container_of(head);
  if (!container && is_named_like_a_video(path))
    throw Error(path.string() +
                ": is not a video, or is damaged at its start; marrow reads AVI, MP4, MOV, MKV, WebM, WMV and MPEG");
  if (container && container == "mov"sv) MovBoxes(file).check(0, file.size());
  return container;
}

}  // namespace marrow::read
