// SPDX-License-Identifier: Apache-2.0
#pragma once
// The common part of costs that compare a radiograph of the model with the image, grey value by grey value.
#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <type_traits>
#include <variant>
#include <vector>

#include "marrow/similarity/expansions.hpp"
#include "marrow/toolbox/image/grey_values.hpp"

namespace marrow::match {

/// Pixels of a region, row by row: `rendered` from the model and `seen` in the image. Both are line integrals, or a
/// component of their gradients. A pixel whose `counts` is 0 must not be compared; its value may be NaN.
struct Patch {
  int columns = 0, rows = 0;
  int left = 0, top = 0;  ///< position of the region in the image, in units of the pixels that are compared
  std::vector<float> rendered, seen;
  std::vector<char> counts;
  /// The derivatives of `rendered` by a small motion (r [rad], t [mm]) of the model; empty if nobody asks for them.
  std::array<std::vector<float>, 6> slopes{};

  std::size_t at(int column, int row) const { return std::size_t(row) * std::size_t(columns) + std::size_t(column); }
  Vector6d slopes_at(std::size_t i) const {
    return Vector6d{slopes[0][i], slopes[1][i], slopes[2][i], slopes[3][i], slopes[4][i], slopes[5][i]};
  }
};

/// Adds up what each place of a patch contributes to a measure: BlockSums, or an ExpansionTally with derivatives.
template <class Sums>
class PlacesOf {
 public:
  /// The patch's pixels are `step_px` times those of the image.
  PlacesOf(const Patch& patch, double step_px, Sums& sums) : patch_(patch), step_px_(step_px), sums_(sums) {}
  template <class... What>
  void add(double column, double row, const What&... what) {
    sums_.add((patch_.left + column) * step_px_, (patch_.top + row) * step_px_, what...);
  }

 private:
  const Patch& patch_;
  const double step_px_;
  Sums& sums_;
};
using Tally = PlacesOf<BlockSums>;
using TallyOfExpansions = PlacesOf<ExpansionTally>;

/// How badly radiograph and image agree; smaller is better. Must give its worst value if there is nothing to compare.
/// Must be safe to call from several threads at once.
struct WholeMeasure {
  std::function<double(const Patch&)> value;
  /// The quadratic model, for a patch with slopes; empty if there is none.
  std::function<Cost::Expansion(const Patch&)> expansion;
};
/// A measure that follows from sums over places: 1 - sum of the values / sum of the weights.
struct SumMeasure {
  std::function<void(const Patch&, Tally&)> add;
  /// The same with derivatives, for a patch with slopes.
  std::function<void(const Patch&, TallyOfExpansions&)> add_expansion;
  std::optional<double> whole;  ///< divides the sum of the values instead of the sum of the weights

