// SPDX-License-Identifier: Apache-2.0
#include "marrow/render/plot.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "marrow/base/number_text.hpp"
#include "marrow/toolbox/draw/canvas.hpp"

namespace marrow::draw {
namespace {

constexpr double kTextSize = 0.4;

struct Range {
  double low, high;
  double fraction(double value) const { return (value - low) / (high - low); }
};

/// The range of the finite values, slightly widened. Never empty, even if all values are equal or there are none.
Range range_of(const std::vector<double>& values, double margin) {
  Range range{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  for (double value : values)
    if (std::isfinite(value)) range = {std::min(range.low, value), std::max(range.high, value)};
  if (range.low > range.high) return {0, 1};
  double extra = margin * (range.high - range.low);
  if (range.high - range.low < 1e-12 * std::max(1.0, std::abs(range.high)))
    extra = std::max(1.0, 0.1 * std::abs(range.high));
  return {range.low - extra, range.high + extra};
}

std::string number(double value) { return formatted("{:.4g}", std::abs(value) < 1e-12 ? 0.0 : value); }

}  // namespace

std::vector<double> round_ticks(double low, double high, int count) {
  std::vector<double> ticks;
  if (!(high > low) || !std::isfinite(high - low)) return ticks;
  const double rough = (high - low) / count, power = std::pow(10, std::floor(std::log10(rough)));
  const double step = rough / power < 1.5   ? power
                      : rough / power < 3.5 ? 2 * power
                      : rough / power < 7.5 ? 5 * power
                                            : 10 * power;
  for (double i = std::ceil(low / step - 1e-9); i * step <= high + 1e-9 * step; ++i) ticks.push_back(i * step);
  return ticks;
}

void draw_plot(cv::Mat& canvas, const cv::Rect& area, const Plot& plot) {
  cv::Mat all = canvas(area);
  all.setTo(kWhite);
  const cv::Rect inside(64, 28, area.width - 64 - 14, area.height - 28 - 44);
  const Range x_range = range_of(plot.x, 0), y_range = range_of(plot.y, 0.06);
  const auto at = [&](double x, double y) {
    return cv::Point2d(inside.x + x_range.fraction(x) * inside.width,
                       inside.y + (1 - y_range.fraction(y)) * inside.height);
  };
  const cv::Scalar faint(225, 225, 225);
  for (double tick : round_ticks(x_range.low, x_range.high, 6)) {
    draw_line(all, at(tick, y_range.low), at(tick, y_range.high), faint);
    const std::string text = number(tick);
    draw_text(all, text, cv::Point(at(tick, y_range.low)) + cv::Point(-text_size(text, kTextSize).width / 2, 15),
              kBlack, kTextSize);
  }
  for (double tick : round_ticks(y_range.low, y_range.high, 5)) {
    draw_line(all, at(x_range.low, tick), at(x_range.high, tick), faint);
    const std::string text = number(tick);
    draw_text(all, text, cv::Point(at(x_range.low, tick)) + cv::Point(-text_size(text, kTextSize).width - 6, 4), kBlack,
              kTextSize);
  }
  draw_line(all, at(x_range.low, y_range.low), at(x_range.high, y_range.low), kBlack);
  draw_line(all, at(x_range.low, y_range.low), at(x_range.low, y_range.high), kBlack);
  for (const PlotMark& mark : plot.marks)
    if (mark.x >= x_range.low && mark.x <= x_range.high)
      draw_dashes(all, at(mark.x, y_range.low), at(mark.x, y_range.high), mark.colour, 2);
  for (std::size_t i = 1; i < plot.x.size(); ++i)
    if (std::isfinite(plot.y[i - 1]) && std::isfinite(plot.y[i]))
      draw_line(all, at(plot.x[i - 1], plot.y[i - 1]), at(plot.x[i], plot.y[i]), kBlue, 2);
  if (plot.dot && std::isfinite(plot.dot->y)) draw_dot(all, at(plot.dot->x, plot.dot->y), 5, kVermilion);
  draw_text(all, plot.title, {inside.x, 18}, kBlack, 0.48);
  draw_text(all, plot.x_label,
            {inside.x + (inside.width - text_size(plot.x_label, kTextSize).width) / 2, area.height - 10}, kBlack,
            kTextSize);
  draw_text(all, plot.y_label, {4, 18}, kBlack, kTextSize);
}

}  // namespace marrow::draw
