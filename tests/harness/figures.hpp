// SPDX-License-Identifier: Apache-2.0
#pragma once
// Figures of merit against what they must be.
#include <gtest/gtest.h>

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "shipped.hpp"

namespace marrow::test {

using Figures = std::map<std::string, double>;

/// Each of these figures is there, and within a tolerance of its value.
inline void expect_figures(const Figures& found, const std::vector<std::pair<std::string, double>>& expected,
                           double tolerance) {
  for (const auto& [name, value] : expected)
    if (const auto figure = found.find(name); figure == found.end())
      ADD_FAILURE() << "there is no figure " << name;
    else
      EXPECT_NEAR(figure->second, value, tolerance) << name;
}
inline void expect_figures(const Value& metrics, const std::vector<std::pair<std::string, double>>& expected,
                           double tolerance) {
  ASSERT_FALSE(metrics.is_absent());
  expect_figures(node_test::figures_of(metrics), expected, tolerance);
}

}  // namespace marrow::test
