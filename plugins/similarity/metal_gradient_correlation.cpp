// SPDX-License-Identifier: Apache-2.0
// Behind metal hardly any direct radiation arrives, so what the image shows there is scattered radiation, and more
// metal changes nothing. The radiograph of the implant is made alike before it is compared.
#include <algorithm>
#include <cmath>

#include "marrow/similarity/patches.hpp"

namespace {

using marrow::match::Patch;

struct MetalOptions : marrow::match::PatchOptions {
  double opaque_mm = 10;
  double scatter = 0.3;
};

/// -log(exp(-r / opaque_mm) + scatter): what is measured behind a line integral r.
Patch as_measured(const Patch& patch, const MetalOptions& options) {
  Patch result = patch;
  for (std::size_t i = 0; i < result.rendered.size(); ++i) {
    const double direct = std::exp(-double(patch.rendered[i]) / options.opaque_mm), all = direct + options.scatter;
    result.rendered[i] = float(-std::log(all));
    const auto slope = float(direct / (options.opaque_mm * all));
    for (std::vector<float>& slopes : result.slopes)
      if (!slopes.empty()) slopes[i] *= slope;
  }
  return result;
}

marrow::match::SumMeasure measure_of(const Patch&, const MetalOptions& options) {
  return marrow::match::correlation_in_squares(options.patch_pixels, [options](const Patch& patch) {
    marrow::match::Gradients g = marrow::match::gradients_of(as_measured(patch, options));
    return std::vector<Patch>{std::move(g.u), std::move(g.v)};
  });
}

constexpr auto metal_gradient_correlation = marrow::match::intensity_node<measure_of, MetalOptions>;

}  // namespace

MARROW_PLUGIN(plugin) {
  auto node = plugin.node("similarity.metal_gradient_correlation", metal_gradient_correlation);
  node.summary(
          "similarity.patch_gradient_correlation for implants: the radiograph saturates, as images do behind metal")
      .trait("unmoved_by_gain")
      .trait("derivatives");
  marrow::match::declare<MetalOptions>(node);
  node.option("patch_pixels", &MetalOptions::patch_pixels, "side of the squares, counted in compared pixels",
              marrow::at_least(5), marrow::at_most(201))
      .option("opaque_mm", &MetalOptions::opaque_mm,
              "the line integral behind which 1 / e of the direct radiation arrives", marrow::at_least(0.01))
      .option("scatter", &MetalOptions::scatter, "scattered radiation, as a share of the direct one beside the implant",
              marrow::at_least(0), marrow::at_most(10), marrow::unit(""));
}
