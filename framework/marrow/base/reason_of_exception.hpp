// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "marrow/base/export.hpp"

namespace MARROW_EXPORT marrow {

/// What the exception that is being handled says. Plugins may throw anything: if it is no std::exception, its type is
/// named.
std::string reason_of_exception();

}  // namespace marrow
