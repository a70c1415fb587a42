// SPDX-License-Identifier: Apache-2.0
#pragma once
// Correlation within small squares. It hardly depends on slow changes of brightness and contrast across the image, such
// as those caused by soft tissue.
#include "marrow/similarity/intensity.hpp"

namespace marrow::match {

/// The margin around the model is a square at least. Otherwise a square that shows its border would be left out or not,
/// as the compared region moves from pixel to pixel, and the cost would jump.
struct PatchOptions : IntensityOptions {
  int patch_pixels = 13;
};

/// 1 - the mean of the correlations of radiograph and image within squares of `side` pixels, half a square apart. Each
/// square is weighted by the variance of the radiograph in it, so the image does not matter where the model shows
/// nothing. A square in which the image is constant counts as 0. `compared` says what is compared: the grey values, or
/// the components of their gradients. Variance-weighted local correlation: LaRose (PhD thesis, Carnegie Mellon
/// University 2001); Knaan and Joskowicz (MICCAI 2003).
SumMeasure correlation_in_squares(int side, std::function<std::vector<Patch>(const Patch&)> compared);

/// Declares inputs, output and options of the nodes that use patches.
template <class Node>
void declare_patches(Node& node) {
  declare<PatchOptions>(node);
  node.option("patch_pixels", &PatchOptions::patch_pixels, "side of the squares, counted in compared pixels",
              at_least(5), at_most(201));
}

}  // namespace marrow::match
