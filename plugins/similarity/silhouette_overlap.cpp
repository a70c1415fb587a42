// SPDX-License-Identifier: Apache-2.0
// How well the silhouette of a body of metal covers what is dark in the image, or bright. Within the silhouette and a
// band around it, the image is explained by two grey values, one inside and one outside. The share of its variance that
// they explain is 1 if the silhouette covers all of the metal and nothing else (Chan and Vese, IEEE Trans Image
// Process 10, 2001, without their curvature). In a saturated image of two grey values, it is the squared Matthews
// correlation of silhouette and metal. It needs no edges and no threshold, and sees metal from farther away than edges.
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "marrow/similarity/edge_loss.hpp"
#include "marrow/toolbox/match/views_cost.hpp"

namespace {

using namespace marrow;

struct Options {
  int pixel_step = 1;
  double band_px = 8;
  std::string polarity = "dark";
  std::vector<double> weights;
};

struct Scene {
  const Mesh* model;
  List<View> views;
  Options options;
};

/// Sums over pixels in the silhouette and in the band around it.
struct Sums {
  double inside = 0, inside_grey = 0, all = 0, grey = 0, squares = 0;

  void add(double value, bool is_inside) {
    all += 1, grey += value, squares += value * value;
    if (is_inside) inside += 1, inside_grey += value;
  }
  Sums without(const Sums& part) const {
    return {inside - part.inside, inside_grey - part.inside_grey, all - part.all, grey - part.grey,
            squares - part.squares};
  }
};

/// The silhouette and its band on a grid of the image.
struct Drawn {
  int u_px = 0, v_px = 0;  ///< of the first pixel
  cv::Mat1b silhouette, band;
  double visible = 0;  ///< share of the silhouette's box that lies in the image
};

class SilhouetteOverlap : public match::ViewsCost {
 public:
  SilhouetteOverlap(std::shared_ptr<const Scene> scene, int step, double band_px)
      : ViewsCost(scene->views.size(), scene->options.weights),
        scene_(std::move(scene)),
        step_(std::max(1, step)),
        band_px_(band_px) {}

  double value_in_view(std::size_t view, const RigidTransform& world_from_model) const override {
    return split(view, world_from_model).value;
  }

  Split split(std::size_t index, const RigidTransform& world_from_model) const override {
    const View& view = scene_->views[index];
    const Drawn drawn = draw(view.camera, world_from_model);
    const auto blocks = match::Blocks::of(view.camera);
    Sums all;
    std::vector<Sums> of_block(std::size_t(blocks.count()));
    for (int row = 0; row < drawn.band.rows; ++row)
      for (int column = 0; column < drawn.band.cols; ++column) {
        const int u = drawn.u_px + step_ * column, v = drawn.v_px + step_ * row;
        if (!drawn.band(row, column) || match::is_masked(view, float(u), float(v))) continue;
        const double value = grey(view.image.pixels, u, v);
        if (!std::isfinite(value)) continue;
        const bool is_inside = drawn.silhouette(row, column) != 0;
        all.add(value, is_inside);
        of_block[std::size_t(blocks.at(u, v))].add(value, is_inside);
      }
    Split split{value_of(all, drawn.visible), {}};
    for (const Sums& block : of_block) split.without_block.push_back(value_of(all.without(block), drawn.visible));
    return split;
  }

  std::shared_ptr<const Cost> at_level(const CostLevel& level) const override {
    return std::make_shared<SilhouetteOverlap>(scene_, level.pixel_step > 0 ? level.pixel_step : step_,
                                               std::max(level.reach_px, scene_->options.band_px));
  }

 private:
  std::string silence(std::size_t index, const RigidTransform& world_from_model) const override {
    const View& view = scene_->views[index];
    const Drawn drawn = draw(view.camera, world_from_model);
    bool is_seen = false;
    for (int row = 0; row < drawn.silhouette.rows && !is_seen; ++row)
      for (int column = 0; column < drawn.silhouette.cols && !is_seen; ++column)
        is_seen = drawn.silhouette(row, column) &&
                  !match::is_masked(view, float(drawn.u_px + step_ * column), float(drawn.v_px + step_ * row));
    if (!is_seen) return match::in_view(scene_->views, index, "it shows nothing of the model's silhouette");
    double low = 0, high = 0;
    cv::minMaxLoc(view.image.pixels, &low, &high);
    return low < high ? "" : match::in_view(scene_->views, index, "all of the image has one grey value");
  }

  static double grey(const cv::Mat& pixels, int u, int v) {
    return pixels.depth() == CV_8U    ? double(pixels.at<std::uint8_t>(v, u))
           : pixels.depth() == CV_16U ? double(pixels.at<std::uint16_t>(v, u))
                                      : double(pixels.at<float>(v, u));
  }

  /// 1 minus the explained share of the variance. A silhouette that is partly out of the image explains less.
  double value_of(const Sums& sums, double visible) const {
    const double outside = sums.all - sums.inside;
    if (!(sums.inside >= 1 && outside >= 1)) return 1;
    const double variance = sums.squares - sums.grey * sums.grey / sums.all;
    if (!(variance > 1e-9 * sums.squares)) return 1;
    const double difference = (sums.grey - sums.inside_grey) / outside - sums.inside_grey / sums.inside;
    if ((scene_->options.polarity == "dark" && difference < 0) ||
        (scene_->options.polarity == "bright" && difference > 0))
      return 1;
    const double explained = sums.inside * outside / sums.all * difference * difference / variance;
    return std::clamp(1 - visible * explained, 0.0, 1.0);
  }

