// SPDX-License-Identifier: Apache-2.0
#include "label_names.hpp"

#include <algorithm>

#include "byte_stream.hpp"
#include "header_lines.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "nifti_header.hpp"

namespace marrow::files {
namespace {

/// A header with more extensions than this has other things in them than names.
constexpr double kMostExtensionBytes = 4 << 20;
constexpr double kMostNumber = 65535;

/// The bytes between the NIfTI header and the samples.
std::string extensions_of(const InputFile& file) {
  const NiftiHeader header = read_nifti_header(file);
  if (!(header.begin > header.least_begin) || !(header.begin <= kMostExtensionBytes)) return {};
  std::string bytes(std::size_t(header.begin), '\0');
  bytes.resize(bytes_of_gzip_or_plain(file)->take(bytes.data(), bytes.size()));
  return bytes.size() > std::size_t(header.least_begin) ? bytes.substr(std::size_t(header.least_begin)) : "";
}

std::optional<int> label_in(const std::string& text) {
  const auto number = number_of(trimmed(text));
  if (!number || *number < 0 || *number > kMostNumber || *number != double(int(*number))) return std::nullopt;
  return int(*number);
}

std::string between(const std::string& text, const std::string& before, const std::string& after) {
  const std::size_t begin = text.find(before);
  if (begin == std::string::npos) return {};
  const std::size_t end = text.find(after, begin + before.size());
  return end == std::string::npos ? "" : text.substr(begin + before.size(), end - begin - before.size());
}

struct BonesOfTask {
  const char* task;
  int first;  ///< the number of the first name; the others follow
  std::vector<std::string> names;
};

std::vector<std::string> counted_names(const std::string& before, int from, int to) {
  std::vector<std::string> names;
  for (int i = from; i != to + (to > from ? 1 : -1); i += to > from ? 1 : -1)
    names.push_back(formatted("{}{}", before, i));
  return names;
}

/// The bones of TotalSegmentator 2 (Wasserthal et al., Radiology: Artificial Intelligence 2023), from the tables of its
/// tasks `total` and `appendicular_bones`.
const std::vector<BonesOfTask>& known_bones() {
  static const std::vector<BonesOfTask> kBones{
      {"total", 25, {"sacrum", "vertebrae_S1"}},
      {"total", 27, counted_names("vertebrae_L", 5, 1)},
      {"total", 32, counted_names("vertebrae_T", 12, 1)},
      {"total", 44, counted_names("vertebrae_C", 7, 1)},
      {"total",
       69,
       {"humerus_left", "humerus_right", "scapula_left", "scapula_right", "clavicula_left", "clavicula_right",
        "femur_left", "femur_right", "hip_left", "hip_right"}},
      {"total", 91, {"skull"}},
      {"total", 92, counted_names("rib_left_", 1, 12)},
      {"total", 104, counted_names("rib_right_", 1, 12)},
      {"total", 116, {"sternum", "costal_cartilages"}},
      {"appendicular_bones",
       1,
       {"patella", "tibia", "fibula", "tarsal", "metatarsal", "phalanges_feet", "ulna", "radius", "carpal",
        "metacarpal", "phalanges_hand"}}};
  return kBones;
}

}  // namespace

std::map<int, std::string> names_in_nifti(const std::filesystem::path& path) {
  std::map<int, std::string> names;
  const std::string text = extensions_of(InputFile(path));
  for (std::size_t at = 0; (at = text.find("<Label ", at)) != std::string::npos;) {
    const std::size_t end = text.find("</Label>", at);
    if (end == std::string::npos) break;
    const std::string label = text.substr(at, end - at);
    const auto number = label_in(between(label, "Key=\"", "\""));
    std::string name = between(label, "<![CDATA[", "]]>");
    if (name.empty()) name = label.substr(std::min(label.size(), label.find('>') + 1));
    if (number && *number > 0 && !trimmed(name).empty()) names[*number] = trimmed(name);
    at = end;
  }
  return names;
}

std::vector<Segment> segments_in_notes(const std::filesystem::path& path,
                                       const std::map<std::string, std::string>& notes, std::size_t layers) {
  std::vector<Segment> segments;
  for (std::size_t i = 0; i < 1000; ++i) {
    const auto note = [&](const char* what, const std::string& missing) {
      const auto found = notes.find(formatted("Segment{}_{}", i, what));
      return found == notes.end() ? missing : trimmed(found->second);
    };
    const std::string id = note("ID", ""), name = note("Name", id);
    if (name.empty()) break;
    // Before 3D Slicer 4.11 each segment was a layer of its own, with the label 1.
    const auto layer = label_in(note("Layer", formatted("{}", i))), number = label_in(note("LabelValue", "1"));
    if (!layer || std::size_t(*layer) >= layers || !number || *number < 1)
      throw Error(
          formatted("{}: its header puts the segment '{}' to the layer {} with the label {}, but there are {} "
                    "layers; it is damaged: save it again",
                    path.string(), shown(name), shown(note("Layer", formatted("{}", i))),
                    shown(note("LabelValue", "1")), layers));
    segments.push_back({*number, name, std::size_t(*layer)});
  }
  return segments;
}

std::optional<KnownLabel> label_of_totalsegmentator(const std::string& name) {
  for (const BonesOfTask& part : known_bones())
    if (const auto at = std::find(part.names.begin(), part.names.end(), name); at != part.names.end())
      return KnownLabel{part.first + int(at - part.names.begin()), part.task};
  return std::nullopt;
}

std::vector<std::string> names_of_totalsegmentator() {
  std::vector<std::string> names;
  for (const BonesOfTask& part : known_bones()) names.insert(names.end(), part.names.begin(), part.names.end());
  return names;
}

}  // namespace marrow::files
