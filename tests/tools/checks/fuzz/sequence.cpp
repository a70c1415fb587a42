// SPDX-License-Identifier: Apache-2.0
// Sequences: poses of a bone by Autoscoper, pages of a TIFF, frames of a DICOM file, videos.
#include "marrow/toolbox/files/sequence_files.hpp"
#include "plugins/read/video.hpp"
#include "target.hpp"
#include "tests/harness/without_registration.hpp"  // before the node

#include "plugins/read/tra.cpp"

namespace {

using marrow::fuzz::put;

void read_sequence(char format, const marrow::files::FrameRange& range, std::string_view bytes) {
  if (format == 't') read_tra(nullptr, {put("a.tra", bytes)});
  if (format == 'p') marrow::files::read_image_frames(put("a.tif", bytes), range);
  if (format == 'd') marrow::files::read_image_frames(put("a.dcm", bytes), range);
  if (format != 'v') return;
  const std::filesystem::path video = put("a.avi", bytes);
  if (const char* const container = marrow::read::video_container(video))
    marrow::read::read_video(video, container, range);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  marrow::fuzz::Input input(data, size);
  marrow::files::FrameRange range;
  if (input.choice("12") == '2') range = {2, 3, 2};
  const char format = input.choice("tpdv");
  marrow::fuzz::expect_value_or_error([&] { read_sequence(format, range, input.rest); });
  return 0;
}
