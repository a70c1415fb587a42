// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <vector>

#include "marrow/toolbox/files/sequence_files.hpp"

namespace marrow::read_sequence {

/// Whether a file is a video by its extension.
bool is_video(const std::filesystem::path& path);

/// Frames of a video as grey images of 8 bits. Throws Error if the file cannot be decoded, or ends before its header
/// says and the range has no end of its own.
std::vector<Image> read_video(const std::filesystem::path& path, const files::FrameRange& range);

}  // namespace marrow::read_sequence
