// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <vector>

#include "marrow/toolbox/files/sequence_files.hpp"

namespace marrow::read_sequence {

/// Frames of a video as grey images of 8 bits, or of 16 if the video has more. `container` is what video_container()
/// gives. No other file is opened. Throws Error if the file cannot be decoded, or ends before its header says and the
/// range has no end of its own.
std::vector<Image> read_video(const std::filesystem::path& path, const char* container, const files::FrameRange& range);

}  // namespace marrow::read_sequence
