// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

namespace marrow {

/// A share, from 0 to 1, as a number of percent, with at least so many decimals. More are shown where the share would
/// else read as 0 or 100 and is neither: 1 of 3000 is 0.03, with one decimal.
std::string percent_text(double share, int decimals);

}  // namespace marrow
