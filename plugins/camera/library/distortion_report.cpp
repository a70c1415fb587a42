// SPDX-License-Identifier: Apache-2.0
#include "marrow/camera/distortion_report.hpp"

#include "marrow/base/number_text.hpp"
#include "marrow/toolbox/draw/canvas.hpp"

namespace marrow::camera {

using namespace distortion;

FitOptions fit_options(const DistortionOptions& options) {
  FitOptions result;
  result.model = options.fit == "polynomial" ? Model::polynomial
                 : options.fit == "local"    ? Model::local
                                             : Model::automatic;
  result.lowest_degree = options.lowest_degree;
  result.highest_degree = options.highest_degree;
  result.outlier_deviations = options.outlier_deviations;
  return result;
}

Metrics figures_of(const Fit& fit) {
  const auto used = double(std::count(fit.points.used.begin(), fit.points.used.end(), 1));
  const Shape shape = shape_of(fit.distortion, fit.points);
  Metrics figures{{{"points", used, ""},
                   {"outliers", double(fit.points.used.size()) - used, ""},
                   {"degree", double(fit.distortion.degree), ""},
                   {"local", fit.is_local ? 1.0 : 0.0, ""},
                   {"residual", fit.distortion.residual_px, "px"},
                   {"validated", fit.distortion.validated_px, "px"},
                   {"turn", shape.turn_deg, "deg"},
                   {"pincushion", shape.pincushion_px, "px"},
                   {"rim", shape.rim_px, "px"}}};
  for (const auto& [degree, residual] : fit.validated_by_degree_px)
    figures.items.push_back({formatted("validated_degree_{}", degree), residual, "px"});
  return figures;
}

void warn_of_fit(const Fit& fit, const Context& context) {
  const auto used = std::size_t(std::count(fit.points.used.begin(), fit.points.used.end(), 1));
  const std::size_t outliers = fit.points.used.size() - used;
  if (20 * outliers > fit.points.used.size())
    context.warn(formatted("{} of {} points do not fit and are left out; look at the picture", outliers,
                           fit.points.used.size()));
  if (fit.distortion.validated_px > 1.5 * fit.distortion.residual_px)
    context.warn(
        formatted("points that the fit did not see lie {:.2f} px from it, those that it saw {:.2f} px; lower "
                  "highest_degree, or show more dots",
                  fit.distortion.validated_px, fit.distortion.residual_px));
}

Picture picture_of(const Image& image, const Fit& fit, const DistortionOptions& options) {
  using namespace draw;
  View shown{"plate", image, {}, {}};
  if (image.pixels.empty())
    shown.image.pixels = cv::Mat1b(fit.points.height_px, fit.points.width_px, std::uint8_t(128));
  shown.camera.width_px = shown.image.width();
  shown.camera.height_px = shown.image.height();
  Panel panel = make_panel(shown, whole_image(shown), options.size_px, Contrast::linear);
  const auto at = [&](const Eigen::Vector2d& pixel) { return panel.at(pixel.x(), pixel.y()); };
  const std::vector<Eigen::Vector2d>& area = fit.distortion.area_px;
  constexpr int kParts = 8;  // of a side, which is bent in the original image
  for (std::size_t i = 0; i < area.size(); ++i) {
    const Eigen::Vector2d step = (area[(i + 1) % area.size()] - area[i]) / kParts;
    for (int part = 0; part < kParts; ++part)
      draw_line(panel.pixels, at(seen_pixel(fit.distortion, area[i] + part * step)),
                at(seen_pixel(fit.distortion, area[i] + (part + 1) * step)), kSkyBlue, 2);
  }
  for (std::size_t i = 0; i < fit.points.used.size(); ++i) {
    const Eigen::Vector2d seen = fit.points.seen_px[i];
    if (fit.points.used[i]) {
      const Eigen::Vector2d rest = seen - seen_pixel(fit.distortion, fit.points.ideal_px[i]);
      draw_line(panel.pixels, at(seen), at(seen + options.residual_scale * rest), kVermilion, 1);
    }
    draw_dot(panel.pixels, at(seen), fit.points.used[i] ? 1.5 : 3, fit.points.used[i] ? kGreen : kYellow);
  }
  const std::string scale = formatted("residual x {:g}", options.residual_scale);
  return {with_legend(panel.pixels,
                      {{"dot", kGreen}, {scale, kVermilion}, {"left out", kYellow}, {"measured area", kSkyBlue}})};
}

}  // namespace marrow::camera
