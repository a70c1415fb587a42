// SPDX-License-Identifier: Apache-2.0
// Behind metal hardly any direct radiation arrives, so what the image shows there is scattered radiation, and more
// metal changes nothing. The radiograph of the implant is made alike before it is compared.
#include <algorithm>
#include <cmath>

#include "marrow/similarity/patches.hpp"

namespace {

using marrow::match::Patch;
using marrow::match::Tally;

struct MetalOptions : marrow::match::PatchOptions {
  double opaque_mm = 10;
  double scatter = 0.3;
};

/// -log(exp(-r / opaque_mm) + scatter): what is measured behind a line integral r.
Patch as_measured(const Patch& patch, const MetalOptions& options) {
  Patch result = patch;
  for (float& value : result.rendered)
    value = float(-std::log(std::exp(-double(value) / options.opaque_mm) + options.scatter));
  return result;
}

marrow::match::SumMeasure measure_of(const Patch&, const MetalOptions& options) {
  const auto add = [options](const Patch& patch, Tally& tally) {
    const marrow::match::Gradients g = marrow::match::gradients_of(as_measured(patch, options));
    marrow::match::add_patch_correlations(patch, g.rendered_u, g.seen_u, g.counts, options.patch_pixels, tally);
    marrow::match::add_patch_correlations(patch, g.rendered_v, g.seen_v, g.counts, options.patch_pixels, tally);
  };
  return {add, marrow::match::value_of_patch_correlations};
}

constexpr auto metal_gradient_correlation = marrow::match::intensity_node<measure_of, MetalOptions>;

}  // namespace

MARROW_PLUGIN(plugin) {
  auto node = plugin.node("similarity.metal_gradient_correlation", metal_gradient_correlation);
  node.summary(
          "similarity.patch_gradient_correlation for implants: the radiograph saturates, as images do behind metal")
      .trait("unmoved_by_gain");
  marrow::match::declare<MetalOptions>(node);
  node.option("patch_pixels", &MetalOptions::patch_pixels, "side of the squares, counted in compared pixels",
              marrow::at_least(5), marrow::at_most(201))
      .option("opaque_mm", &MetalOptions::opaque_mm,
              "the line integral behind which 1 / e of the direct radiation arrives", marrow::at_least(0.01))
      .option("scatter", &MetalOptions::scatter, "scattered radiation, as a share of the direct one beside the implant",
              marrow::at_least(0), marrow::at_most(10), marrow::unit(""));
}
