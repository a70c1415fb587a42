// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <itkImageIOBase.h>

#include <filesystem>

#include "samples.hpp"

namespace marrow::read {

/// ITK's reason without the address of the object that it starts with.
std::string reason(const itk::ExceptionObject& error);

/// Reads header and samples through one of ITK's image readers. Throws Error.
Samples read_through(itk::ImageIOBase& io, const std::filesystem::path& path, const std::string& format_name);

}  // namespace marrow::read
