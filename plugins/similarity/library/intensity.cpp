// SPDX-License-Identifier: Apache-2.0
#include "marrow/similarity/intensity.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "marrow/base/error.hpp"
#include "marrow/domain/camera.hpp"
#include "marrow/toolbox/image/line_integrals.hpp"
#include "marrow/toolbox/match/among_others.hpp"
#include "marrow/toolbox/match/bones_together.hpp"
#include "moments.hpp"
#include "smoothed_at_bone.hpp"

namespace marrow::match {
namespace {

/// A projector whose radiographs are as smooth as images smoothed by `sigma_px`. The point where the views meet tells
/// how far away the bone is; if they do not meet, each pose tells it. Null if the projector cannot be smoothed.
std::shared_ptr<const RadiographProjector> as_smooth_as_images(const RadiographProjector& projector,
                                                               const List<View>& views, double sigma_px) {
  if (!(sigma_px > 0)) return nullptr;
  const std::optional<Eigen::Vector3d> middle_mm = meeting_point_mm(views);
  if (!middle_mm) {
    // Each bone at its own depth.
    const auto one = [sigma_px](const RadiographProjector& bone) { return smoothed_at_bone(bone, sigma_px); };
    const auto* bones = dynamic_cast<const BonesTogether*>(&projector);
    return bones ? std::shared_ptr<const RadiographProjector>(bones->with_each(one)) : one(projector);
  }
  double sum = 0;
  for (const View& view : views) sum += sigma_px * pixel_size_at_mm(view.camera, *middle_mm);
  return projector.smoothed(sum / double(views.size()));
}

class IntensityCost : public ViewsCost, public CostAmongOthers {
 public:
  IntensityCost(std::shared_ptr<const RadiographProjector> projector, const List<View>& views,
                const IntensityOptions& options, double worst, MeasureOf measure_of)
      : ViewsCost(views.size(), options.weights),
        projector_(std::move(projector)),
        views_(views),
        options_(options),
        worst_(worst),
        measure_of_(std::move(measure_of)) {
    smoothed_ = as_smooth_as_images(*projector_, views, options.sigma_steps * options.pixel_step);
    auto seen = std::make_shared<Seen>();
    for (const View& view : views) {
      seen->images.push_back(image_of(view));
      seen->measures.push_back(measure_of_(seen->images.back()));
    }
    seen_ = std::move(seen);
  }

  double value_in_view(std::size_t view, const RigidTransform& world_from_model) const override {
    const Patch patch = patch_of(view, world_from_model);
    return patch.rendered.empty() ? worst_ : measured(view, patch);
  }

  std::shared_ptr<const Cost> at_level(const CostLevel& level) const override {
    if (level.pixel_step <= 0 || level.pixel_step == options_.pixel_step) return std::make_shared<IntensityCost>(*this);
    IntensityOptions options = options_;
    options.pixel_step = level.pixel_step;
    return std::make_shared<IntensityCost>(projector_, views_, options, worst_, measure_of_);
  }

  std::shared_ptr<const Cost> with_others(const List<RigidTransform>& world_from_others) const override {
    const auto* bones = dynamic_cast<const BonesTogether*>(projector_.get());
    if (!bones) return nullptr;
    auto cost = std::make_shared<IntensityCost>(*this);
    cost->projector_ = bones->with_others(world_from_others);
    if (const auto* smoothed = dynamic_cast<const BonesTogether*>(smoothed_.get()))
      cost->smoothed_ = smoothed->with_others(world_from_others);
    return cost;
  }

 private:
  /// What the images show, at every pixel_step-th pixel. Costs that differ in their projector share it.
  struct Seen {
    std::vector<Patch> images;
    std::vector<Measure> measures;
  };

  std::string silence(std::size_t view, const RigidTransform& world_from_model) const override {
    return in_view(views_, view, silence_of(view, patch_of(view, world_from_model)));
  }
  std::string silence_of(std::size_t view, const Patch& patch) const {
    if (patch.rendered.empty()) return "it shows nothing of the bone";
    if (deviation(patch.rendered, patch.counts) == 0)
      return views_[view].mask.empty() ? "its radiograph is empty where the bone would be"
                                       : "no pixel inside the mask shows the bone";
    constexpr double kRounding = 1e-6;  // of the blur; a grey level of 16 bits is 1.5e-5
    if (deviation(patch.seen, patch.counts) < kRounding) return "its image is constant where the bone would be";
    return {};
  }

