// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>

#include "marrow/similarity/histogram.hpp"

namespace {

using marrow::Cost;
using marrow::Vector6d;
using marrow::match::bins_of;
using marrow::match::Patch;

struct Options : marrow::match::IntensityOptions {
  int bins = 32;

  /// The histogram is of all pixels: what a block adds to its entropy depends on all other blocks.
  Options() { has_blocks = false; }
};

/// Cubic B-splines: the weights of four bins, of which the second begins x before a value, and their slopes.
std::array<double, 4> spline(double x) {
  const double y = 1 - x;
  return {y * y * y / 6, (4 - 6 * x * x + 3 * x * x * x) / 6, (4 - 6 * y * y + 3 * y * y * y) / 6, x * x * x / 6};
}
std::array<double, 4> spline_slope(double x) {
  const double y = 1 - x;
  return {-0.5 * y * y, x * (1.5 * x - 2), -y * (1.5 * y - 2), 0.5 * x * x};
}

/// The joint histogram of radiograph and image. A pixel of the radiograph counts for the bins around its value, by a
/// Parzen window, so that the histogram changes smoothly with the pose (Mattes et al., IEEE Trans Med Imaging 2003).
class Histogram {
 public:
  Histogram(const Patch& patch, int bins) : patch_(patch), bins_(bins) {
    float most = 0;
    for (std::size_t i = 0; i < patch.seen.size(); ++i)
      if (patch.counts[i]) most = std::max(most, patch.rendered[i]);
    seen_ = bins_of(patch.seen, patch.counts, bins);
    joint_.assign(std::size_t(bins) * std::size_t(bins), 0);
    rendered_.assign(std::size_t(bins), 0);
    image_.assign(std::size_t(bins), 0);
    // From 0 to one of four numbers an octave, which hardly ever changes with a small motion.
    if (most > 0) per_unit_ = (bins - 3) / std::exp2(std::ceil(4 * std::log2(double(most))) / 4);
    for (std::size_t i = 0; i < patch.seen.size(); ++i) {
      if (!patch.counts[i]) continue;
      const Place place = place_of(i);
      const std::array<double, 4> weights = spline(place.x);
      for (std::size_t k = 0; k < 4; ++k) joint_[at(place, k)] += weights[k], rendered_[place.first + k] += weights[k];
      image_[place.seen] += 1;
      n_ += 1;
    }
    together_ = marrow::match::entropy(joint_, n_);
    apart_ = marrow::match::entropy(rendered_, n_) + marrow::match::entropy(image_, n_);
    is_flat_ = n_ < 16 || !(marrow::match::entropy(image_, n_) > 0) || !(per_unit_ > 0) || !(together_ > 0);
  }

  /// 2 - (H(a) + H(b)) / H(a, b): 0 if a and b determine each other, 1 if they are independent.
  double value() const { return is_flat_ ? 1 : 2 - apart_ / together_; }

  /// The curvature is that of the logarithm of the radiograph's variance where the image has one grey value: mutual
  /// information falls by it if the values are spread normally.
  Cost::Expansion expansion() const {
    Cost::Expansion expansion;
    expansion.value = value();
    if (is_flat_) return expansion;
    std::vector<marrow::match::JointMoments> of_seen(static_cast<std::size_t>(bins_));
    for (std::size_t i = 0; i < patch_.seen.size(); ++i) {
      if (!patch_.counts[i]) continue;
      const Place place = place_of(i);
      const Vector6d slopes = patch_.slopes_at(i);
      marrow::match::JointMoments::Vector values;
      values << slopes, patch_.rendered[i], 0;
      of_seen[place.seen].add(values);
      const std::array<double, 4> weights = spline_slope(place.x);
      double apart = 0, together = 0;
      for (std::size_t k = 0; k < 4; ++k) {
        apart -= weights[k] * std::log(std::max(rendered_[place.first + k], kLeast) / n_);
        together -= weights[k] * std::log(std::max(joint_[at(place, k)], kLeast) / n_);
      }
      const double share = per_unit_ / n_;
      expansion.gradient -= share * (apart / together_ - apart_ * together / (together_ * together_)) * slopes;
    }
    for (const auto& moments : of_seen) {
      if (moments.n < 2) continue;
      const auto spread = moments.spread();
      const double variance = std::max(spread(6, 6) / moments.n, 1 / (per_unit_ * per_unit_));
      expansion.curvature += spread.topLeftCorner<6, 6>() / (variance * n_ * together_);
    }
    return expansion;
  }

 private:
  static constexpr double kLeast = 1e-12;  ///< a count that is 0 but for rounding
  struct Place {
    std::size_t first = 0, seen = 0;
    double x = 0;
  };
  Place place_of(std::size_t i) const {
    const double position = std::clamp(patch_.rendered[i] * per_unit_, 0.0, bins_ - 3 - 1e-9);
    const int first = int(position);
    return {std::size_t(first), std::size_t(seen_.of(patch_.seen[i])), position - first};
  }
  std::size_t at(const Place& place, std::size_t k) const {
    return (place.first + k) * std::size_t(bins_) + place.seen;
  }

  const Patch& patch_;
  const int bins_;
  marrow::match::Bins seen_;
  double per_unit_ = 0, n_ = 0, together_ = 0, apart_ = 0;
  bool is_flat_ = true;
  std::vector<double> joint_, rendered_, image_;
};

marrow::match::WholeMeasure measure_of(const Patch&, const Options& options) {
  return {[bins = options.bins](const Patch& patch) { return Histogram(patch, bins).value(); },
          [bins = options.bins](const Patch& patch) { return Histogram(patch, bins).expansion(); }};
}

constexpr auto mutual_information = marrow::match::intensity_node<measure_of, Options, 1>;

}  // namespace

MARROW_PLUGIN(plugin) {
  auto node = plugin.node("similarity.mutual_information", mutual_information);
  node.summary(
          "2 - normalised mutual information; it assumes no particular relation between the grey values (Studholme et "
          "al. 1999; Penney et al. 1998); it predicts no deviations")
      .trait("unmoved_by_gain")
      .trait("derivatives");
  marrow::match::declare<Options>(node);
  node.option("bins", &Options::bins, "number of bins of each histogram", marrow::at_least(4), marrow::at_most(256));
}
