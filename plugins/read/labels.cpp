// SPDX-License-Identifier: Apache-2.0
// Reads the segmentation of another program, one mask for each fragment.
#include <marrow/plugin.hpp>

#include "marrow/toolbox/files/label_file.hpp"

namespace {

using marrow::List, marrow::Volume, marrow::files::LabelMap, marrow::files::Segment;

/// More labels than any program finds in a body: each would become a volume.
constexpr std::size_t kMostUnnamed = 1000;

struct Options {
  std::filesystem::path path;
  std::vector<std::string> labels;
  std::vector<std::string> fragments;
};

std::string name_of(const Segment& segment) {
  return segment.name.empty() ? marrow::formatted("label {}", segment.number) : segment.name;
}

List<Volume> labels(const Options& options, marrow::Context& context) {
  const LabelMap map = marrow::files::read_label_file(options.path);
  List<Volume> masks;
  const auto add = [&](const std::string& name, const Segment& segment) {
    if (masks.find(name))
      throw marrow::Error(options.path.string() + ": two segments are named '" + name +
                          "'; say which by `labels`, with a name for each in `fragments`");
    masks.add(name, marrow::files::mask_of(map, segment));
  };
  if (options.labels.empty() && map.segments.size() > kMostUnnamed)
    throw marrow::Error(marrow::formatted("{}: has {} labels; say which to read by `labels`", options.path.string(),
                                          map.segments.size()));
  if (options.labels.empty())
    for (const Segment& segment : map.segments) add(name_of(segment), segment);
  for (std::size_t i = 0; i < options.labels.size(); ++i) {
    const Segment& segment =
        marrow::files::segment_named(map, options.labels[i], [&](const std::string& line) { context.warn(line); });
    add(options.fragments.empty() ? name_of(segment) : options.fragments[i], segment);
  }
  return masks;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("read.labels", labels)
      .summary("Reads a segmentation of another program: label maps and segments, such as those of TotalSegmentator")
      .out("label", "1 inside, 0 outside, on the part of the file's grid around the fragment; patient axes are LPS",
           marrow::over("fragment"))
      .option("path", &Options::path, "NIfTI, NRRD, .seg.nrrd, MHA, DICOM SEG, or a folder with one DICOM SEG",
              marrow::required())
      .option("labels", &Options::labels, "numbers or names of the labels to read; none: all that the file has")
      .option("fragments", &Options::fragments,
              "the fragment that each of these labels is; none: they are named as the labels")
      .relation(marrow::as_many_or_none("fragments", "labels"));
}