  Drawn draw(const Camera& camera, const RigidTransform& world_from_model) const {
    constexpr double kFar_px = 1e6;
    const RigidTransform camera_from_model = camera.camera_from_world * world_from_model;
    std::vector<Eigen::Vector2d> pixels;
    pixels.reserve(scene_->model->vertices_mm.size());
    Eigen::AlignedBox2d box;
    for (const Eigen::Vector3d& vertex : scene_->model->vertices_mm) {
      const Eigen::Vector3d seen = camera_from_model * vertex;
      if (!(seen.z() > 1)) return {};  // the body reaches the source
      pixels.push_back((camera.intrinsics * seen).hnormalized());
      box.extend(pixels.back());
    }
    if (!(box.min().allFinite() && box.max().allFinite() && box.sizes().maxCoeff() < kFar_px)) return {};
    const Eigen::AlignedBox2d image(Eigen::Vector2d(0, 0), Eigen::Vector2d(camera.width_px - 1, camera.height_px - 1)),
        seen = box.intersection(image);
    if (seen.isEmpty() || !(box.volume() > 0)) return {};
    Drawn drawn;
    drawn.visible = seen.volume() / box.volume();
    const Eigen::Vector2d margin(band_px_ + step_, band_px_ + step_);
    const Eigen::AlignedBox2d around = Eigen::AlignedBox2d(box.min() - margin, box.max() + margin).intersection(image);
    drawn.u_px = int(std::ceil(around.min().x())), drawn.v_px = int(std::ceil(around.min().y()));
    const int columns = int((around.max().x() - drawn.u_px) / step_) + 1,
              rows = int((around.max().y() - drawn.v_px) / step_) + 1;
    drawn.silhouette = cv::Mat1b(rows, columns, uchar(0));
    fill(drawn, pixels);
    const int reach = std::max(1, int(band_px_ / step_));
    cv::dilate(drawn.silhouette, drawn.band,
               cv::getStructuringElement(cv::MORPH_ELLIPSE, {2 * reach + 1, 2 * reach + 1}));
    return drawn;
  }

  /// Marks the pixels whose centres lie in a triangle. OpenCV's fillConvexPoly would also mark those that a border
  /// touches on one side, so that the silhouette would lie beside the body by a part of a pixel.
  void fill(Drawn& drawn, const std::vector<Eigen::Vector2d>& pixels) const {
    for (const auto& triangle : scene_->model->triangles) {
      std::array<Eigen::Vector2d, 3> corners;
      for (std::size_t k = 0; k < 3; ++k)
        corners[k] = (pixels[triangle[k]] - Eigen::Vector2d(drawn.u_px, drawn.v_px)) / step_;
      const auto [top, bottom] = std::minmax({corners[0].y(), corners[1].y(), corners[2].y()});
      const int last = int(std::floor(std::min(bottom, drawn.silhouette.rows - 1.0)));
      for (int row = int(std::ceil(std::max(top, 0.0))); row <= last; ++row) fill_row(drawn, corners, row);
    }
  }
  static void fill_row(Drawn& drawn, const std::array<Eigen::Vector2d, 3>& corners, int row) {
    double left = drawn.silhouette.cols, right = -1;
    for (std::size_t k = 0; k < 3; ++k) {
      const Eigen::Vector2d &a = corners[k], &b = corners[(k + 1) % 3];
      if (a.y() == b.y() || (a.y() < row) == (b.y() < row)) continue;
      const double at = a.x() + (row - a.y()) / (b.y() - a.y()) * (b.x() - a.x());
      left = std::min(left, at), right = std::max(right, at);
    }
    const int last = int(std::floor(std::min(right, drawn.silhouette.cols - 1.0)));
    for (int column = int(std::ceil(std::max(left, 0.0))); column <= last; ++column)
      drawn.silhouette(row, column) = 255;
  }

  std::shared_ptr<const Scene> scene_;
  const int step_;
  const double band_px_;
};

std::shared_ptr<const Cost> silhouette_overlap(const Mesh& model, const List<View>& views, const Options& options) {
  check_mesh(model, "the surface of the body");
  match::check_views(views);
  match::check_weights(options.weights, views.size());
  auto scene = std::make_shared<Scene>();
  scene->model = &model;
  scene->views = views;
  scene->options = options;
  return std::make_shared<SilhouetteOverlap>(std::move(scene), options.pixel_step, options.band_px);
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("similarity.silhouette_overlap", silhouette_overlap)
      .summary(
          "How badly the silhouette of a body of metal covers what is dark, or bright, in the images: the share of the "
          "variance in and around it that two grey values do not explain")
      .in("model", "surface of the body")
      .in("views", "views with their cameras and masks", over("view"))
      .out("cost", "between 0, if the silhouette covers the metal and nothing else, and 1; the mean over the views")
      .option("pixel_step", &Options::pixel_step, "only every n-th pixel along each side is compared", at_least(1),
              at_most(32))
      .option("band_px", &Options::band_px, "width of the band around the silhouette that is compared with it",
              at_least(2), at_most(500))
      .option("polarity", &Options::polarity, "whether metal is dark in the images, bright, or either",
              one_of({"dark", "bright", "either"}))
      .option("weights", &Options::weights, "weight of each view; empty: all views have the same weight");
}
