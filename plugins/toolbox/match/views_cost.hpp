// SPDX-License-Identifier: Apache-2.0
#pragma once
// The common part of costs that are a weighted mean over views.
#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "marrow/toolbox/match/inputs.hpp"

namespace marrow::match {

/// The squares of an image that are left out one at a time to find how uncertain a minimum is. Errors of neighbouring
/// pixels are alike; errors of different squares are taken as independent.
struct Blocks {
  double side_px = 1;
  int columns = 1, rows = 1;

  /// About `along` blocks along the longer side of the image, whatever its pixels are: an image of twice as many pixels
  /// has the same blocks.
  static Blocks of(const Camera& camera, int along = 8);
  int count() const { return columns * rows; }
  /// The block of a pixel. Positions outside the image belong to the nearest block.
  int at(double u_px, double v_px) const {
    return std::clamp(int(v_px / side_px), 0, rows - 1) * columns + std::clamp(int(u_px / side_px), 0, columns - 1);
  }
};

/// A sum of values and a sum of their weights, over a whole image and over each of its blocks.
class BlockSums {
 public:
  struct Sums {
    double values = 0, weights = 0;
  };
  explicit BlockSums(const Blocks& blocks) : blocks_(blocks), of_block_(std::size_t(blocks.count())) {}

  void add(double u_px, double v_px, double value, double weight) {
    all_.values += value;
    all_.weights += weight;
    Sums& block = of_block_[std::size_t(blocks_.at(u_px, v_px))];
    block.values += value;
    block.weights += weight;
  }
  const Sums& all() const { return all_; }
  /// value_of(sums) for the sums without each block in turn.
  template <class ValueOf>
  std::vector<double> without_each(const ValueOf& value_of) const {
    std::vector<double> values;
    for (const Sums& block : of_block_)
      values.push_back(value_of(Sums{all_.values - block.values, all_.weights - block.weights}));
    return values;
  }

 private:
  Blocks blocks_;
  Sums all_;
  std::vector<Sums> of_block_;
};

/// A cost that is the weighted mean over views of a cost in each view.
class ViewsCost : public Cost {
 public:
  /// `weights` are as check_weights() wants them.
  ViewsCost(std::size_t views, const std::vector<double>& weights);

  double value(const RigidTransform& world_from_model) const override;
  std::vector<double> without_each_block(const RigidTransform& world_from_model) const override;
  std::size_t view_count() const override { return weights_.size(); }
  /// The sentences of all views whose weight is not 0; empty if one of these views is not silent.
  std::string nothing_compared(const RigidTransform& world_from_model) const override;
  std::vector<std::string> silent_views(const RigidTransform& world_from_model) const override;

  /// The cost in a view, and the same without each block of the view in turn. For costs that are sums over pixels or
  /// points it takes about as long as value_in_view(). A cost gives no blocks in any view if, at the right pose, single
  /// blocks may prefer another pose. Then the motion of the minimum without a block says nothing about its error.
  struct Split {
    double value = 0;
    std::vector<double> without_block;
  };
  virtual Split split(std::size_t view, const RigidTransform& world_from_model) const = 0;

  /// The quadratic model of the cost in a view as Cost::expansion() defines it, and the same without each block of the
  /// view in turn, or nothing of the latter if the cost gives no blocks.
  struct ViewExpansion {
    Expansion whole;
    std::vector<Expansion> without_block;
  };
  /// By exact derivatives. Absent if the cost has none in a view alone, which is the default.
  virtual std::optional<ViewExpansion> expansion_in_view(std::size_t view, const RigidTransform& world_from_model,
                                                         const FragmentFrame& frame) const;

 protected:
  /// Why a view says nothing about a pose, such as "view 'lateral': the mask hides the whole outline"; empty, the
  /// default, if something is compared there.
  virtual std::string silence(std::size_t view, const RigidTransform& world_from_model) const;
  /// The same as split() for all views, and the values alone. A cost whose views depend on each other overrides both.
  virtual std::vector<Split> splits(const RigidTransform& world_from_model) const;
  virtual std::vector<double> values_of_views(const RigidTransform& world_from_model) const;
  /// The view's part of the weights.
  double share(std::size_t view) const;
  /// The weighted mean of a value for each view.
  double mean_of(const std::vector<double>& of_view) const;

 private:
  std::vector<double> weights_;
};

}  // namespace marrow::match
