// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>

namespace marrow::network {

/// The bytes of a model. Throws Error if it cannot be read, is empty, or has more than 512 MB.
std::string model_file(const std::filesystem::path& file);

/// What OpenCV's message about a model means: which layer it does not know, or that the file is damaged, and what to
/// do.
std::string reason_of_model(const std::string& message);

}  // namespace marrow::network
