// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/draw/canvas.hpp"

#include <algorithm>
#include <cmath>
#include <marrow/domain/quantile.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>
#include <string_view>

#include "marrow/base/number_text.hpp"
#include "marrow/toolbox/image/grey_values.hpp"

namespace marrow::draw {
namespace {

constexpr char32_t kFirstLetter = 0xC0, kLastLetter = 0x17F, kNoLetter = 0xFFFD;

/// U+00C0 to U+017F without their marks, by Unicode's decompositions; those without one as they are usually written.
constexpr const char* kLetters =
    "A A A A A A AE C E E E E I I I I D N O O O O O x O U U U U Y Th ss "
    "a a a a a a ae c e e e e i i i i d n o o o o o / o u u u u y th y "
    "A a A a A a C c C c C c C c D d D d E e E e E e E e E e G g G g "
    "G g G g H h H h I i I i I i I i I i IJ ij J j K k k L l L l L l L "
    "l L l N n N n N n 'n N n O o O o O o OE oe R r R r R r S s S s S s "
    "S s T t T t T t U u U u U u U u U u U u W w Y y Y Z z Z z Z z s";

constexpr struct {
  char32_t sign;
  const char* plain;
} kSigns[] = {{0xA0, " "},   {0xB0, " deg"}, {0xB1, "+-"},   {0xB2, "2"},    {0xB3, "3"},
              {0xB5, "u"},   {0x3BC, "u"},   {0x2013, "-"},  {0x2014, "-"},  {0x2018, "'"},
              {0x2019, "'"}, {0x201C, "\""}, {0x201D, "\""}, {0x2026, "..."}};

std::vector<std::string> split(const char* words) {
  std::istringstream stream(words);
  std::vector<std::string> all;
  for (std::string word; stream >> word;) all.push_back(word);
  return all;
}

std::string in_ascii(char32_t letter) {
  static const std::vector<std::string> kPlain = split(kLetters);
  if (letter < 0x80) return std::string(1, char(letter));
  if (letter >= kFirstLetter && letter <= kLastLetter) return kPlain.at(letter - kFirstLetter);
  if (letter >= 0x300 && letter <= 0x36F) return "";  // a mark on the letter before it
  for (const auto& [sign, plain] : kSigns)
    if (sign == letter) return plain;
  return "?";
}

/// A text in ASCII, as OpenCV's fonts can draw it: letters of Latin languages lose their marks ("ü" becomes "u", "ß"
/// "ss"), dashes, quotes and a few signs become the nearest ones, and every other character is one question mark.
std::string in_plain_letters(const std::string& text) {
  std::string plain;
  for (std::size_t i = 0; i < text.size();) {
    const auto lead = static_cast<unsigned char>(text[i]);
    const bool is_stray = lead >= 0x80 && lead < 0xC0;
    const int more = lead < 0xC0 ? 0 : lead < 0xE0 ? 1 : lead < 0xF0 ? 2 : 3;
    char32_t letter = is_stray ? kNoLetter : more == 0 ? lead : lead & (0x3F >> more);
    ++i;
    for (int k = 0; k < more && i < text.size() && (static_cast<unsigned char>(text[i]) & 0xC0) == 0x80; ++k, ++i)
      letter = letter << 6 | (static_cast<unsigned char>(text[i]) & 0x3F);
    plain += in_ascii(letter);
  }
  return plain;
}

constexpr int kShift = 4;  // OpenCV draws at positions of 1/16 pixel

/// Whether a position can be drawn. Fixed-point coordinates overflow far outside the canvas.
bool drawable(cv::Point2d p) { return std::abs(p.x) < 1e5 && std::abs(p.y) < 1e5; }
cv::Point fixed_point(cv::Point2d p) {
  return {int(std::lround(p.x * (1 << kShift))), int(std::lround(p.y * (1 << kShift)))};
}

cv::Mat stretched(const cv::Mat& image, const cv::Mat& mask, Contrast contrast) {
  cv::Mat values;
  image.convertTo(values, CV_32F);
  const cv::Mat finite = cv::abs(values) <= 1e30f;  // false for NaN and infinities
  values.setTo(0, ~finite);
  // Detector values fall exponentially with the thickness of tissue. Line integrals show bone equally well under thick
  // and thin tissue.
  if (contrast != Contrast::linear) values = -image::line_integrals(values);
  std::vector<float> used;
  for (int v = 0; v < values.rows; ++v)
    for (int u = 0; u < values.cols; ++u)
      if (finite.at<unsigned char>(v, u) && (mask.empty() || mask.at<unsigned char>(v, u)))
        used.push_back(values.at<float>(v, u));
  const double low = used.empty() ? 0 : quantile_in_place(used, 0.005),
               high = used.empty() ? 0 : quantile_in_place(used, 0.995);
  cv::Mat grey(values.size(), CV_8U, cv::Scalar(128));
  if (high > low) values.convertTo(grey, CV_8U, 255.0 / (high - low), -255.0 * low / (high - low));
  if (high > low && contrast == Contrast::local) cv::createCLAHE(3.0, {8, 8})->apply(grey, grey);
  grey.setTo(0, ~finite);
  return grey;
}

}  // namespace

Contrast contrast_of(const std::string& name) {
  return name == "linear" ? Contrast::linear : name == "logarithmic" ? Contrast::logarithmic : Contrast::local;
}

Panel make_panel(const View& view, const cv::Rect& part, int size_px, Contrast contrast) {
  check_view(view);
  if (view.image.pixels.channels() != 1)
    throw Error(
        formatted("view '{}': the image has {} channels; an X-ray has one", view.name, view.image.pixels.channels()));
  const cv::Mat grey = stretched(view.image.pixels(part), view.mask.empty() ? view.mask : view.mask(part), contrast);
  Panel panel;
  panel.corner_px = part.tl();
  panel.scale = double(size_px) / std::max(grey.cols, grey.rows);
  const auto scaled = [&](int length) { return std::max(1, int(std::lround(length * panel.scale))); };
  cv::Mat resized;
  cv::resize(grey, resized, {scaled(grey.cols), scaled(grey.rows)}, 0, 0,
             panel.scale < 1 ? cv::INTER_AREA : cv::INTER_LINEAR);
  cv::cvtColor(resized, panel.pixels, cv::COLOR_GRAY2RGB);
  return panel;
}

void draw_line(cv::Mat& canvas, cv::Point2d from, cv::Point2d to, const cv::Scalar& colour, int thickness) {
  if (!drawable(from) || !drawable(to)) return;
  cv::line(canvas, fixed_point(from), fixed_point(to), colour, thickness, cv::LINE_AA, kShift);
}

void draw_dashes(cv::Mat& canvas, cv::Point2d from, cv::Point2d to, const cv::Scalar& colour, int thickness) {
  if (!drawable(from) || !drawable(to)) return;
  const double length = cv::norm(to - from), dash = 6;
  for (double at = 0; at < length; at += 2 * dash) {
    const cv::Point2d first = from + (to - from) * (at / length);
    draw_line(canvas, first, from + (to - from) * (std::min(at + dash, length) / length), colour, thickness);
  }
}

void draw_dot(cv::Mat& canvas, cv::Point2d at, double radius, const cv::Scalar& colour) {
  if (!drawable(at)) return;
  cv::circle(canvas, fixed_point(at), int(std::lround(radius * (1 << kShift))), colour, cv::FILLED, cv::LINE_AA,
             kShift);
}

void draw_text(cv::Mat& canvas, const std::string& text, cv::Point at, const cv::Scalar& colour, double size) {
  cv::putText(canvas, in_plain_letters(text), at, cv::FONT_HERSHEY_SIMPLEX, size, colour, 1, cv::LINE_AA);
}

cv::Size text_size(const std::string& text, double size) {
  int baseline = 0;
  return cv::getTextSize(in_plain_letters(text), cv::FONT_HERSHEY_SIMPLEX, size, 1, &baseline);
}

void draw_segment(Panel& panel, const LineSegment& segment, const cv::Scalar& colour, int thickness) {
  draw_line(panel.pixels, panel.at(segment.from_px.x(), segment.from_px.y()),
            panel.at(segment.to_px.x(), segment.to_px.y()), colour, thickness);
}

void draw_edges(Panel& panel, const EdgeMap& edges, const cv::Scalar& colour) {
  const int size = std::max(1, int(std::lround(panel.scale)));  // one image pixel
  for (const EdgePixel& edge : edges.pixels) {
    const cv::Point2d at = panel.at(edge.u_px, edge.v_px);
    if (!drawable(at)) continue;
    const cv::Point corner(int(std::lround(at.x - 0.5 * (size - 1))), int(std::lround(at.y - 0.5 * (size - 1))));
    cv::Mat dot = panel.pixels(cv::Rect(corner, cv::Size(size, size)) & cv::Rect({0, 0}, panel.pixels.size()));
    if (!dot.empty()) cv::addWeighted(dot, 0.5, cv::Mat(dot.size(), CV_8UC3, colour), 0.5, 0, dot);
  }
}

cv::Mat with_legend(const cv::Mat& picture, const std::vector<LegendItem>& items) {
  // Pages show a picture smaller than it is, so that the letters of a large one must be larger.
  const double size = std::clamp(picture.cols / 1100.0, 0.5, 1.2);
  const int row = int(48 * size), stroke = int(48 * size), gap = int(16 * size);
  std::vector<cv::Point> places;
  cv::Point at(gap, 0);
  for (const LegendItem& item : items) {
    const int width = stroke + gap + text_size(item.text, size).width + 2 * gap;
    if (at.x > gap && at.x + width > picture.cols) at = {gap, at.y + row};
    places.push_back(at);
    at.x += width;
  }
  cv::Mat result(picture.rows + (items.empty() ? 0 : at.y + row), picture.cols, CV_8UC3, kDark);
  picture.copyTo(result(cv::Rect({0, 0}, picture.size())));
  for (std::size_t i = 0; i < items.size(); ++i) {
    const cv::Point middle(places[i].x, picture.rows + places[i].y + row / 2);
    draw_line(result, middle, middle + cv::Point(stroke, 0), items[i].colour, int(6 * size));
    draw_text(result, items[i].text, middle + cv::Point(stroke + gap, int(10 * size)), kWhite, size);
  }
  return result;
}

void draw_title(Panel& panel, const std::string& title) {
  const cv::Rect box({0, 0}, cv::Size(text_size(title, 0.6).width + 20, 32));
  panel.pixels(box & cv::Rect({0, 0}, panel.pixels.size())).setTo(kDark);  // readable over air and over bone
  draw_text(panel.pixels, title, {10, 22}, kWhite, 0.6);
}

}  // namespace marrow::draw
