// SPDX-License-Identifier: Apache-2.0
#pragma once
// Correlation within small squares: what shifts and scales an image slowly from place to place, as soft tissue does,
// changes little.
#include "marrow/toolbox/match/intensity.hpp"

namespace marrow::match {

struct PatchOptions : IntensityOptions {
  int patch_pixels = 13;
};

/// The mean of the correlations of a (of the radiograph) and b (of the image) within squares of `side` pixels, half a
/// square apart, weighted by the variance of a within: where the model shows nothing, the image does not matter. A
/// square of an even image counts as 0; -1 where no square counts. Variance-weighted local correlation: LaRose (PhD
/// thesis, Carnegie Mellon University 2001); Knaan and Joskowicz (MICCAI 2003).
double mean_patch_correlation(const Patch& patch, const std::vector<float>& a, const std::vector<float>& b,
                              const std::vector<char>& counts, int side);

/// Declares inputs, output and options of both nodes.
template <class Node>
void declare_patches(Node& node) {
  declare<PatchOptions>(node);
  node.option("patch_pixels", &PatchOptions::patch_pixels, "side of the squares, in pixels that are compared",
              at_least(5), at_most(201));
}

}  // namespace marrow::match
