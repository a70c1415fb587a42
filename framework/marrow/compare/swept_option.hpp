// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <string>

#include "marrow/base/diagnostics.hpp"
#include "marrow/base/export.hpp"

namespace MARROW_EXPORT marrow {
namespace compare {

/// An option whose numbers are tried over a range.
struct SweptOption {
  std::string key;  ///< node.option
  std::array<double, 2> range{};
  bool is_log = false;    ///< spread evenly over the logarithm
  bool is_whole = false;  ///< rounded to whole numbers
  Place place;

  /// The value at a fraction, 0 to 1, of the range.
  double value_at(double fraction) const;
  /// The fraction of the range at which a value lies; 0 below it, 1 above it.
  double fraction_of(double value) const;
};

}  // namespace compare
}  // namespace marrow
