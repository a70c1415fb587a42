// SPDX-License-Identifier: Apache-2.0
#pragma once
// Who a process is, so that a process of another host can tell it from all others. Temporary files and claims carry it.
#include <string>
#include <string_view>

#include "marrow/base/export.hpp"

namespace MARROW_EXPORT marrow {

/// The identity of this process: its host, the boot of the host, the namespaces of process numbers and of times, its
/// number and its start. It is a part of file names, so it has letters, digits and dots only. Those of one host sort by
/// process. For example node07.9f86d081884c7d65.00012345.000001234567.
const std::string& this_process();

/// Whether a text has the form of an identity.
bool is_identity(std::string_view text);

enum class Life { lives, ended, unknown };
/// Whether the process of an identity lives. The system is asked only about processes of this host, boot and namespace:
/// elsewhere the same number means another process. All others are unknown, and so is a text that is not an identity.
Life life_of(std::string_view identity);

}  // namespace marrow
