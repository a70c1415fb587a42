// SPDX-License-Identifier: Apache-2.0
#pragma once
// Segmentations that other programs made: files in which the voxels of a structure have its number.
#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "marrow/domain/volume.hpp"

namespace marrow::files {

/// One structure of a label file.
struct Segment {
  int number = 0;         ///< its label in the file (3D Slicer: LabelValue; DICOM: SegmentNumber)
  std::string name;       ///< empty if the file does not name it
  std::size_t layer = 0;  ///< of LabelMap::layers
};

/// All structures of a label file. Segments may overlap if they are on different layers.
struct LabelMap {
  std::filesystem::path path;
  Grid grid;                               ///< patient axes LPS, right-handed
  std::vector<Segment> segments;           ///< those with a voxel, or that the file names
  std::vector<std::vector<float>> layers;  ///< each with grid.count() numbers of segments; 0: none
};

/// Reads a label map from NIfTI, NRRD, .seg.nrrd of 3D Slicer, MHA, or DICOM SEG (a file, or a folder with one). The
/// content tells the format. Names are those in the header of .seg.nrrd, in the SegmentSequence of DICOM, and in the
/// extension that TotalSegmentator writes to NIfTI. Throws Error if the file is damaged or not supported, if its voxels
/// are not whole numbers from 0 to 65535, or if all of them are 0.
LabelMap read_label_file(const std::filesystem::path& path);

/// The segment with this number or name. A name that a file without names lacks is looked up in the table of bones of
/// TotalSegmentator 2; `warn` then gets a line. Throws Error if there is no such segment, if there are several, or if
/// it has no voxel; the message lists those of the file.
const Segment& segment_named(const LabelMap& map, const std::string& label,
                             const std::function<void(const std::string&)>& warn);

/// The voxels of a segment, 1 inside and 0 outside, on the part of the file's grid around it. The part has three voxels
/// more on each side, or fewer where the file's grid ends there.
Volume mask_of(const LabelMap& map, const Segment& segment);

/// The DICOM SEG that `path` is, or the only one that the folder `path` holds; an empty path if there is none. Throws
/// Error if there are several.
std::filesystem::path dicom_segmentation_in(const std::filesystem::path& path);

/// Reads a DICOM SEG (PS3.3 A.51) of the types BINARY, FRACTIONAL (at least half of its greatest value is inside) and
/// LABELMAP. Segments that overlap get layers of their own. Slices that no frame shows are empty. Throws Error if the
/// frames do not lie on an even grid, or if the file is damaged or compressed in a way that is not read.
LabelMap read_dicom_segmentation(const std::filesystem::path& path);

}  // namespace marrow::files
