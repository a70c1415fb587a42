// SPDX-License-Identifier: Apache-2.0
// Videos by FFmpeg's libraries. OpenCV, which uses them too, cuts every frame to 8 bits, and opens every other file
// that a video names.
#include "video.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/toolbox/files/input_file.hpp"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/display.h>
#include <libavutil/frame.h>
#include <libavutil/pixdesc.h>
}

namespace marrow::read {
namespace {

namespace fs = std::filesystem;

struct Release {
  void operator()(AVFormatContext* container) const { avformat_close_input(&container); }
  void operator()(AVCodecContext* decoder) const { avcodec_free_context(&decoder); }
  void operator()(AVFrame* frame) const { av_frame_free(&frame); }
  void operator()(AVPacket* packet) const { av_packet_free(&packet); }
  void operator()(AVIOContext* bytes) const {
    av_freep(&bytes->buffer);
    avio_context_free(&bytes);
  }
};
template <class T>
using Held = std::unique_ptr<T, Release>;

/// The bytes of the file, for FFmpeg.
struct Source {
  const files::InputFile& file;
  std::int64_t at = 0;
};

int take(void* opaque, std::uint8_t* to, int most) {
  Source& source = *static_cast<Source*>(opaque);
  const std::int64_t count = std::min<std::int64_t>(most, std::int64_t(source.file.size()) - source.at);
  if (count <= 0) return AVERROR_EOF;
  try {
    source.file.read(std::uint64_t(source.at), to, std::size_t(count));
  } catch (const Error&) {  // no exception may pass through FFmpeg
    return AVERROR(EIO);
  }
  source.at += count;
  return int(count);
}

std::int64_t go_to(void* opaque, std::int64_t offset, int whence) {
  Source& source = *static_cast<Source*>(opaque);
  const std::int64_t size = std::int64_t(source.file.size());
  if (whence == AVSEEK_SIZE) return size;
  whence &= ~AVSEEK_FORCE;
  const std::int64_t at = offset + (whence == SEEK_CUR ? source.at : whence == SEEK_END ? size : 0);
  return at < 0 ? AVERROR(EINVAL) : source.at = at;
}

int refuse_other_file(AVFormatContext*, AVIOContext**, const char*, int, AVDictionary**) { return AVERROR(EACCES); }

class Video {
 public:
  Video(const fs::path& path, const char* container) : file_(path) {
    constexpr int kBufferBytes = 1 << 16;
    av_log_set_level(AV_LOG_QUIET);  // what matters of it becomes an Error
    bytes_.reset(avio_alloc_context(static_cast<std::uint8_t*>(av_malloc(kBufferBytes)), kBufferBytes, 0, &source_,
                                    take, nullptr, go_to));
    AVFormatContext* opened = avformat_alloc_context();
    opened->pb = bytes_.get();
    opened->io_open = refuse_other_file;
    if (avformat_open_input(&opened, "", av_find_input_format(container), nullptr) < 0) fail_to_open();  // frees it
    container_.reset(opened);
    if (avformat_find_stream_info(opened, nullptr) < 0) fail_to_open();
    const int found = av_find_best_stream(opened, AVMEDIA_TYPE_VIDEO, -1, -1, nullptr, 0);
    if (found < 0) throw Error(what() + ": holds no pictures that FFmpeg finds");
    stream_ = opened->streams[found];
    check_is_upright();
    open_decoder();
  }

  std::string what() const { return file_.path().string(); }

  /// Number of frames by the header; 0 if it does not give one.
  long frames_told() const {
    if (stream_->nb_frames > 0) return long(stream_->nb_frames);
    const AVRational rate = av_guess_frame_rate(container_.get(), stream_, nullptr);
    const double duration_s = double(std::max<std::int64_t>(0, container_->duration)) / AV_TIME_BASE;
    return rate.den > 0 ? long(std::floor(duration_s * av_q2d(rate) + 0.5)) : 0;
  }

  /// The next frame; nullptr at the end, or where is_damaged().
  const AVFrame* next() {
    while (!is_damaged_) {
      const int got = avcodec_receive_frame(decoder_.get(), frame_.get());
      if (got == AVERROR_EOF) return nullptr;
      is_damaged_ = got == 0 ? !is_whole() : got != AVERROR(EAGAIN) || !send_packet();
      if (got == 0 && !is_damaged_) return frame_.get();
    }
    return nullptr;
  }