  /// Every step-th pixel of a view's smoothed line integrals.
  Patch image_of(const View& view) const {
    const int step = options_.pixel_step;
    cv::Mat smooth = image::line_integrals(view.image.pixels);
    if (const double sigma = options_.sigma_steps * step; sigma > 0.1)
      cv::GaussianBlur(smooth, smooth, {}, sigma, sigma, cv::BORDER_REPLICATE);
    Patch image{(smooth.cols + step - 1) / step, (smooth.rows + step - 1) / step, 0, 0, {}, {}, {}};
    for (int row = 0; row < image.rows; ++row)
      for (int column = 0; column < image.columns; ++column) {
        const float value = smooth.at<float>(row * step, column * step);
        const bool is_out =
            !std::isfinite(value) || (!view.mask.empty() && !view.mask.at<std::uint8_t>(row * step, column * step));
        image.seen.push_back(value);
        image.counts.push_back(!is_out);
      }
    return image;
  }

  Split split(std::size_t view, const RigidTransform& world_from_model) const override {
    if (!options_.has_blocks) return {value_in_view(view, world_from_model), {}};
    const Blocks blocks = Blocks::of(views_[view].camera);
    const Patch patch = patch_of(view, world_from_model);
    if (patch.rendered.empty()) return {worst_, std::vector<double>(std::size_t(blocks.count()), worst_)};
    if (const auto* whole = std::get_if<WholeMeasure>(&seen_->measures[view]))
      return split_by_masks(*whole, patch, blocks);
    const auto& measure = std::get<SumMeasure>(seen_->measures[view]);
    BlockSums sums(blocks);
    Tally tally(patch, options_.pixel_step, &sums);
    measure.add(patch, tally);
    return {finite(measure.value(tally.sums())),
            sums.without_each([&](const BlockSums::Sums& left) { return finite(measure.value(left)); })};
  }

  /// Leaves out the pixels of one block after the other.
  Split split_by_masks(const WholeMeasure& measure, Patch patch, const Blocks& blocks) const {
    Split split;
    split.value = finite(measure(patch));
    split.without_block.assign(std::size_t(blocks.count()), split.value);
    const std::vector<char> counts = patch.counts;
    const int step = options_.pixel_step;
    const auto side = [&](int block) { return int(std::ceil(block * blocks.side_px / step)); };
    for (int row = 0; row < blocks.rows; ++row)
      for (int column = 0; column < blocks.columns; ++column) {
        const int left = std::max(side(column) - patch.left, 0), top = std::max(side(row) - patch.top, 0),
                  right = std::min(side(column + 1) - patch.left, patch.columns),
                  bottom = std::min(side(row + 1) - patch.top, patch.rows);
        if (left >= right || top >= bottom) continue;
        for (int y = top; y < bottom; ++y)
          std::fill_n(patch.counts.begin() + std::ptrdiff_t(patch.at(left, y)), right - left, 0);
        split.without_block[std::size_t(row * blocks.columns + column)] = finite(measure(patch));
        patch.counts = counts;
      }
    return split;
  }

  double measured(std::size_t view, const Patch& patch) const {
    if (const auto* whole = std::get_if<WholeMeasure>(&seen_->measures[view])) return finite((*whole)(patch));
    const auto& measure = std::get<SumMeasure>(seen_->measures[view]);
    Tally tally(patch, options_.pixel_step, nullptr);
    measure.add(patch, tally);
    return finite(measure.value(tally.sums()));
  }
  double finite(double value) const { return std::isfinite(value) ? value : worst_; }

  /// The pixels of a view to compare. Empty if there are too few.
  Patch patch_of(std::size_t view, const RigidTransform& world_from_model) const {
    const Camera& camera = views_[view].camera;
    const Patch& image = seen_->images[view];
    const RadiographProjector& projector = smoothed_ ? *smoothed_ : *projector_;
    const PixelGrid region = projector.region(camera, world_from_model);
    if (region.count() == 0) return {};
    const int step = options_.pixel_step, margin = std::max(options_.margin_px, options_.least_margin_steps * step);
    const int left = std::max(0, (int(region.u_px) - margin) / step),
              top = std::max(0, (int(region.v_px) - margin) / step);
    const int right = std::min(image.columns - 1, (int(region.u_px) + region.columns - 1 + margin) / step),
              bottom = std::min(image.rows - 1, (int(region.v_px) + region.rows - 1 + margin) / step);
    if (right - left < 3 || bottom - top < 3) return {};
    Patch patch{right - left + 1, bottom - top + 1, left, top, {}, {}, {}};
    patch.rendered = projector.radiograph(
        camera, world_from_model,
        PixelGrid{double(left) * step, double(top) * step, double(step), patch.columns, patch.rows});
    patch.seen.resize(patch.rendered.size());
    patch.counts.resize(patch.rendered.size());
    for (int row = 0; row < patch.rows; ++row) {
      const auto from = std::ptrdiff_t(image.at(left, top + row)), to = std::ptrdiff_t(patch.at(0, row));
      std::copy_n(image.seen.begin() + from, patch.columns, patch.seen.begin() + to);
      std::copy_n(image.counts.begin() + from, patch.columns, patch.counts.begin() + to);
    }
    return patch;
  }

