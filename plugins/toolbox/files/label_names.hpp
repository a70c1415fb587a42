// SPDX-License-Identifier: Apache-2.0
#pragma once
// The names of labels: in the headers of files, and as TotalSegmentator numbers bones.
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "marrow/toolbox/files/label_file.hpp"

namespace marrow::files {

/// The names that TotalSegmentator writes to a NIfTI file: an extension in XML with <Label Key="75">femur_left</Label>.
/// Empty if there are none.
std::map<int, std::string> names_in_nifti(const std::filesystem::path& path);

/// The segments that the notes of a .seg.nrrd name: Segment0_Name, Segment0_LabelValue, Segment0_Layer and so on. Empty
/// if there are none. `layers`: how many the file has. Throws Error if a note names another layer.
std::vector<Segment> segments_in_notes(const std::filesystem::path& path,
                                       const std::map<std::string, std::string>& notes, std::size_t layers);

/// How TotalSegmentator 2 numbers a bone.
struct KnownLabel {
  int number = 0;
  std::string task;  ///< of TotalSegmentator
};
std::optional<KnownLabel> label_of_totalsegmentator(const std::string& name);
/// All names that label_of_totalsegmentator() knows.
std::vector<std::string> names_of_totalsegmentator();

}  // namespace marrow::files
