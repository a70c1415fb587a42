// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <set>
#include <string>
#include <vector>

#include "marrow/compare/experiment.hpp"

namespace marrow::compare {

/// The parts of a figure's path, errors.distal.mtre_mm: the output, an item of each of its lists, and the figure, whose
/// name may have dots too.
std::vector<std::string> parts_of_path(const std::string& path);
/// The name of the figure, which begins with the part of this number.
std::string figure_from(const std::vector<std::string>& parts, std::size_t first);

/// The output of a pipeline with this name. Reports a fault if there is none.
const PipelineOutput* find_output(const Pipeline& pipeline, const std::string& name, const Place& place,
                                  Diagnostics& diagnostics);

/// The paths of all figures that a pipeline can give for a case without a truth: "contour.FRAGMENT.rms_px", and
/// "contour.FRAGMENT.*" where the node does not tell its names. In their order.
MARROW_EXPORT_TO_TESTS std::vector<std::string> figures_without_truth(const Pipeline& pipeline);

/// Checks the figures that an experiment names against the pipelines of its variants: that there is such an output of
/// figures, that the path names an item of each of its lists, and that its node can make such a figure. Only the data
/// show which items exist: items() returns what must be looked up there.
class FigureChecker {
 public:
  FigureChecker(const Experiment& experiment, Diagnostics& diagnostics)
      : experiment_(experiment), diagnostics_(diagnostics) {}
  /// For each variant, in their order. A path that has a fault in the first one is not looked at in the others.
  void check(std::size_t variant, const Pipeline& pipeline);
  const std::vector<NamedItem>& items() const { return items_; }

 private:
  void check(std::size_t variant, const Pipeline& pipeline, const std::string& path, const Place& place);
  void look_at(std::size_t variant, const Pipeline& pipeline, const std::string& path, const Place& place,
               Diagnostics& faults);
  void add_items(std::size_t variant, const Pipeline& pipeline, const PipelineOutput& output,
                 const std::vector<std::string>& parts, NamedItem item);

  const Experiment& experiment_;
  Diagnostics& diagnostics_;
  std::set<std::string> faulty_;  ///< paths with a fault in the first variant
  std::vector<NamedItem> items_;
  std::set<std::string> known_items_;  ///< by path, axis and what the maker's output depends on
};

}  // namespace marrow::compare
