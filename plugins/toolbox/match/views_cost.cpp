// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/match/views_cost.hpp"

#include <tbb/parallel_for.h>

#include <numeric>

namespace marrow::match {

Blocks Blocks::of(const Camera& camera, int along) {
  // A block's side is a whole number of pixels, or for a smaller image of their halves, quarters and so on.
  constexpr int kLeastForPixels_px = 384;
  const int longer_px = std::max({camera.width_px, camera.height_px, 1});
  int parts = 1;
  while (longer_px * parts < kLeastForPixels_px) parts *= 2;
  const int side = longer_px * parts / along;
  const auto count = [&](int length_px) { return std::max(1, (length_px * parts + side - 1) / side); };
  return {double(side) / parts, count(camera.width_px), count(camera.height_px)};
}

ViewsCost::ViewsCost(std::size_t views, const std::vector<double>& weights) {
  for (std::size_t i = 0; i < views; ++i) weights_.push_back(weight_of(weights, i));
}

double ViewsCost::value(const RigidTransform& world_from_model) const {
  return mean_of(values_of_views(world_from_model));
}

double ViewsCost::mean_of(const std::vector<double>& of_view) const {
  double sum = 0, total = 0;
  for (std::size_t i = 0; i < of_view.size(); ++i) {
    sum += weights_[i] * of_view[i];
    total += weights_[i];
  }
  return sum / total;
}

double ViewsCost::share(std::size_t view) const {
  return weights_[view] / std::accumulate(weights_.begin(), weights_.end(), 0.0);
}

std::vector<double> ViewsCost::without_each_block(const RigidTransform& world_from_model) const {
  const std::vector<Split> views = splits(world_from_model);
  if (std::any_of(views.begin(), views.end(), [](const Split& view) { return view.without_block.empty(); })) return {};
  double all = 0;
  for (std::size_t i = 0; i < views.size(); ++i) all += share(i) * views[i].value;
  std::vector<double> values;
  for (std::size_t i = 0; i < views.size(); ++i)
    for (const double without : views[i].without_block) values.push_back(all + share(i) * (without - views[i].value));
  return values;
}

std::optional<ViewsCost::ViewExpansion> ViewsCost::expansion_in_view(std::size_t, const RigidTransform&,
                                                                     const FragmentFrame&) const {
  return std::nullopt;
}

std::string ViewsCost::silence(std::size_t, const RigidTransform&) const { return {}; }

std::vector<std::string> ViewsCost::silent_views(const RigidTransform& world_from_model) const {
  std::vector<std::string> of_view(weights_.size());
  tbb::parallel_for(std::size_t(0), of_view.size(), [&](std::size_t i) {
    if (weights_[i] > 0) of_view[i] = silence(i, world_from_model);
  });
  std::erase(of_view, "");
  return of_view;
}

std::string ViewsCost::nothing_compared(const RigidTransform& world_from_model) const {
  const std::vector<std::string> silent = silent_views(world_from_model);
  if (std::ptrdiff_t(silent.size()) < std::count_if(weights_.begin(), weights_.end(), [](double w) { return w > 0; }))
    return {};
  std::string text;
  for (const std::string& one : silent) text += (text.empty() ? "" : "; ") + one;
  return text;
}

std::vector<ViewsCost::Split> ViewsCost::splits(const RigidTransform& world_from_model) const {
  std::vector<Split> views(weights_.size());
  tbb::parallel_for(std::size_t(0), views.size(), [&](std::size_t i) { views[i] = split(i, world_from_model); });
  return views;
}

std::vector<double> ViewsCost::values_of_views(const RigidTransform& world_from_model) const {
  std::vector<double> of_view(weights_.size());
  tbb::parallel_for(std::size_t(0), of_view.size(),
                    [&](std::size_t i) { of_view[i] = value_in_view(i, world_from_model); });
  return of_view;
}

}  // namespace marrow::match