  std::shared_ptr<const RadiographProjector> projector_;
  std::shared_ptr<const RadiographProjector> smoothed_;  ///< as much as the image; null if projector_ cannot
  const List<View> views_;
  const IntensityOptions options_;
  const double worst_;
  const MeasureOf measure_of_;
  std::shared_ptr<const Seen> seen_;
};

}  // namespace

std::shared_ptr<const Cost> intensity_cost(const RadiographProjector& projector, const List<View>& views,
                                           const List<Pose>* others, const List<RadiographProjector>* other_projectors,
                                           const List<OutlineProjector>* other_outlines,
                                           const IntensityOptions& options, double worst, MeasureOf measure_of) {
  check_views(views);
  check_weights(options.weights, views.size());
  const List<View> own = without_shadows(views, shadows_of(&projector, others, other_projectors, other_outlines));
  const std::shared_ptr<const RadiographProjector> kept_elsewhere(std::shared_ptr<void>(), &projector);
  return std::make_shared<IntensityCost>(kept_elsewhere, own, options, worst, std::move(measure_of));
}

namespace {

/// Sobel's gradients of a row. Its neighbours lie `down` values before and after it.
void sobel(const float* row, std::ptrdiff_t down, int count, float* __restrict du, float* __restrict dv) {
  for (int i = 0; i < count; ++i) {
    const float* p = row + i;
    const float a = p[-down - 1], b = p[-down], d = p[-down + 1], e = p[-1], f = p[1], h = p[down - 1], k = p[down],
                m = p[down + 1];
    du[i] = 0.125f * (d - a + 2 * (f - e) + m - h);
    dv[i] = 0.125f * (h - a + 2 * (k - b) + m - d);
  }
}

/// Which pixels of a row count together with all their neighbours.
void all_around(const char* row, std::ptrdiff_t down, int count, char* __restrict all) {
  for (int i = 0; i < count; ++i) {
    const char* c = row + i;
    all[i] = char(c[-down - 1] & c[-down] & c[-down + 1] & c[-1] & c[0] & c[1] & c[down - 1] & c[down] & c[down + 1]);
  }
}

}  // namespace

Gradients gradients_of(const Patch& patch) {
  Gradients g;
  const std::size_t count = patch.rendered.size();
  for (auto* values : {&g.rendered_u, &g.rendered_v, &g.seen_u, &g.seen_v}) values->assign(count, 0.0f);
  g.counts.assign(count, 0);
  for (int row = 1; row + 1 < patch.rows; ++row) {
    const std::size_t i = patch.at(1, row);
    all_around(patch.counts.data() + i, patch.columns, patch.columns - 2, g.counts.data() + i);
    sobel(patch.rendered.data() + i, patch.columns, patch.columns - 2, g.rendered_u.data() + i,
          g.rendered_v.data() + i);
    sobel(patch.seen.data() + i, patch.columns, patch.columns - 2, g.seen_u.data() + i, g.seen_v.data() + i);
  }
  return g;
}

double scale_of(const Gradients& g) {
  double products = 0, squares = 0;
  for (std::size_t i = 0; i < g.counts.size(); ++i) {
    if (!g.counts[i]) continue;
    products += double(g.rendered_u[i]) * g.seen_u[i] + double(g.rendered_v[i]) * g.seen_v[i];
    squares += double(g.rendered_u[i]) * g.rendered_u[i] + double(g.rendered_v[i]) * g.rendered_v[i];
  }
  return squares > 0 ? products / squares : 0;
}

namespace {

Moments moments_of(const std::vector<float>& a, const std::vector<float>& b, const std::vector<char>& counts) {
  Moments m;
  // Relative to the first value that counts, so that a large constant causes no rounding errors.
  const auto first = std::find(counts.begin(), counts.end(), 1);
  if (first == counts.end()) return m;
  const std::size_t at = std::size_t(first - counts.begin());
  const double a0 = a[at], b0 = b[at];
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (!counts[i]) continue;
    m.add(a[i] - a0, b[i] - b0);
  }
  return m;
}

}  // namespace

double correlation(const std::vector<float>& a, const std::vector<float>& b, const std::vector<char>& counts) {
  const Moments m = moments_of(a, b, counts);
  if (m.n < 16) return 0;
  const double aa = m.spread_a(), bb = m.spread_b(), ab = m.spread_ab();
  if (!(aa > 1e-12 * std::max(m.aa, 1e-30)) || !(bb > 1e-12 * std::max(m.bb, 1e-30))) return 0;
  return std::clamp(ab / std::sqrt(aa * bb), -1.0, 1.0);
}

double deviation(const std::vector<float>& values, const std::vector<char>& counts) {
  const Moments m = moments_of(values, values, counts);
  return m.n < 16 ? 0 : std::sqrt(std::max(0.0, m.spread_a()) / m.n);
}

}  // namespace marrow::match
