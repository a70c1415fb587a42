// SPDX-License-Identifier: Apache-2.0
#pragma once
// The probability that a pose is off, from figures that speak for or against it.
#include <filesystem>
#include <string>
#include <vector>

#include "judged.hpp"

namespace marrow::verdict {

/// A logistic regression on the figures' logarithms: log odds = bias + sum of weight * log(1 + figure / scale). No
/// weight is negative, so a larger figure never makes a pose more likely to be right.
struct FailureModel {
  struct Term {
    std::string figure;
    double scale = 1, weight = 0;
    double absent = 0;  ///< the figure's value where a registration does not give it
  };
  double bias = 0, doubtful_above = 0, wrong_above = 0.5;
  std::vector<Term> terms;

  /// How much a figure adds to the log odds.
  struct Contribution {
    const Term* term;
    const Metric* figure;  ///< null if it is absent
    double log_odds = 0;
  };
  std::vector<Contribution> contributions(const Evidence& evidence) const;
  double probability(const std::vector<Contribution>& contributions) const;
};

/// Reads a file of tools/studies/fit_verdict. Throws Error with all of its faults.
FailureModel read_failure_model(const std::filesystem::path& path);

}  // namespace marrow::verdict
