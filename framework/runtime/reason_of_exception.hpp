// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

namespace marrow {

/// What the exception that is being handled says. Plugins may throw anything: if it is no std::exception, its type is
/// named.
std::string reason_of_exception();

}  // namespace marrow
