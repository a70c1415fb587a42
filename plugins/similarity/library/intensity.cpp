// SPDX-License-Identifier: Apache-2.0
#include "marrow/similarity/intensity.hpp"

#include <tbb/parallel_for.h>

#include <mutex>
#include <opencv2/imgproc.hpp>

#include "intensity.hpp"
#include "marrow/toolbox/match/bones_together.hpp"
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

/// What costs at one level share: the model, smoothed as much as the images, and what the images show at every
/// pixel_step-th pixel.
struct Level {
  std::shared_ptr<const RadiographProjector> smoothed;  ///< null if the projector cannot be smoothed
  std::vector<Patch> images;
  std::vector<Measure> measures;
};

/// The levels that were made so far, by their pixel steps. Several nodes compare at the same levels.
class Levels {
 public:
  template <class Make>
  std::shared_ptr<const Level> at(int pixel_step, const Make& make) {
    {
      const std::lock_guard lock(mutex_);
      if (const auto found = made_.find(pixel_step); found != made_.end()) return found->second;
    }
    std::shared_ptr<const Level> level = make();  // unlocked, because it works in parallel
    const std::lock_guard lock(mutex_);
    return made_.emplace(pixel_step, std::move(level)).first->second;
  }

 private:
  std::mutex mutex_;
  std::map<int, std::shared_ptr<const Level>> made_;
};

class IntensityCost : public ViewsCost, public CostAmongOthers {
 public:
  IntensityCost(std::shared_ptr<const RadiographProjector> projector, const List<View>& views,
                const IntensityOptions& options, double worst, MeasureOf measure_of, std::shared_ptr<Levels> levels)
      : ViewsCost(views.size(), options.weights),
        projector_(std::move(projector)),
        views_(views),
        options_(options),
        worst_(worst),
        measure_of_(std::move(measure_of)),
        levels_(std::move(levels)),
        level_(levels_->at(options.pixel_step, [&] { return make_level(); })) {}

  double value_in_view(std::size_t view, const RigidTransform& world_from_model) const override {
    const Patch patch = patch_of(view, world_from_model);
    return patch.rendered.empty() ? worst_ : measured(view, patch);
  }

  std::optional<ViewExpansion> expansion_in_view(std::size_t view, const RigidTransform& world_from_model,
                                                 const FragmentFrame& frame) const override {
    if (!has_derivatives(level_->measures[view])) return std::nullopt;
    const auto patch = patch_with_slopes(view, world_from_model, frame);
    if (!patch) return std::nullopt;
    const Blocks blocks = Blocks::of(views_[view].camera);
    ViewExpansion expansion = expansion_of(level_->measures[view], *patch, options_.pixel_step, blocks, worst_);
    if (!options_.has_blocks) expansion.without_block.clear();
    return expansion;
  }

  std::optional<Expansion> expansion(const RigidTransform& world_from_model,
                                     const FragmentFrame& frame) const override {
    const std::vector<ViewExpansion> views = expansions(world_from_model, frame);
    if (views.empty()) return std::nullopt;
    Expansion mean;
    for (std::size_t i = 0; i < views.size(); ++i) add(views[i].whole, share(i), mean);
    return mean;
  }

  std::vector<Expansion> expansion_without_each_block(const RigidTransform& world_from_model,
                                                      const FragmentFrame& frame) const override {
    const std::vector<ViewExpansion> views = expansions(world_from_model, frame);
    Expansion mean;
    for (std::size_t i = 0; i < views.size(); ++i) add(views[i].whole, share(i), mean);
    std::vector<Expansion> without;
    for (std::size_t i = 0; i < views.size(); ++i)
      for (const Expansion& block : views[i].without_block) {
        without.push_back(mean);
        add(views[i].whole, -share(i), without.back());
        add(block, share(i), without.back());
      }
    return without;
  }

  std::shared_ptr<const Cost> at_level(const CostLevel& level) const override {
    if (level.pixel_step <= 0 || level.pixel_step == options_.pixel_step) return std::make_shared<IntensityCost>(*this);
    IntensityOptions options = options_;
    options.pixel_step = level.pixel_step;
    return std::make_shared<IntensityCost>(projector_, views_, options, worst_, measure_of_, levels_);
  }

  std::shared_ptr<const Cost> with_others(const List<RigidTransform>& world_from_others) const override {
    const auto* bones = dynamic_cast<const BonesTogether*>(projector_.get());
    if (!bones) return nullptr;
    auto cost = std::make_shared<IntensityCost>(*this);
    cost->projector_ = bones->with_others(world_from_others);
    cost->levels_ = std::make_shared<Levels>();
    if (const auto* smoothed = dynamic_cast<const BonesTogether*>(level_->smoothed.get())) {
      auto level = std::make_shared<Level>(*level_);
      level->smoothed = smoothed->with_others(world_from_others);
      cost->level_ = std::move(level);
    }
    return cost;
  }