  /// Whether there is a next frame that cannot be decoded.
  bool is_damaged() const { return is_damaged_; }

 private:
  [[noreturn]] void fail_to_open() const {
    throw Error(what() + ": cannot be decoded as a video; it is cut off or damaged: copy or export it again");
  }

  void check_is_upright() const {
    const std::uint8_t* const matrix = av_stream_get_side_data(stream_, AV_PKT_DATA_DISPLAYMATRIX, nullptr);
    if (!matrix) return;
    const std::int32_t* const m = reinterpret_cast<const std::int32_t*>(matrix);
    if (m[0] <= 0 || m[4] <= 0 || m[1] != 0 || m[3] != 0)
      throw Error(what() +
                  ": is to be shown turned or mirrored (its header has a display matrix), but its frames are not; save "
                  "it turned");
  }

  void open_decoder() {
    const AVCodecParameters& parameters = *stream_->codecpar;
    const AVCodec* const codec = avcodec_find_decoder(parameters.codec_id);
    if (!codec) {
      char mark[AV_FOURCC_MAX_STRING_SIZE];
      throw Error(what() + ": its frames are compressed by '" + av_fourcc_make_string(mark, parameters.codec_tag) +
                  "', for which FFmpeg has no decoder here; convert it, to FFV1 for example");
    }
    decoder_.reset(avcodec_alloc_context3(codec));
    if (avcodec_parameters_to_context(decoder_.get(), &parameters) < 0 ||
        avcodec_open2(decoder_.get(), codec, nullptr) < 0)
      fail_to_open();
  }

  bool is_whole() const { return frame_->decode_error_flags == 0 && !(frame_->flags & AV_FRAME_FLAG_CORRUPT); }

  /// Gives the decoder the next packet, or tells it that there is none. Returns false where the file is damaged.
  bool send_packet() {
    while (true) {
      const int got = av_read_frame(container_.get(), packet_.get());
      if (got == AVERROR_EOF) return avcodec_send_packet(decoder_.get(), nullptr) == 0;
      if (got < 0) return false;
      const bool is_wanted = packet_->stream_index == stream_->index, is_cut_off = packet_->flags & AV_PKT_FLAG_CORRUPT;
      const int sent = is_wanted && !is_cut_off ? avcodec_send_packet(decoder_.get(), packet_.get()) : 0;
      av_packet_unref(packet_.get());
      if (is_wanted) return sent == 0 && !is_cut_off;
    }
  }

