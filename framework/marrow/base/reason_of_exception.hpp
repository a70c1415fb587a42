// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "marrow/base/export.hpp"

namespace MARROW_EXPORT marrow {

/// The message of the exception that is being handled. Plugins may throw anything: the type is named if it is not a
/// std::exception.
std::string reason_of_exception();

}  // namespace marrow
