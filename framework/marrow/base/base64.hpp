// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <string_view>

#include "marrow/base/export.hpp"

namespace MARROW_EXPORT marrow {

/// Encodes bytes as base64 text (RFC 4648, with padding).
std::string base64(std::string_view bytes);

}  // namespace marrow
