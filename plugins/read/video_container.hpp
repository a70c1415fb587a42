// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

namespace marrow::read_sequence {

/// FFmpeg's name for the container of a video, by the file's first bytes: AVI, MP4 and MOV, Matroska and WebM, WMV,
/// MPEG. nullptr if the file is none. Throws Error for a list of other files (a playlist), for a container whose frames
/// are in another file, and for a file that is a video by its name only: the key of a result covers only this one file.
const char* video_container(const std::filesystem::path& path);

}  // namespace marrow::read_sequence
