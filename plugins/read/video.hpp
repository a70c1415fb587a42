// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "marrow/toolbox/files/sequence_files.hpp"

struct AVFrame;

namespace marrow::read {

/// FFmpeg's name for the container of a video, by the file's first bytes: AVI, MP4 and MOV, Matroska and WebM, WMV,
/// MPEG. nullptr if the file is none. Throws Error for a list of other files (a playlist), for a container whose frames
/// are in another file, and for a file that is a video by its name only: the key of a result covers only this one file.
const char* video_container(const std::filesystem::path& path);

/// Frames of a video as grey images of 8 bits, or of 16 if the video has more. `container` is what video_container()
/// gives. No other file is opened. Throws Error if the file cannot be decoded, or ends before its header says and the
/// range has no end of its own.
std::vector<Image> read_video(const std::filesystem::path& path, const char* container, const files::FrameRange& range);

/// A decoded frame as grey levels from black to white: of 8 bits, or of 16 if it has more than 8. A frame of 12 bits
/// has levels from 0 to 4095. std::nullopt for a kind of pixels that is not read.
std::optional<cv::Mat> grey_of(const AVFrame& frame);

}  // namespace marrow::read