 private:
  std::shared_ptr<const Level> make_level() const {
    auto level = std::make_shared<Level>();
    level->smoothed = as_smooth_as_images(*projector_, views_, options_.sigma_steps * options_.pixel_step);
    for (const View& view : views_) {
      level->images.push_back(image_of(view));
      level->measures.push_back(measure_of_(level->images.back()));
    }
    return level;
  }

  /// Of all views; empty if there are no derivatives.
  std::vector<ViewExpansion> expansions(const RigidTransform& world_from_model, const FragmentFrame& frame) const {
    std::vector<std::optional<ViewExpansion>> of_view(views_.size());
    tbb::parallel_for(std::size_t(0), of_view.size(),
                      [&](std::size_t i) { of_view[i] = expansion_in_view(i, world_from_model, frame); });
    std::vector<ViewExpansion> all;
    for (auto& view : of_view) {
      if (!view) return {};
      all.push_back(std::move(*view));
    }
    return all;
  }

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
    const auto* measure = std::get_if<SumMeasure>(&level_->measures[view]);
    if (!measure) return split_by_masks(view, patch, blocks);
    BlockSums sums(blocks);
    Tally tally(patch, options_.pixel_step, sums);
    measure->add(patch, tally);
    return {finite(measure->value(sums.all())),
            sums.without_each([&](const BlockSums::Sums& left) { return finite(measure->value(left)); })};
  }

  /// Leaves out the pixels of one block after the other.
  Split split_by_masks(std::size_t view, Patch patch, const Blocks& blocks) const {
    Split split;
    split.value = measured(view, patch);
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
        split.without_block[std::size_t(row * blocks.columns + column)] = measured(view, patch);
        patch.counts = counts;
      }
    return split;
  }

  double measured(std::size_t view, const Patch& patch) const {
    return finite(value_of(level_->measures[view], patch, options_.pixel_step, Blocks::of(views_[view].camera)));
  }
  double finite(double value) const { return std::isfinite(value) ? value : worst_; }

  const RadiographProjector& projector() const { return level_->smoothed ? *level_->smoothed : *projector_; }

  /// The pixels of a view to compare; empty if there are too few.
  Patch patch_of(std::size_t view, const RigidTransform& world_from_model) const {
    Patch patch = region_of(view, world_from_model);
    if (patch.seen.empty()) return patch;
    patch.rendered = projector().radiograph(views_[view].camera, world_from_model, grid_of(patch));
    return patch;
  }
  /// The same with slopes; absent if the projector has no derivatives.
  std::optional<Patch> patch_with_slopes(std::size_t view, const RigidTransform& world_from_model,
                                         const FragmentFrame& frame) const {
    Patch patch = region_of(view, world_from_model);
    if (patch.seen.empty()) return patch;
    auto expansion = projector().expansion(views_[view].camera, world_from_model, frame, grid_of(patch));
    if (!expansion) return std::nullopt;
    patch.rendered = std::move(expansion->values);
    patch.slopes = std::move(expansion->slopes);
    return patch;
  }
  PixelGrid grid_of(const Patch& patch) const {
    const int step = options_.pixel_step;
    return {double(patch.left) * step, double(patch.top) * step, double(step), patch.columns, patch.rows};
  }

  /// The pixels of a view to compare, without `rendered`. Empty if there are too few.
  Patch region_of(std::size_t view, const RigidTransform& world_from_model) const {
    const Patch& image = level_->images[view];
    const PixelGrid region = projector().region(views_[view].camera, world_from_model);
    if (region.count() == 0) return {};
    const int step = options_.pixel_step, margin = std::max(options_.margin_px, options_.least_margin_steps * step);
    const int left = std::max(0, (int(region.u_px) - margin) / step),
              top = std::max(0, (int(region.v_px) - margin) / step);
    const int right = std::min(image.columns - 1, (int(region.u_px) + region.columns - 1 + margin) / step),
              bottom = std::min(image.rows - 1, (int(region.v_px) + region.rows - 1 + margin) / step);
    if (right - left < 3 || bottom - top < 3) return {};
    Patch patch{right - left + 1, bottom - top + 1, left, top, {}, {}, {}};
    patch.seen.resize(std::size_t(patch.columns) * std::size_t(patch.rows));
    patch.counts.resize(patch.seen.size());
    for (int row = 0; row < patch.rows; ++row) {
      const auto from = std::ptrdiff_t(image.at(left, top + row)), to = std::ptrdiff_t(patch.at(0, row));
      std::copy_n(image.seen.begin() + from, patch.columns, patch.seen.begin() + to);
      std::copy_n(image.counts.begin() + from, patch.columns, patch.counts.begin() + to);
    }
    return patch;
  }
  std::shared_ptr<const RadiographProjector> projector_;
  const List<View> views_;
  const IntensityOptions options_;
  const double worst_;
  const MeasureOf measure_of_;
  std::shared_ptr<Levels> levels_;
  std::shared_ptr<const Level> level_;
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
  return std::make_shared<IntensityCost>(kept_elsewhere, own, options, worst, std::move(measure_of),
                                         std::make_shared<Levels>());
}

}  // namespace marrow::match