  double value(const BlockSums::Sums& sums) const;
};
/// 1 - mean of the correlations of some patches, such as the two components of the gradients.
struct CorrelationMeasure {
  std::function<std::vector<Patch>(const Patch&)> compared;
};
using Measure = std::variant<WholeMeasure, SumMeasure, CorrelationMeasure>;
/// Makes the measure for one image at one level. `whole` is the whole image, without `rendered`.
using MeasureOf = std::function<Measure(const Patch& whole)>;

/// See the help texts in declare().
struct IntensityOptions {
  int pixel_step = 2;
  int margin_px = 16;
  double sigma_steps = 0.5;
  std::vector<double> weights;
  int least_margin_steps = 0;  ///< no option: the least margin that the measure needs, in compared pixels
  bool has_blocks = true;      ///< no option: whether leaving out a block tells something (ViewsCost::split())
};

/// A cost that is the weighted mean of a measure over the views. In each view only the region that may show the model
/// is compared, with margin_px around it. A view that does not show the model, or whose measure is not finite, counts
/// as `worst`. Only every pixel_step-th pixel is compared, after smoothing the image by a Gaussian of sigma_steps *
/// pixel_step. Pixels that show other fragments do not count. The cost refers to `projector`, which must outlive it.
/// Throws Error as check_views(), check_weights() and shadows_of() do.
std::shared_ptr<const Cost> intensity_cost(const RadiographProjector& projector, const List<View>& views,
                                           const List<Pose>* others, const List<RadiographProjector>* other_projectors,
                                           const List<OutlineProjector>* other_outlines,
                                           const IntensityOptions& options, double worst, MeasureOf measure_of);

/// The function of a node. Its cost is the mean of kMeasure over the views. kMeasure either takes a patch and returns
/// the measure's value, or takes a whole image and returns a SumMeasure or a CorrelationMeasure. In both cases it may
/// take the options as a second argument. A view that does not show the model counts as kWorst.
template <auto kMeasure, class Options = IntensityOptions, int kWorst = 2>
std::shared_ptr<const Cost> intensity_node(const RadiographProjector& projector, const List<View>& views,
                                           const List<Pose>* others, const List<RadiographProjector>* other_projectors,
                                           const List<OutlineProjector>* other_outlines, const Options& options,
                                           Context& context) {
  for (const View& view : views) image::warn_of_greys(view, context);
  IntensityOptions own = options;
  if constexpr (requires { options.patch_pixels; }) own.least_margin_steps = options.patch_pixels;
  const auto called = [options](const Patch& patch) {
    if constexpr (std::is_invocable_v<decltype(kMeasure), const Patch&, const Options&>)
      return kMeasure(patch, options);
    else
      return kMeasure(patch);
  };
  if constexpr (std::is_same_v<decltype(called(Patch())), double>)
    return intensity_cost(projector, views, others, other_projectors, other_outlines, own, kWorst,
                          [called](const Patch&) -> Measure {
                            return WholeMeasure{called, {}};
                          });
  else
    return intensity_cost(projector, views, others, other_projectors, other_outlines, own, kWorst, called);
}

/// Gradients per pixel by Sobel's operator divided by 8, along the columns and the rows; 0 at the border. A gradient
/// counts if all nine pixels do. With the slopes of the rendered gradients, if the patch has slopes.
struct Gradients {
  Patch u, v;
};
Gradients gradients_of(const Patch& patch);
/// The factor that fits the rendered gradients to the seen ones by least squares; 0 if there are none. The radiograph
/// of a bone has no soft tissue, but soft tissue has small gradients, so it hardly affects this factor. With its
/// derivatives, if the gradients have slopes.
struct Scale {
  double value = 0;
  Vector6d slopes = Vector6d::Zero();
};
Scale scale_of(const Gradients& gradients);

/// Pearson's correlation over the pixels that count; 0 if one of the two is constant or fewer than 16 count.
double correlation(const std::vector<float>& a, const std::vector<float>& b, const std::vector<char>& counts);

/// The standard deviation of the values that count; 0 if fewer than 16 count.
double deviation(const std::vector<float>& values, const std::vector<char>& counts);

/// Declares the inputs, the output and the options that all of these nodes share.
template <class Options, class Node>
void declare(Node& node) {
  node.in("projector", "makes radiographs of the model")
      .in("views", "views with their cameras and masks", over("view"))
      .in("others", "poses of other fragments; pixels that show them are not compared", over("fragment"))
      .in("other_projectors", "make radiographs of the other fragments, and maybe of this one", over("fragment"))
      .in("other_outlines",
          "draw outlines of other bodies that are known as surfaces only; pixels inside are not compared",
          over("fragment"))
      .out("cost", "how badly radiograph and image agree")
      .option("pixel_step", &Options::pixel_step, "compare every n-th pixel", at_least(1), at_most(64))
      .option("margin_px", &Options::margin_px, "margin around the model in which the images are compared", at_least(0))
      .option("sigma_steps", &Options::sigma_steps,
              "smoothing: standard deviation of a Gaussian, in steps of pixel_step", at_least(0), at_most(10),
              unit("steps"))
      .option("weights", &Options::weights, "weight of each view; none: all the same");
}

// The values of measures, and their quadratic models.

double value_of(const Measure& measure, const Patch& patch, double step_px, const Blocks& blocks);

bool has_derivatives(const Measure& measure);

/// For a measure that has derivatives and a patch with slopes. `worst` counts where the patch is empty or the measure
/// is not finite.
ViewsCost::ViewExpansion expansion_of(const Measure& measure, const Patch& patch, double step_px, const Blocks& blocks,
                                      double worst);

/// sum += share * more.
void add(const Cost::Expansion& more, double share, Cost::Expansion& sum);

}  // namespace marrow::match
