// SPDX-License-Identifier: Apache-2.0
// Calibration of an X-ray device from images of a board with beads on both sides (Tsai 1987).
#include <algorithm>
#include <cmath>
#include <marrow/plugin.hpp>

#include "marrow/domain/quantile.hpp"
#include "marrow/toolbox/calibration/board.hpp"
#include "marrow/toolbox/calibration/plausibility.hpp"
#include "marrow/toolbox/draw/canvas.hpp"
#include "marrow/toolbox/files/atomic_write.hpp"
#include "marrow/toolbox/files/yaml_text.hpp"

namespace {

using namespace marrow;
using calibration::CalibrationModel, calibration::CalibrationResult, calibration::ViewPoints;

struct BeadBoardOptions {
  std::filesystem::path board;
  int radial_terms = 2;
  bool square_pixels = false;
  double largest_bead_px = 0;
  double min_contrast = 0.2;
  double outlier_deviations = 5;
  double residual_scale = 50;
  int size_px = 800;
};

struct BeadBoardResult {
  List<Camera> cameras;
  Calibration calibration;
  Metrics metrics;
  List<Metrics> view_metrics;
  List<Picture> pictures;
};

struct Outliers {
  int count = 0;
  std::vector<std::vector<Eigen::Vector2d>> pixels;  ///< per view
};

/// Removes beads whose residual exceeds `deviations` standard deviations. The deviation is estimated from the median of
/// all residuals. Returns true if a bead was removed.
bool take_outliers(std::vector<ViewPoints>& views, const CalibrationResult& fit, double deviations,
                   Outliers& outliers) {
  std::vector<double> sizes;
  for (const auto& view : fit.views)
    for (const auto& residual : view.residuals_px) sizes.push_back(residual.norm());
  // For a normal distribution in two directions, the median length is 1.177 standard deviations.
  const double limit = deviations * std::max(quantile_in_place(sizes, 0.5) / 1.17741, 1e-6);
  bool any = false;
  for (std::size_t n = 0; n < views.size(); ++n) {
    ViewPoints kept{views[n].name, {}, {}, {}};
    for (std::size_t i = 0; i < views[n].pixels.size(); ++i) {
      if (fit.views[n].residuals_px[i].norm() > limit) {
        outliers.pixels[n].push_back(views[n].pixels[i]);
        ++outliers.count;
        any = true;
        continue;
      }
      kept.board_mm.push_back(views[n].board_mm[i]);
      kept.pixels.push_back(views[n].pixels[i]);
      kept.beads.push_back(views[n].beads[i]);
    }
    views[n] = std::move(kept);
  }
  return any;
}

CalibrationResult calibrate_without_outliers(std::vector<ViewPoints>& views, int width_px, int height_px,
                                             const BeadBoardOptions& options, Outliers& outliers) {
  const CalibrationModel model{options.radial_terms, options.square_pixels, true};
  outliers.pixels.resize(views.size());
  CalibrationResult fit = calibration::calibrate(views, width_px, height_px, model);
  for (int round = 0; round < 3 && take_outliers(views, fit, options.outlier_deviations, outliers); ++round)
    fit = calibration::calibrate(views, width_px, height_px, model);
  return fit;
}

double root_mean_square(const std::vector<Eigen::Vector2d>& residuals) {
  double squares = 0;
  for (const auto& residual : residuals) squares += residual.squaredNorm();
  return std::sqrt(squares / (2 * double(residuals.size())));
}

Metrics report_of(const CalibrationResult& fit, const Outliers& outliers) {
  const Calibration& c = fit.calibration;
  Metrics report;
  const auto add = [&](const std::string& name, double value, const std::string& unit) {
    report.items.push_back({name, value, unit});
  };
  double beads = 0, worst = 0;
  for (const auto& view : fit.views) {
    beads += double(view.residuals_px.size());
    for (const auto& residual : view.residuals_px) worst = std::max(worst, residual.norm());
  }
  add("residual", c.residual_px, "px");
  add("worst_residual", worst, "px");
  add("beads", beads, "");
  add("outliers", outliers.count, "");
  const char* axes[] = {"u", "v"};
  for (int i : {0, 1}) {
    add(std::string("focal_") + axes[i], c.intrinsics(i, i), "px");
    add(std::string("focal_") + axes[i] + "_deviation", c.focal_deviation_px[i], "px");
    add(std::string("principal_") + axes[i], c.intrinsics(i, 2), "px");
    add(std::string("principal_") + axes[i] + "_deviation", c.principal_deviation_px[i], "px");
  }
  for (std::size_t i = 0; i < 3; ++i) {
    add(formatted("k{}", i + 1), c.distortion.k[i], "");
    add(formatted("k{}_deviation", i + 1), c.distortion_deviation[i], "");
  }
  return report;
}

Metrics pose_report(const calibration::CalibratedView& view) {
  Metrics report{
      {{"beads", double(view.residuals_px.size()), ""}, {"residual", root_mean_square(view.residuals_px), "px"}}};
  const char* directions[] = {"x", "y", "z"};
  for (int i = 0; i < 3; ++i)
    report.items.push_back(
        {std::string("rotation_") + directions[i] + "_deviation", degrees(view.deviation[i]), "deg"});
  for (int i = 0; i < 3; ++i)
    report.items.push_back({std::string("translation_") + directions[i] + "_deviation", view.deviation[3 + i], "mm"});
  return report;
}

/// The image with the beads found, their residuals, and the beads left out.
Picture picture_of(const Image& image, const ViewPoints& points, const calibration::CalibratedView& view,
                   const std::vector<Eigen::Vector2d>& outliers, const BeadBoardOptions& options) {
  using namespace draw;
  View shown{points.name, image, {}, {}};
  shown.camera.width_px = image.width();
  shown.camera.height_px = image.height();
  Panel panel = make_panel(shown, whole_image(shown), options.size_px, Contrast::logarithmic);
  for (std::size_t i = 0; i < points.pixels.size(); ++i) {
    const Eigen::Vector2d at = points.pixels[i], end = at + options.residual_scale * view.residuals_px[i];
    draw_line(panel.pixels, panel.at(at.x(), at.y()), panel.at(end.x(), end.y()), kVermilion, 2);
    draw_dot(panel.pixels, panel.at(at.x(), at.y()), 2, kGreen);
  }
  for (const auto& at : outliers) draw_dot(panel.pixels, panel.at(at.x(), at.y()), 4, kYellow);
  draw_title(panel, points.name);
  const std::string scale = formatted("residual x {:g}", options.residual_scale);
  return {with_legend(panel.pixels, {{"bead", kGreen}, {scale, kVermilion}, {"left out", kYellow}})};
}

void check_images(const List<Image>& images) {
  if (images.size() < 3)
    throw Error(
        formatted("{} images of the board are given; at least 3 are needed, and 8 are better, with the board tilted "
                  "differently in each",
                  images.size()));
  for (std::size_t i = 1; i < images.size(); ++i)
    if (images[i].pixels.size() != images[0].pixels.size())
      throw Error(formatted("image '{}' has {} x {} pixels, '{}' {} x {}; one calibration is for one size",
                            images.name(i), images[i].width(), images[i].height(), images.name(0), images[0].width(),
                            images[0].height()));
}

BeadBoardResult bead_board(const List<Image>& images, const BeadBoardOptions& options, Context& context) {
  check_images(images);
  const calibration::Board board = calibration::read_board_file(options.board);
  const int width = images[0].width(), height = images[0].height();
  std::vector<ViewPoints> views;
  for (std::size_t i = 0; i < images.size(); ++i) {
    context.check_cancelled();
    const auto discs = calibration::find_beads(images[i], {options.largest_bead_px, options.min_contrast});
    views.push_back(calibration::match_board(board, discs, width, height, images.name(i)));
    context.progress(double(i + 1) / double(images.size()), "views");
  }
  Outliers outliers;
  const CalibrationResult fit = calibrate_without_outliers(views, width, height, options, outliers);
  BeadBoardResult result;
  result.calibration = fit.calibration;
  check_distortion(fit.calibration.intrinsics, fit.calibration.distortion, width, height, "the calibration");
  if (const std::string text = calibration::doubtful_focal_length(fit.calibration, "the images"); !text.empty())
    context.warn(text);
  result.metrics = report_of(fit, outliers);
  for (std::size_t n = 0; n < views.size(); ++n) {
    result.cameras.add(views[n].name, {width, height, fit.calibration.intrinsics, fit.views[n].camera_from_world});
    result.view_metrics.add(views[n].name, pose_report(fit.views[n]));
    result.pictures.add(views[n].name, picture_of(images[n], views[n], fit.views[n], outliers.pixels[n], options));
  }
  return result;
}

void put_terms(YAML::Emitter& out, const std::array<double, 3>& values) {
  files::put_vector(out << YAML::Key << "radial_distortion" << YAML::Value,
                    Eigen::Map<const Eigen::Vector3d>(values.data()));
}

void write_calibration(const Calibration& c, const std::string& path) {
  using YAML::Key, YAML::Value;
  YAML::Emitter out;
  out << YAML::BeginMap << Key << "marrow-calibration" << Value << 1;
  out << Key << "width_px" << Value << c.width_px << Key << "height_px" << Value << c.height_px;
  files::put_matrix(out << Key << "intrinsics" << Value, c.intrinsics);
  put_terms(out, c.distortion.k);
  out << YAML::Comment(
      "seen = (1 + k1 r^2 + k2 r^4 + k3 r^6) ideal, pixels from the principal point over the focal length");
  out << Key << "deviation" << Value << YAML::Comment("one standard deviation") << YAML::BeginMap;
  files::put_vector(out << Key << "focal_px" << Value, c.focal_deviation_px);
  files::put_vector(out << Key << "principal_px" << Value, c.principal_deviation_px);
  put_terms(out, c.distortion_deviation);
  out << YAML::EndMap << Key << "residual_px" << Value << files::number(c.residual_px) << YAML::EndMap;
  files::write_text(path, files::text_of(out));
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("camera.bead_board", bead_board)
      .summary(
          "Calibration from images of a board with beads on both sides (Tsai 1987), with radial distortion and "
          "uncertainties")
      .in("images", "images of the board in at least 3 poses, not corrected for distortion", over("view"))
      .out("camera", &BeadBoardResult::cameras,
           "camera of each view, without distortion; the world frame is the board's frame", over("view"))
      .out("calibration", &BeadBoardResult::calibration,
           "camera matrix and distortion of the device, with standard deviations")
      .out("metrics", &BeadBoardResult::metrics,
           "the same as figures, with the residuals and the numbers of beads and outliers")
      .figures({"residual", "worst_residual", "beads", "outliers", "focal_u", "focal_u_deviation", "principal_u",
                "principal_u_deviation", "focal_v", "focal_v_deviation", "principal_v", "principal_v_deviation", "k1",
                "k1_deviation", "k2", "k2_deviation", "k3", "k3_deviation"})
      .out("view_metrics", &BeadBoardResult::view_metrics,
           "per view: number of beads, residual, and standard deviations of the camera's pose along and about its own "
           "axes",
           over("view"))
      .figures({"beads", "residual", "rotation_x_deviation", "rotation_y_deviation", "rotation_z_deviation",
                "translation_x_deviation", "translation_y_deviation", "translation_z_deviation"})
      .out("picture", &BeadBoardResult::pictures, "each image with the beads found and their residuals", over("view"))
      .option("board", &BeadBoardOptions::board, "file with the positions of the board's beads (YAML, docs/case.md)",
              required())
      .option("radial_terms", &BeadBoardOptions::radial_terms,
              "number of terms of the radial distortion (r^2, r^4, r^6)", at_least(0), at_most(3))
      .option("square_pixels", &BeadBoardOptions::square_pixels, "use one focal length for both directions")
      .option("largest_bead_px", &BeadBoardOptions::largest_bead_px,
              "diameter of the largest bead in the images; 0: a sixteenth of the image width", at_least(0))
      .option("min_contrast", &BeadBoardOptions::min_contrast,
              "smallest contrast of a bead, as a fraction of the contrast of the darkest bead", at_least(0.01),
              at_most(1), unit("1"))
      .option("outlier_deviations", &BeadBoardOptions::outlier_deviations,
              "beads with a residual of more than this many standard deviations are left out", at_least(3), unit("1"))
      .option("residual_scale", &BeadBoardOptions::residual_scale, "residuals are drawn this many times longer",
              at_least(1), unit("1"))
      .option("size_px", &BeadBoardOptions::size_px, "longer side of the pictures", at_least(100), at_most(4096));
  plugin.writer<Calibration>(".yaml", write_calibration, "camera matrix and distortion with their standard deviations");
}