  const files::InputFile file_;
  Source source_{file_};
  Held<AVIOContext> bytes_;  // outlives the container, which reads from it
  Held<AVFormatContext> container_;
  AVStream* stream_ = nullptr;
  Held<AVCodecContext> decoder_;
  const Held<AVFrame> frame_{av_frame_alloc()};
  const Held<AVPacket> packet_{av_packet_alloc()};
  bool is_damaged_ = false;
};

Image image_of(const Video& video, const AVFrame& frame, int number) {
  const auto grey = grey_of(frame);
  if (!grey)
    throw Error(formatted("{}: frame {} has a kind of pixels that is not read; expected 8 to 16 bits of grey or colour",
                          video.what(), number));
  return {*grey};
}

/// What turns stored levels into levels from 0 to the highest of their bits. Most videos with colours keep black at 16
/// and white at 235 of 255.
struct Levels {
  int black = 0, range = 255, highest = 255;
  int of(int stored) const {
    if (black == 0) return stored;
    const double level = double(stored - black) * highest / range;
    return std::clamp(int(std::lround(level)), 0, highest);
  }
};

Levels levels_of(const AVFrame& frame, const AVPixFmtDescriptor& kind, int bits) {
  const int highest = (1 << bits) - 1;
  const bool has_brightness = !(kind.flags & AV_PIX_FMT_FLAG_RGB) && kind.nb_components >= 3;
  const bool is_full = frame.color_range == AVCOL_RANGE_JPEG || frame.format == AV_PIX_FMT_YUVJ420P ||
                       frame.format == AV_PIX_FMT_YUVJ422P || frame.format == AV_PIX_FMT_YUVJ444P ||
                       frame.format == AV_PIX_FMT_YUVJ440P || frame.format == AV_PIX_FMT_YUVJ411P;
  if (!has_brightness || is_full) return {0, highest, highest};
  return {16 << (bits - 8), 219 << (bits - 8), highest};
}

/// One row of one component.
void read_row(const AVFrame& frame, const AVPixFmtDescriptor& kind, int row, int component, bool by_palette,
              std::vector<std::uint16_t>& values) {
  av_read_image_line2(values.data(), const_cast<const std::uint8_t**>(frame.data), frame.linesize, &kind, 0, row,
                      component, frame.width, by_palette, sizeof(std::uint16_t));
}

}  // namespace

std::vector<Image> read_video(const fs::path& path, const char* container, const files::FrameRange& range) {
  Video video(path, container);
  std::vector<Image> images;
  int count = 0;
  while (range.last == 0 || count < range.last) {
    const AVFrame* const frame = video.next();
    if (!frame) break;
    ++count;
    if (count < range.first || (count - range.first) % range.every != 0) continue;
    images.push_back(image_of(video, *frame, count));
    const cv::Mat &first = images.front().pixels, &now = images.back().pixels;
    if (now.size() != first.size() || now.type() != first.type())
      throw Error(formatted("{}: frame {} has another size or other bits than the first", path.string(), count));
  }
  if (const long told = video.frames_told(); range.last == 0 && count < told)
    throw Error(formatted("{}: says that it has {} frames, but only {} can be decoded; to read these, set last to {}",
                          path.string(), told, count, count));
  if (video.is_damaged())
    throw Error(formatted("{}: frame {} is cut off or damaged; to read those before it, set last to {}", path.string(),
                          count + 1, count));
  files::frames_of(range, count, path.string());  // throws if the first or the last frame is missing
  return images;
}

std::optional<cv::Mat> grey_of(const AVFrame& frame) {
  const AVPixFmtDescriptor* const kind = av_pix_fmt_desc_get(AVPixelFormat(frame.format));
  constexpr std::uint64_t kNotRead = AV_PIX_FMT_FLAG_HWACCEL | AV_PIX_FMT_FLAG_BAYER | AV_PIX_FMT_FLAG_FLOAT;
  if (!kind || kind->flags & kNotRead || kind->nb_components < 1) return std::nullopt;
  const bool by_palette = kind->flags & AV_PIX_FMT_FLAG_PAL, has_colours = kind->flags & AV_PIX_FMT_FLAG_RGB;
  int bits = 8;
  for (int k = 0; k < (has_colours && !by_palette ? 3 : 1); ++k) bits = std::max(bits, kind->comp[k].depth);
  if (bits > 16 || (has_colours && !by_palette && kind->comp[1].depth < 8)) return std::nullopt;
  if (!has_colours && kind->comp[0].depth < 8) return std::nullopt;
  const Levels levels = levels_of(frame, *kind, bits);
  const bool has_three = has_colours || by_palette;
  std::array<std::vector<std::uint16_t>, 3> rows;
  for (auto& row : rows) row.resize(std::size_t(frame.width));
  cv::Mat grey(frame.height, frame.width, bits > 8 ? CV_16U : CV_8U);
  for (int v = 0; v < frame.height; ++v) {
    for (int k = 0; k < (has_three ? 3 : 1); ++k)
      read_row(frame, *kind, v, by_palette ? 2 - k : k, by_palette,
               rows[std::size_t(k)]);  // a palette begins with blue
    for (int u = 0; u < frame.width; ++u) {
      const std::size_t at = std::size_t(u);
      const int level = has_three ? int(std::lround(0.299 * rows[0][at] + 0.587 * rows[1][at] + 0.114 * rows[2][at]))
                                  : levels.of(rows[0][at]);
      if (bits > 8)
        grey.at<std::uint16_t>(v, u) = std::uint16_t(level);
      else
        grey.at<std::uint8_t>(v, u) = std::uint8_t(level);
    }
  }
  return grey;
}

}  // namespace marrow::read

extern "C" {
#include <libavutil/frame.h>
#include <libavutil/pixdesc.h>
}
