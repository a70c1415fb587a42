// SPDX-License-Identifier: Apache-2.0
#include "value_checks.hpp"

#include <cmath>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"

namespace marrow::compare {
namespace {

void check_each(const std::vector<double>& values, const std::string& what, bool may_be_infinite) {
  if (values.empty()) throw Error("there are no " + what + "s; give at least one");
  for (std::size_t i = 0; i < values.size(); ++i)
    if (std::isnan(values[i]) || (std::isinf(values[i]) && !may_be_infinite))
      throw Error(
          formatted("{} {} of {} is {:f}, which is no number to compare; count its run as failed, and give the rest",
                    what, i + 1, values.size(), values[i]));
}

}  // namespace

void check_finite(const std::vector<double>& values, const std::string& what) { check_each(values, what, false); }

void check_numbers(const std::vector<double>& values, const std::string& what) { check_each(values, what, true); }

void check_confidence(double confidence) {
  if (!(confidence > 0 && confidence < 1))
    throw Error(formatted("the confidence is {:f}; give a fraction between 0 and 1, such as 0.95", confidence));
}

void check_resamples(std::size_t resamples) {
  if (resamples < 1000)
    throw Error(formatted("got {} resamples; the bounds need at least 1000 (10000 is the default)", resamples));
}

}  // namespace marrow::compare
