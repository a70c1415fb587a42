// SPDX-License-Identifier: Apache-2.0
#include "video.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

extern "C" {
#include <libavutil/frame.h>
#include <libavutil/pixdesc.h>
}

namespace marrow::read {
namespace {

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
