// SPDX-License-Identifier: Apache-2.0
#pragma once
// Costs that compare a radiograph of the model with the image, grey value by grey value: what they have in common.
#include <functional>
#include <memory>
#include <type_traits>
#include <vector>

#include "marrow/plugin.hpp"
#include "marrow/toolbox/match/inputs.hpp"

namespace marrow::match {

/// The same pixels as they are rendered and as they are seen, row by row; both are line integrals. Where `counts` is 0,
/// a pixel is not to be compared.
struct Patch {
  int columns = 0, rows = 0;
  int left = 0, top = 0;  ///< where it lies in the image, in pixels that are compared
  std::vector<float> rendered, seen;
  std::vector<char> counts;

  std::size_t at(int column, int row) const { return std::size_t(row) * std::size_t(columns) + std::size_t(column); }
};

/// How badly the two agree; smaller is better. Gives the worst value where there is nothing to compare, never NaN.
using Measure = std::function<double(const Patch&)>;
/// The measure of one image at one level. It is given the whole of it, without `rendered`.
using MeasureOf = std::function<Measure(const Patch& whole)>;

struct IntensityOptions {
  int pixel_step = 2;
  int margin_px = 16;
  double blur_px = 0.5;
  std::vector<double> weights;
};

/// The mean of a measure over the views, by their weights. Each view is compared where the model may be seen, and
/// margin_px around it; a view that does not show the model counts as `worst`. At a level of pixel_step, every so many
/// pixels are compared, of images smoothed with a Gaussian of blur_px times the step. Pixels that show other fragments
/// do not count. Throws Error for views that are not valid.
std::shared_ptr<const Cost> intensity_cost(const RadiographProjector& projector, const List<View>& views,
                                           const List<Pose>* others, const List<RadiographProjector>* other_projectors,
                                           const List<OutlineProjector>* other_outlines,
                                           const IntensityOptions& options, double worst, MeasureOf measure_of);
/// The same, of a measure that asks of the image only what is compared.
std::shared_ptr<const Cost> intensity_cost(const RadiographProjector& projector, const List<View>& views,
                                           const List<Pose>* others, const List<RadiographProjector>* other_projectors,
                                           const List<OutlineProjector>* other_outlines,
                                           const IntensityOptions& options, double worst, Measure measure);

/// The function of a node: its cost is the mean of kMeasure over the views. kMeasure is called with a patch and gives
/// the measure's value, or with the whole of an image and gives a Measure; in both cases also with the options, where
/// it takes them. A view that does not show the model counts as kWorst.
template <auto kMeasure, class Options = IntensityOptions, int kWorst = 2>
std::shared_ptr<const Cost> intensity_node(const RadiographProjector& projector, const List<View>& views,
                                           const List<Pose>* others, const List<RadiographProjector>* other_projectors,
                                           const List<OutlineProjector>* other_outlines, const Options& options) {
  const auto measure = [options](const Patch& patch) {
    if constexpr (std::is_invocable_v<decltype(kMeasure), const Patch&, const Options&>)
      return kMeasure(patch, options);
    else
      return kMeasure(patch);
  };
  return intensity_cost(projector, views, others, other_projectors, other_outlines, options, kWorst, measure);
}

/// -log of the part of the brightest that is left, in arbitrary units: bright = air. Values of 0 or less count as one
/// step of grey.
cv::Mat line_integrals(const cv::Mat& image);

/// Half the differences between right and left neighbours, and between those below and above, smoothed across as
/// Sobel's; 0 at the border. A gradient counts where all nine pixels do.
struct Gradients {
  std::vector<float> rendered_u, rendered_v, seen_u, seen_v;
  std::vector<char> counts;
};
Gradients gradients_of(const Patch& patch);
/// The factor that makes the rendered gradients most like the seen ones by least squares; 0 where there are none. Soft
/// tissue, which the radiograph of a bone lacks, has little part in it.
double scale_of(const Gradients& gradients);

/// Pearson's correlation over the pixels that count; 0 where one of the two is constant or fewer than 16 count.
double correlation(const std::vector<float>& a, const std::vector<float>& b, const std::vector<char>& counts);

/// The standard deviation of the values that count; 0 of fewer than 16.
double deviation(const std::vector<float>& values, const std::vector<char>& counts);

/// Declares the inputs, outputs and options that all of these nodes share.
template <class Options, class Node>
void declare(Node& node) {
  node.in("projector", "makes radiographs of the model")
      .in("views", "views with their cameras and masks", over("view"))
      .in("others", "where other fragments are, whose shadows are left out", over("fragment"))
      .in("other_projectors", "draw them, and maybe this one", over("fragment"))
      .in("other_outlines", "draw other bodies that are known as surfaces only; their shadows are left out",
          over("fragment"))
      .out("cost", "how badly radiograph and image agree")
      .option("pixel_step", &Options::pixel_step, "every how many pixels are compared", at_least(1), at_most(64))
      .option("margin_px", &Options::margin_px, "how far around the model the images are compared", at_least(0))
      .option("blur_px", &Options::blur_px, "smoothing, in steps: standard deviation of a Gaussian", at_least(0),
              at_most(10), unit("steps"))
      .option("weights", &Options::weights, "of each view; none: all the same");
}

}  // namespace marrow::match
