// SPDX-License-Identifier: Apache-2.0
// The readers of files, by target. The first byte of an input chooses one of the target's rows; the rest is the file.
#include <errno.h>
#include <zlib.h>

#include "tests/harness/without_registration.hpp"  // before the nodes

#include "plugins/read/case.cpp"

#include "marrow/camera/points_file.hpp"
#include "marrow/toolbox/calibration/board.hpp"
#include "marrow/toolbox/exchange/autoscoper_trial.hpp"
#include "marrow/toolbox/exchange/itk_transform.hpp"
#include "marrow/toolbox/exchange/markups.hpp"
#include "marrow/toolbox/exchange/surface_file.hpp"
#include "marrow/toolbox/files/label_file.hpp"
#include "marrow/toolbox/files/samples_out.hpp"
#include "marrow/toolbox/files/xray_header.hpp"
#include "node_readers.hpp"
#include "plugins/read/video.hpp"
#include "target.hpp"

namespace {

using marrow::fuzz::put;
namespace exchange = marrow::exchange;
namespace files = marrow::files;
using Path = std::filesystem::path;
using Bytes = std::string_view;

// ---- volumes, with their labels

void read_volume(const Path& path) {
  files::VolumeReading reading;
  if (path.extension() == ".tif") reading.voxel_size_mm = {1, 1, 1};
  marrow::fuzz::expect_value_or_error([&] { files::read_volume_file(path, reading); });
  const files::LabelMap map = files::read_label_file(path);
  files::mask_of(map, map.segments[0]);
}

/// Packs the bytes, so that the input's bytes are those of the header and not of the packing.
Path packed(Bytes bytes) {
  const Path path = put("a.nii.gz", "");
  const gzFile file = gzopen(path.c_str(), "wb1");
  gzwrite(file, bytes.data(), unsigned(bytes.size()));
  gzclose(file);
  return path;
}

/// A folder with a header, and the file that the header should name.
Path detached(const std::string& name, Bytes header) {
  put(name + "/a.raw", std::string(64, 'x'));
  return put(name + "/a." + name, header).parent_path();
}

// ---- images

int frame = 1;  ///< or 2, as the input says before its row

void read_image(const Path& path) { files::read_image_file(path, frame == 1 ? 0 : 2); }

/// The chunks of a PNG with right checksums, so that the code behind these is tried, too.
std::string with_checksums(Bytes bytes) {
  const auto big_endian = [](const char* at) {
    std::uint32_t value = 0;
    for (int i = 0; i < 4; ++i) value = value << 8 | std::uint8_t(at[i]);
    return value;
  };
  std::string png(bytes);
  for (std::size_t at = 8; at + 12 <= png.size();) {
    const std::uint32_t length = big_endian(png.data() + at);
    if (length > png.size() - at - 12) break;
    const auto checksum = std::uint32_t(crc32(0, reinterpret_cast<const Bytef*>(png.data() + at + 4), length + 4));
    for (int i = 0; i < 4; ++i) png[at + 8 + length + std::size_t(i)] = char(checksum >> (24 - 8 * i));
    at += 12 + std::size_t(length);
  }
  return png;
}

files::FrameRange range() { return frame == 1 ? files::FrameRange() : files::FrameRange{2, 3, 2}; }

void read_video(Bytes bytes) {
  const Path video = put("a.avi", bytes);
  if (const char* const container = marrow::read::video_container(video))
    marrow::read::read_video(video, container, range());
}

// ---- a case

/// Beside case.yaml lie the files that it may name: an image of 4 x 4, a CT of 2 x 2 x 2 and a camera.
void read_case_text(Bytes text) {
  static const bool once = [] {
    const std::string grey(16, '\7');
    put("case/a.png", files::png_of(4, 4, 1, files::Sample::u8, grey.data()));
    put("case/ct.mha",
        "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nDimSize = 2 2 2\n"
        "ElementType = MET_SHORT\nElementDataFile = LOCAL\n0123456789abcdef");
    put("case/a.txt",
        "image size\n4,4\n\ncamera matrix\n1000,0,2\n0,1000,2\n0,0,1\n\nrotation\n1,0,0\n0,1,0\n0,0,1\n\n"
        "translation\n0\n0\n900\n");
    return true;
  }();
  (void)once;
  marrow::Context context;
  read_case({put("case/case.yaml", text).parent_path(), {}}, context);
}

// ---- the table

struct Reader {
  char letter;
  void (*read)(Bytes file);
};

const exchange::ImageSize kSize{{64, 48}, {0.5}, {}};

// HDF5 and VTK read .h5 and .vtp themselves, and reserve as much memory as a damaged file asks for. The limits of the
// nodes' own process stop them, so these two formats are not tried here.
const std::map<std::string, std::vector<Reader>> kReaders{
    {"volume",
     {{'m', [](Bytes b) { read_volume(put("a.mha", b)); }},
      {'d', [](Bytes b) { read_volume(detached("mhd", b)); }},
      {'r', [](Bytes b) { read_volume(put("a.nrrd", b)); }},
      {'h', [](Bytes b) { read_volume(detached("nhdr", b)); }},
      {'n', [](Bytes b) { read_volume(put("a.nii", b)); }},
      {'z', [](Bytes b) { read_volume(packed(b)); }},
      {'g', [](Bytes b) { read_volume(put("a.nii.gz", b)); }},
      {'t', [](Bytes b) { read_volume(put("a.tif", b)); }}}},
    {"image",
     {{'c', [](Bytes b) { read_image(put("a.png", with_checksums(b))); }},
      {'p', [](Bytes b) { read_image(put("a.png", b)); }},
      {'t', [](Bytes b) { read_image(put("a.tif", b)); }},
      {'j', [](Bytes b) { read_image(put("a.jpg", b)); }},
      {'b', [](Bytes b) { read_image(put("a.bmp", b)); }}}},
    {"sequence",
     {{'t', [](Bytes b) { marrow::fuzz::read_track(put("a.tra", b)); }},
      {'p', [](Bytes b) { files::read_image_frames(put("a.tif", b), range()); }},
      {'d', [](Bytes b) { files::read_image_frames(put("a.dcm", b), range()); }},
      {'v', read_video}}},
    {"dicom",
     {{'i', [](Bytes b) { files::read_image_file(put("series/a.dcm", b)); }},
      {'x', [](Bytes b) { files::read_xray_geometry(put("series/a.dcm", b), 1, {}); }},
      {'f', [](Bytes b) { files::read_image_file(put("series/a.dcm", b), 2); }},
      {'s', [](Bytes b) { files::read_volume_file(put("series/a.dcm", b).parent_path(), {}); }},
      {'l', [](Bytes b) { files::read_label_file(put("series/a.dcm", b)); }}}},
    {"mesh",
     {{'s', [](Bytes b) { files::read_mesh_file(put("a.stl", b), 1); }},
      {'p', [](Bytes b) { files::read_mesh_file(put("a.ply", b), 1); }}}},
    {"exchange",
     {{'j', [](Bytes b) { exchange::read_marked_landmarks(put("a.mrk.json", b)); }},
      {'f', [](Bytes b) { exchange::read_marked_seeds(put("a.fcsv", b), ""); }},
      {'t', [](Bytes b) { exchange::read_itk_transform(put("a.tfm", b), "world", "ct"); }},
      {'o', [](Bytes b) { exchange::read_surface_file(put("a.obj", b), 1, marrow::Context()); }},
      {'p', [](Bytes b) { exchange::read_plastimatch_camera(put("a.txt", b), kSize); }},
      {'r',
       [](Bytes b) { marrow::read::read_projections(put("a.xml", b), {}, kSize, exchange::Mirror::upside_down, 1); }},
      {'m', [](Bytes b) { exchange::read_maya_camera(put("a.csv", b)); }},
      {'a',
       [](Bytes b) { exchange::volume_of_bone(exchange::read_autoscoper_trial(put("a.cfg", b)), "rad", "a.cfg"); }}}},
    {"case",
     {{'c', read_case_text},
      {'m', [](Bytes b) { files::read_camera_file(put("a.yaml", b)); }},
      {'x', [](Bytes b) { files::read_camera_file(put("a.txt", b)); }},
      {'k', [](Bytes b) { marrow::read::read_calibration_file(put("a.yaml", b)); }},
      {'b', [](Bytes b) { marrow::calibration::read_board_file(put("a.yaml", b)); }},
      {'p', [](Bytes b) { files::read_points_file(put("a.yaml", b)); }},
      {'l', [](Bytes b) { marrow::fuzz::read_landmarks(put("a.yaml", b)); }},
      {'s', [](Bytes b) { files::read_seeds_file(put("a.yaml", b)); }},
      {'o', [](Bytes b) { files::read_pose_file(put("a.yaml", b)); }},
      {'h', [](Bytes b) { marrow::fuzz::read_implant_holes(put("a.yaml", b)); }}}}};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::string target = program_invocation_short_name + std::string_view("fuzz_").size();
  static const std::vector<Reader>& readers = kReaders.at(target);
  marrow::fuzz::Input input(data, size);
  if (target == "image" || target == "sequence") frame = input.choice("12") - '0';
  std::string letters;
  for (const Reader& reader : readers) letters += reader.letter;
  const auto& reader = readers[letters.find(input.choice(letters))];
  marrow::fuzz::expect_value_or_error([&] { reader.read(input.rest); });
  return 0;
}
