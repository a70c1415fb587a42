// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

namespace marrow {

/// The shortest text from which the same number is read again. Whole numbers below 1e15 have all their digits, so that
/// they can also be read as integers.
std::string exact_number(double value);

}  // namespace marrow
