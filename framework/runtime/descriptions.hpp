// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/runtime/library.hpp"

namespace marrow {

/// Removes what is kept of a library that turned out to be another than described, so that it is described anew.
void forget_description(const LibraryInfo& library);

/// What a person does about a description that is wrong.
std::string cure_of_description(const std::filesystem::path& library);

}  // namespace marrow
