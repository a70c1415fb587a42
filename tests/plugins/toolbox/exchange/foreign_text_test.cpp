// SPDX-License-Identifier: Apache-2.0
// Texts as programs of other systems store them: with a byte order mark, in UTF-16, with carriage returns as line ends.
// The value must be that of the same text in plain UTF-8 with line feeds, which the other tests of each reader check.
#include "marrow/base/hash.hpp"
#include "marrow/toolbox/exchange/written_files.hpp"
#include "marrow/toolbox/files/volume_file.hpp"
#include "marrow/toolbox/track/track_state.hpp"
#include "tests/harness/comma_locale.hpp"
#include "tests/plugins/toolbox/exchange/values.hpp"

namespace foreign_text_test {

using namespace marrow;
using namespace marrow::test;
using Eigen::Vector3d;
using Path = std::filesystem::path;
using ForeignTexts = InAFolder;

/// By hand: in UTF-16 an ASCII character is its byte and a zero, in the order that the first two bytes show.
std::string utf16(const std::string& ascii, bool big_endian) {
  std::string result = big_endian ? "\xFE\xFF" : "\xFF\xFE";
  for (const char c : ascii) result += big_endian ? std::string{'\0', c} : std::string{c, '\0'};
  return result;
}

std::vector<std::string> stored_otherwise(const std::string& text) {
  return {"\xEF\xBB\xBF" + text,
          with_line_ends(text, "\r"),
          "\xEF\xBB\xBF" + with_line_ends(text, "\r"),
          "\xEF\xBB\xBF" + with_line_ends(text, "\r\n"),
          utf16(text, false),
          utf16(text, true),
          utf16(with_line_ends(text, "\r\n"), false)};
}

template <class T>
Digest read_one(const std::string& node, const Path& path, const shipped::Options& options = {}) {
  return hash_of(read_by<T>(node, path, options));
}
template <class T>
Digest read_list(const std::string& node, const Path& path) {
  return hash_of(shipped::call(node, {}, {{"path", path.string()}}).begin()->second.as_list<T>()[0]);
}
Digest landmarks(const Path& path) { return read_list<Landmarks>("read.landmarks", path); }
Digest seeds(const Path& path) { return read_list<Seeds>("read.seeds", path); }
Digest camera(const Path& path) { return read_one<Camera>("read.camera", path); }
Digest pose(const Path& path) { return read_one<Pose>("read.pose", path); }
Digest mesh(const Path& path) { return read_one<Mesh>("read.mesh", path); }
Digest track(const Path& path) {
  return hash_of(shipped::call("read.tra", {}, {{"path", path.string()}}).at("poses").as_list<Pose>()[1]);
}
Digest folder_of_volume(const Path& path) {
  put(path.parent_path() / "a.raw", std::string("\0\1\2\3\4\5\6\7", 8));
  return hash_of(files::read_volume_file(path.parent_path(), {}));
}
Digest plastimatch(const Path& path) {
  return read_one<Camera>("read.camera", path, {{"image_size_px", std::vector<double>{64, 48}}});
}
Digest rtk(const Path& path) {
  return read_one<Camera>("read.camera", path,
                          {{"image_size_px", std::vector<double>{64, 48}},
                           {"pixel_mm", std::vector<double>{0.5}},
                           {"mirror", "upside_down"}});
}

struct Case {
  const char* name;
  Digest (*read)(const Path&);
  std::string text;
};

const Case kCases[] = {
    {"cam.txt", camera,
     "image size\n640,480\n\ncamera matrix\n1000,0,320\n0,1001,240\n0,0,1\n\nrotation\n0,-1,0\n1,0,0\n0,0,1\n\n"
     "translation\n1\n-2.5\n900\n\n"},
    {"cam.yaml", camera,
     "marrow-camera: 1\nwidth_px: 512\nheight_px: 256\nc_arm:\n  alpha_deg: 0\n  beta_deg: 90\n"
     "  source_to_detector_mm: 1000\n  source_to_isocentre_mm: 600\n  pixel_mm: 0.5\n"},
    {"matrix.txt", plastimatch,
     "31.5 23.5\n1000 0 0 0\n0 1000 0 0\n0 0 1 1000\n1000\n1500\n0 0 1\nExtrinsic\n1 0 0 0\n0 1 0 0\n0 0 1 1000\n"
     "0 0 0 1\nIntrinsic\n1000 0 0 0\n0 1000 0 0\n0 0 1 0\n"},
    {"geometry.xml", rtk,
     "<?xml version=\"1.0\"?>\n<RTKThreeDCircularGeometry version=\"3\">\n"
     "<SourceToIsocenterDistance>1000</SourceToIsocenterDistance>\n"
     "<SourceToDetectorDistance>1500</SourceToDetectorDistance>\n<Projection>\n<GantryAngle>30</GantryAngle>\n"
     "</Projection>\n</RTKThreeDCircularGeometry>\n"},
    {"points.fcsv", landmarks,
     "# Markups fiducial file version = 4.11\n# CoordinateSystem = LPS\n"
     "# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n"
     "1,1.5,2,3,0,0,0,1,1,1,0,A,,\n2,4,5,6,0,0,0,1,1,1,0,B,,\n"},
    {"points.mrk.json", landmarks,
     "{\"markups\": [{\"coordinateSystem\": \"LPS\",\n\"controlPoints\": [{\"label\": \"A\",\n\"position\": [1, 2, "
     "3]}]}]}\n"},
    {"points.yaml", landmarks,
     "marrow-landmarks: 1\nfragments:\n  distal:\n    points:\n      notch: [1.5, 18.0, 12.2]\n"},
    {"seeds.yaml", seeds, "marrow-seeds: 1\nfragments:\n  distal:\n    seeds: [[-1, 14, 80]]\n"},
    {"pose.tfm", pose,
     "#Insight Transform File V1.0\n#Transform 0\nTransform: AffineTransform_double_3_3\n"
     "Parameters: 1 0 0 0 1 0 0 0 1 -12 14 -6\nFixedParameters: 0 0 0\n"},
    {"pose.yaml", pose,
     "marrow-pose: 1\ntarget: world\nsource: ct\nmatrix: [[1, 0, 0, 4], [0, 1, 0, 5], [0, 0, 1, 6], [0, 0, 0, 1]]\n"},
    {"way.tra", track, "1,0,0,1,0,1,0,2,0,0,1,3,0,0,0,1\n1,0,0,1,0,1,0,2,0,0,1,4,0,0,0,1\n"},
    {"m.obj", mesh, "v 0 0 0\nv 10 0 0\nv 0 10 0\nv 0 0 10\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"},
    {"v/a.nhdr", folder_of_volume,
     "NRRD0004\ntype: uchar\ndimension: 3\nspace: left-posterior-superior\nsizes: 2 2 2\n"
     "space directions: (1,0,0) (0,1,0) (0,0,1)\nencoding: raw\nspace origin: (5,6,7)\ndata file: a.raw\n"},
    {"w/a.mhd", folder_of_volume,
     "ObjectType = Image\nNDims = 3\nBinaryData = True\nOffset = 5 6 7\nElementSpacing = 1 1 1\nDimSize = 2 2 2\n"
     "ElementType = MET_UCHAR\nElementDataFile = a.raw\n"},
};

TEST_F(ForeignTexts, GiveTheValueOfThePlainText) {
  for (const Case& one : kCases) {
    const Path path = folder / one.name;
    put(path, one.text);
    const Digest expected = one.read(path);
    int number = 0;
    for (const std::string& stored : stored_otherwise(one.text)) {
      put(path, stored);
      Digest read;
      EXPECT_NO_THROW(read = one.read(path))
          << one.name << " " << number << ": " << message_of([&] { one.read(path); });
      EXPECT_EQ(read, expected) << one.name << ", stored in way " << number;
      ++number;
    }
  }
}

// A script of a person in Germany may have called locale.setlocale(). What is written and read must stay the same.
TEST_F(ForeignTexts, TheLocaleOfTheProcessDoesNotCount) {
  std::vector<Digest> before;
  for (const Case& one : kCases) {
    put(folder / one.name, one.text);
    before.push_back(one.read(folder / one.name));
  }
  const Camera camera = read_by<Camera>("read.camera", folder / "cam.txt");
  const Pose pose = read_by<Pose>("read.pose", folder / "pose.tfm");
  const Mesh mesh = read_by<Mesh>("read.mesh", folder / "m.obj");
  const Seeds seeds{"distal", {{0.5, 1.25, -3.75}}, true};
  const auto written = [&] {
    using namespace exchange;
    const shipped::Options pixel{{"pixel_mm", std::vector<double>{0.5}}};
    std::string all = written_by<FcsvFile>("write.fcsv", "seeds", seeds, folder / "o.fcsv");
    all += written_by<MarkupsFile>("write.markups", "seeds", seeds, folder / "o.mrk.json");
    all += written_by<ItkTransformFile>("write.tfm", "pose", pose, folder / "o.tfm");
    all += written_by<ObjFile>("write.obj", "mesh", mesh, folder / "o.obj");
    all += written_by<VtpFile>("write.vtp", "mesh", mesh, folder / "o.vtp");
    all += written_by<PlastimatchFile>("write.plastimatch", "camera", camera, folder / "o.txt", pixel);
    writing::write(pose, folder / "o.yaml");
    return all + bytes_of(folder / "o.yaml");
  };
  const std::string written_before = written();
  MARROW_NEED_COMMA_LOCALE(german);
  EXPECT_EQ(written(), written_before);
  std::size_t number = 0;
  for (const Case& one : kCases) EXPECT_EQ(one.read(folder / one.name), before[number++]) << one.name;
}

// Lines in messages are those that an editor shows.
TEST_F(ForeignTexts, FaultsAreNamedAtTheirLine) {
  put(folder / "a.tra", utf16("1,0,0,1,0,1,0,2,0,0,1,3,0,0,0,1\r\n1,0,0\r\n", false));
  EXPECT_SAYS(track(folder / "a.tra"), "a.tra:2: expected the 16 numbers of a 4x4 matrix, got 3");
  put(folder / "a.yaml", "marrow-pose: 1\rtarget: world\rsource: world\r");
  EXPECT_SAYS(pose(folder / "a.yaml"), "a.yaml:3:9: pose: source: expected the frame of what was registered");
}

// Files that were refused, or read as if the first line were a word of its own. The values are those written in them.
TEST_F(ForeignTexts, FilesOfOthersWithAByteOrderMark) {
  MARROW_NEED_DATA(data, "strangers/text/bom");
  const auto named = [](const Path& path) {
    return shipped::call("read.landmarks", {}, {{"path", path.string()}}).at("landmarks").as_list<Landmarks>();
  };
  EXPECT_EQ(named(data / "points.fcsv")[0].points.at(1).model_mm, Vector3d(4, 5, 6));
  EXPECT_EQ(named(data / "points.mrk.json")[0].points.at(0).name, "A");
  EXPECT_EQ(read_by<Camera>("read.camera", data / "cam.txt").intrinsics(0, 0), 3207.42975342);
  EXPECT_EQ(read_by<Pose>("read.pose", data / "pose.yaml").world_from_model.translation_mm, Vector3d(4, 5, 6));
  EXPECT_EQ(read_by<Pose>("read.pose", data / "pose.tfm").world_from_model.translation_mm, Vector3d(12, -14, 6));
  const auto track = shipped::call("read.tra", {}, {{"path", (data / "track.tra").string()}});
  EXPECT_EQ(track.at("poses").as_list<Pose>()[1].world_from_model.translation_mm, Vector3d(1, 2, 4));
  for (const char* name : {"m.obj", "m.ply", "m.stl"}) EXPECT_NO_THROW(mesh(data / name)) << name;
  EXPECT_NO_THROW(read_one<Camera>("read.camera", data / "g.xml",
                                   {{"image_size_px", std::vector<double>{64, 48}},
                                    {"pixel_mm", std::vector<double>{0.5}},
                                    {"mirror", "upside_down"}}));
  for (const char* name : {"v", "w"}) {
    const Volume volume = files::read_volume_file(data / name, {});
    EXPECT_EQ(volume.grid.origin_mm, Vector3d(5, 6, 7)) << name;
    EXPECT_EQ(volume.values[7], 7) << name;
  }
}

}  // namespace foreign_text_test
