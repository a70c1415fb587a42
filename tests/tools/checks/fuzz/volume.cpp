// SPDX-License-Identifier: Apache-2.0
// Volumes and label maps: MetaImage, NRRD, NIfTI and TIFF, also headers with their samples in a separate file.
#include <zlib.h>

#include "marrow/toolbox/files/label_file.hpp"
#include "marrow/toolbox/files/volume_file.hpp"
#include "target.hpp"

namespace {

using marrow::fuzz::put;

/// Packs the bytes as in a .nii.gz, so that the input's bytes are those of the header and not of the packing.
std::string packed(std::string_view bytes) {
  z_stream stream{};
  deflateInit2(&stream, 1, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY);
  std::string result(deflateBound(&stream, uLong(bytes.size())), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = uInt(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(result.data());
  stream.avail_out = uInt(result.size());
  deflate(&stream, Z_FINISH);
  result.resize(stream.total_out);
  deflateEnd(&stream);
  return result;
}

/// A folder with a header, and the file that the header should name.
std::filesystem::path detached(const std::string& name, std::string_view header) {
  const std::filesystem::path file = put(name + "/a." + name, header);
  static const std::string kSamples(64, 'x');
  put(name + "/a.raw", kSamples);
  return file.parent_path();
}

std::filesystem::path file_of(marrow::fuzz::Input& input) {
  switch (input.choice("mdrhnzgt")) {
    case 'm':
      return put("a.mha", input.rest);
    case 'd':
      return detached("mhd", input.rest);
    case 'r':
      return put("a.nrrd", input.rest);
    case 'h':
      return detached("nhdr", input.rest);
    case 'n':
      return put("a.nii", input.rest);
    case 'z':
      return put("a.nii.gz", packed(input.rest));
    case 'g':
      return put("a.nii.gz", input.rest);
    default:
      return put("a.tif", input.rest);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  marrow::fuzz::Input input(data, size);
  const std::filesystem::path path = file_of(input);
  marrow::files::VolumeReading reading;
  if (path.extension() == ".tif") reading.voxel_size_mm = {1, 1, 1};
  marrow::fuzz::expect_value_or_error([&] { marrow::files::read_volume_file(path, reading); });
  marrow::fuzz::expect_value_or_error([&] {
    const marrow::files::LabelMap map = marrow::files::read_label_file(path);
    marrow::files::mask_of(map, map.segments[0]);
  });
  return 0;
}
