// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "marrow/domain/camera.hpp"

namespace marrow::files {

/// The frames of a sequence that are read, counted from 1.
struct FrameRange {
  int first = 1;
  int last = 0;   ///< 0: the last one that there is
  int every = 1;  ///< 2: every second one, from `first` on
};

/// The numbers of the wanted frames, if there are `count`. Throws Error, beginning with `what`, if there is no frame
/// `first` or `last`, or if `last` lies before `first`.
std::vector<int> frames_of(const FrameRange& range, int count, const std::string& what);

/// The images of a folder, one a frame, in the order of their numbers. The pattern selects them by their paths from the
/// folder: * stands for any characters but /, ? for one. An empty pattern selects by content all PNG, TIFF and DICOM
/// files; if there are none, JPEG and BMP; else files for volumes. The names may differ only in a number, and no number
/// may be missing. Throws Error otherwise.
std::vector<std::filesystem::path> frame_files(const std::filesystem::path& folder, const std::string& pattern);

/// An image of a folder.
struct NumberedFile {
  std::filesystem::path file;
  long long number = 0;      ///< in its name
  std::size_t position = 0;  ///< among all images of the folder, in the order of their numbers, from 0
};

/// The image with this number in its name, of those that frame_files() takes without a pattern. Here numbers may be
/// missing between the others. The number of an only image is the last one in its name. Throws Error if there is no
/// such image, with the numbers that there are, if two have the same number, or if the names differ in more than it.
NumberedFile numbered_file(const std::filesystem::path& folder, long long number);

/// Frames of one file, each as read_image_file() returns it: pages of a TIFF, frames of a DICOM file, slices of a file
/// for volumes.
std::vector<Image> read_image_frames(const std::filesystem::path& path, const FrameRange& range);

}  // namespace marrow::files
