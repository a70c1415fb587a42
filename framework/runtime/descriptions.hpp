// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/runtime/library.hpp"

namespace marrow {

/// Removes the kept description of a library that turned out to be different, so that the library is described anew.
void forget_description(const LibraryInfo& library);

/// What a person can do about a wrong description.
std::string cure_of_description(const std::filesystem::path& library);

}  // namespace marrow
