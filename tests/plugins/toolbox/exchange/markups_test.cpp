// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/exchange/written_files.hpp"
#include "tests/plugins/toolbox/exchange/values.hpp"

namespace markups_test {

using namespace marrow;
using namespace marrow::test;
using Eigen::Vector3d;
using exchange::FcsvFile, exchange::MarkupsFile;
using Markups = InAFolder;
using exchange::ItkTransformFile;
using ItkTransform = InAFolder;

// As 3D Slicer 5 saves two points, shortened.
const std::string kJson = R"({
    "@schema": "https://github.com/Slicer/Slicer/markups-schema-v1.0.3.json#",
    "markups": [
        {
            "type": "Fiducial",
            "coordinateSystem": "LPS",
            "coordinateUnits": "mm",
            "controlPoints": [
                {
                    "id": "1",
                    "label": "distal-1",
                    "position": [-53.388409961685827, 73.5, 0.25],
                    "orientation": [-1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 1.0],
                    "positionStatus": "defined"
                },
                {
                    "id": "2",
                    "label": "distal-2",
                    "position": [4e1, -5, 6],
                    "positionStatus": "defined"
                },
                {
                    "id": "3",
                    "label": "not placed yet",
                    "position": [0.0, 0.0, 0.0],
                    "positionStatus": "undefined"
                }
            ]
        }
    ]
}
)";

const std::string kFcsv =
    "# Markups fiducial file version = 4.13\n# CoordinateSystem = LPS\n"
    "# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n"
    "1,-53.388409961685827,73.5,0.25,0,0,0,1,1,1,0,distal-1,,,2,0\n"
    "2,40,-5,6,0,0,0,1,1,1,0,\"hip, \"\"left\"\"\",a text,\n";

List<Landmarks> landmarks_at(const std::filesystem::path& path, shipped::Options options = {}) {
  options["path"] = path.string();
  return shipped::call("read.landmarks", {}, options).at("landmarks").as_list<Landmarks>();
}

List<Seeds> seeds_at(const std::filesystem::path& path, shipped::Options options = {}) {
  options["path"] = path.string();
  return shipped::call("read.seeds", {}, options).at("seeds").as_list<Seeds>();
}

const Vector3d kFirst(-53.388409961685827, 73.5, 0.25);

TEST_F(Markups, JsonAsLandmarks) {
  put(folder / "a.mrk.json", kJson);
  const auto landmarks = landmarks_at(folder / "a.mrk.json", {{"fragment", "distal"}});
  EXPECT_EQ(landmarks.names(), std::vector<std::string>{"distal"});
  ASSERT_EQ(landmarks[0].points.size(), 2u) << "the third is not placed";
  EXPECT_EQ(landmarks[0].points[0].name, "distal-1");
  EXPECT_EQ(landmarks[0].points[0].model_mm, kFirst);
  EXPECT_EQ(landmarks[0].points[1].model_mm, Vector3d(40, -5, 6));
  EXPECT_TRUE(landmarks[0].seen.empty());
  EXPECT_EQ(landmarks_at(folder / "a.mrk.json").names(), std::vector<std::string>{"bone"});
}

TEST_F(Markups, FcsvAsLandmarks) {
  put(folder / "a.FCSV", kFcsv);
  const auto landmarks = landmarks_at(folder / "a.FCSV");
  ASSERT_EQ(landmarks[0].points.size(), 2u);
  EXPECT_EQ(landmarks[0].points[0].model_mm, kFirst);
  EXPECT_EQ(landmarks[0].points[1].name, "hip, \"left\"");
}

// RAS has the first two axes the other way round.
TEST_F(Markups, RasBecomesLps) {
  const Vector3d turned(53.388409961685827, -73.5, 0.25);
  put(folder / "a.mrk.json", with(kJson, "\"LPS\"", "\"RAS\""));
  EXPECT_EQ(landmarks_at(folder / "a.mrk.json")[0].points[0].model_mm, turned);
  for (const char* system : {"RAS", "0"}) {
    put(folder / "a.fcsv", with(kFcsv, "= LPS", std::string("= ") + system));
    EXPECT_EQ(landmarks_at(folder / "a.fcsv")[0].points[0].model_mm, turned) << system;
  }
  put(folder / "a.fcsv", with(kFcsv, "= LPS", "= 1"));
  EXPECT_EQ(landmarks_at(folder / "a.fcsv")[0].points[0].model_mm, kFirst);
}

TEST_F(Markups, LabelsOfSeedsNameTheirFragments) {
  put(folder / "a.mrk.json", with(kJson, "distal-2", "proximal_7"));
  const auto seeds = seeds_at(folder / "a.mrk.json");
  EXPECT_EQ(seeds.names(), (std::vector<std::string>{"distal", "proximal"}));
  EXPECT_EQ(seeds[0].fragment, "distal");
  EXPECT_TRUE(seeds[0].wanted);
  EXPECT_EQ(seeds[0].points_mm, std::vector<Vector3d>{kFirst});
  EXPECT_EQ(seeds[1].points_mm, (std::vector<Vector3d>{{40, -5, 6}}));
  const auto together = seeds_at(folder / "a.mrk.json", {{"fragment", "femur"}});
  EXPECT_EQ(together.names(), std::vector<std::string>{"femur"});
  EXPECT_EQ(together[0].points_mm.size(), 2u);
}

TEST_F(Markups, WhatIsWrittenIsReadBackExactlyUnlessThereIsNothing) {
  const Landmarks landmarks{{{"head", {1.0 / 3, -1e-7, 12345.678}},
                             {"comma, \"quote\"", {0.1, -0.2, 0.3}},
                             {"H\xc3\xbc"
                              "fte",
                              {4, 5, 6}}},
                            {},
                            {}};
  const Seeds seeds{"distal part", {{1.0 / 7, 2, 3}, {-4, 5e-9, 6}}, true};
  written_by<MarkupsFile>("write.markups", "landmarks", landmarks, folder / "l.mrk.json");
  written_by<FcsvFile>("write.fcsv", "landmarks", landmarks, folder / "l.fcsv");
  written_by<MarkupsFile>("write.markups", "seeds", seeds, folder / "s.mrk.json");
  written_by<FcsvFile>("write.fcsv", "seeds", seeds, folder / "s.fcsv");
  for (const char* name : {"l.mrk.json", "l.fcsv"})
    EXPECT_EQ(hash_of(landmarks_at(folder / name)[0]), hash_of(landmarks)) << name;
  for (const char* name : {"s.mrk.json", "s.fcsv"}) {
    const auto read = seeds_at(folder / name);
    ASSERT_EQ(read.names(), std::vector<std::string>{"distal part"}) << name;
    EXPECT_EQ(hash_of(read[0]), hash_of(seeds)) << name;
  }
  EXPECT_HAS(bytes_of(folder / "s.mrk.json"), "\"coordinateSystem\": \"LPS\"");
  EXPECT_HAS(bytes_of(folder / "s.fcsv"), "# CoordinateSystem = LPS\n");
  EXPECT_TRUE(shipped::declares("write.markups", exactly_one({"in.landmarks", "in.seeds"})));
  for (const char* node : {"write.markups", "write.fcsv"})
    EXPECT_EQ(shipped::refusal(node, {}), "the node that is wired to 'landmarks' or 'seeds' gave none");
}

TEST_F(Markups, DiagnosesFaultsOfJson) {
  expect_faults(
      folder / "a.mrk.json", kJson,
      {{"", kJson.substr(0, kJson.find("4e1")),
        "a.mrk.json:19: is no JSON from here on; it is cut off or damaged: save the markups again"},
       {"", "[1]", "expected 3D Slicer's markups, got '[1]'"},
       {"", R"({"ROIs": []})", "markups: is missing; expected 3D Slicer's markups, saved as .mrk.json"},
       {"", R"({"markups": 3})", "markups: expected a list, got '3'"},
       {"", R"({"markups": []})", "markups: there is no point in it; place the points in 3D Slicer, and save"},
       {"", R"({"markups": [7]})", "markups[0]: expected an object, got '7'"},
       {"", R"({"markups": [{"controlPoints": [5]}]})", "markups[0].controlPoints[0]: expected an object, got '5'"},
       {"", R"({"markups": [{"controlPoints": {}}]})", "markups[0].controlPoints: expected a list, got '{}'"},
       {"schema-v1.0.3", "schema-v2.0.0", "@schema: expected a version 1 of 3D Slicer's markups, got 'http"},
       {"\"LPS\"", "\"IJK\"", "markups[0].coordinateSystem: expected LPS or RAS, got 'IJK'"},
       {"\"LPS\"", "1", "markups[0].coordinateSystem: expected a text, got '1'"},
       {"\"mm\"", "\"um\"", "markups[0].coordinateUnits: expected mm, got '\"um\"'; save the points in mm"},
       {"controlPoints", "points", "markups[0].controlPoints: is missing; the list has no points; is it"},
       {"[4e1, -5, 6]", "[4e1, -5]", "controlPoints[1].position: expected 3 coordinates, got 2"},
       {"4e1", "4e9", "markups[0].controlPoints[1].position[0]: expected a coordinate in mm of at most 1 km"},
       {"4e1", "4e999", "holds a number too large to be one; it is damaged: save the markups again in 3D"},
       {"4e1", "null", "controlPoints[1].position[0]: expected a number, got 'null'"},
       {"4e1", "NaN", "a.mrk.json:19: is no JSON from here on"},
       {"\"position\": [4e1", "\"place\": [4e1",
        "markups[0].controlPoints[1].position: is missing; each control point needs its three coordinates"},
       {"distal-2", "distal-1", "point 2: its label 'distal-1' is that of point 1; give each its own"},
       {"distal-2", "", "point 2: it has no label; give each point its landmark's name in 3D Slicer"},
       {"distal-2", "a\\nb", "point 2: its label 'a\\x0ab'"},
       {"", std::string(200000, '['), "is no JSON from here on"}},
      [](const auto& path) { landmarks_at(path); });
}

TEST_F(Markups, DiagnosesFaultsOfFcsv) {
  expect_faults(
      folder / "a.fcsv", kFcsv,
      {{"4.13", "3.6", "a.fcsv:1: expected a version 4 or 5 of 3D Slicer's file, got '3.6'"},
       {"= LPS", "= 2", "a.fcsv:2: expected the coordinate system LPS or RAS (also 1 or 0), got '2'"},
       {"# CoordinateSystem = LPS\n", "",
        "a.fcsv:3: no line '# CoordinateSystem = ' came before; add it, with LPS or RAS after the sign"},
       {"", "1,2,3\n", "a.fcsv:1: expected 3D Slicer's '# Markups fiducial file version = ' first"},
       {",label,", ",name,", "a.fcsv:3: there is no column 'label'; expected id,x,y,z"},
       {"id,x,y", "id,y,x", "a.fcsv:3: the columns x, y, z do not follow each other; expected id,x,y,z"},
       {"2,40,-5,6,0,0,0,1,1,1,0,", "2,40,-5,", "a.fcsv:5: expected at least 12 cells, got 6"},
       {"2,40", "2,nan", "a.fcsv:5: expected a coordinate in mm of at most 1 km, got 'nan'"},
       {"2,40", "2,4e7", "a.fcsv:5: expected a coordinate in mm of at most 1 km, got '4e7'"},
       {"2,40", "2,4O", "a.fcsv:5: expected a coordinate in mm of at most 1 km, got '4O'"},
       {"\"\"left\"\"\"", "left", "a.fcsv:5: a quotation mark is not closed; the file is cut off or damaged"},
       {"", kFcsv.substr(0, kFcsv.find("1,-53")), "there is no point in it; expected 3D Slicer's list of fiducials"}},
      [](const auto& path) { landmarks_at(path); });
}

const std::string kHeader = kFcsv.substr(0, kFcsv.find("1,-53"));

// 3D Slicer under a locale with decimal commas, and tables saved there: 12.5 becomes two cells, and what follows moves.
TEST_F(Markups, DecimalCommasAreNoCells) {
  const auto expect = [&](const std::string& row, const std::string& said) {
    put(folder / "a.fcsv", kHeader + row + "\n");
    EXPECT_REFUSED(landmarks_at(folder / "a.fcsv"), "a.fcsv", said);
    EXPECT_REFUSED(seeds_at(folder / "a.fcsv"), "a.fcsv", said);
  };
  const std::string advice =
      "; a number with a decimal comma makes two cells: write 12.5, not 12,5, and a text with commas in quotation "
      "marks";
  const std::string expected = "a.fcsv:4: expected 14 cells, one for each of the columns, got ";
  expect("1,12,5,30,1,-7,2,0,0,0,1,1,1,0,distal-1,,", expected + "17" + advice);
  expect("1,12,5,30,-7,0,0,0,1,1,1,0,distal-1,,", expected + "15" + advice);
  expect("1,12,5,30,1,-7,0,0,0,1,1,1,0,distal-1,,", expected + "16" + advice);
  expect("1,12,5,30,1,-7,2,0,0,0,1,1,1,0,distal-1,,,2,0", expected + "19" + advice);  // of 3D Slicer 5
  expect("1,12,5,30,-7,0,0,0,1,1,1,0,distal-1,,,2,0", expected + "17" + advice);
  expect("1,12,5,30,-7,0,0,0,1,1,1,0,distal-1", expected + "13" + advice);  // and without the last two cells
  expect("1,12.5,30,-7,0,0,0,1,1,1,0,left, not right,,", expected + "15" + advice);
  // As many cells as columns, because as many are missing at the end as there are decimal commas.
  const std::string moved =
      "a.fcsv:4: the cells do not stand below their columns: those of the orientation or of vis, sel and lock hold "
      "other "
      "numbers" +
      advice;
  expect("1,10,5,20,30,0,0,0,1,1,1,0,d-1,", moved);
  expect("1,10,5,20,5,30,0,0,0,1,1,1,0,d-1", moved);
  expect("1,10,5,20,5,30,0,0,0,1,1,1,0,d-1,2,0", moved);
}

TEST_F(Markups, RowsOfOtherLengthsThatAreSound) {
  const auto first_of = [&](const std::string& rows) {
    put(folder / "a.fcsv", kHeader + rows);
    return landmarks_at(folder / "a.fcsv")[0].points.at(0);
  };
  const Vector3d at(12.5, 30.1, -7.2);
  for (const char* row : {"1,12.5,30.1,-7.2,0,0,0,1,1,1,0,notch,,,2,0", "1,12.5,30.1,-7.2,0,0,0,1,1,1,0,notch,,,,2,0",
                          "1,12.5,30.1,-7.2,0,0,0,1,1,1,0,1, , ,  2,0", "1,12.5,30.1,-7.2,0,0,0,1,1,1,0,notch",
                          "1,12.5,30.1,-7.2,0,0,0,1,1,1,0,notch,", "1,12.5,30.1,-7.2,0,0,0,1,1,1,0,7,,"})
    EXPECT_EQ(first_of(std::string(row) + "\n").model_mm, at) << row;
  // On Windows 3D Slicer 5 leaves a carriage return inside of its lines.
  EXPECT_EQ(first_of("1,12.5,30.1,-7.2,0,0,0,1,1,1,0,\"hip, left\",,\r,2,0\n").name, "hip, left");
  // The fifteenth cell says whether a point is placed: 2. The others are listed only, and lie at (0, 0, 0).
  const auto placed = first_of("1,0,0,0,0,0,0,1,1,1,0,later,,,0,0\n2,12.5,30.1,-7.2,0,0,0,1,1,1,0,now,,,2,0\n");
  EXPECT_EQ(placed.name, "now");
  put(folder / "b.fcsv", with(kFcsv, "= LPS\n", "= LPS,,,,\n"));  // tables fill each line up
  EXPECT_EQ(landmarks_at(folder / "b.fcsv")[0].points[0].model_mm, kFirst);
}

// The values are those of the files' texts.
TEST_F(Markups, FilesOfOthersWithDecimalCommas) {
  MARROW_NEED_DATA(data, "strangers/text");
  EXPECT_SAYS(seeds_at(data / "decimal_comma.fcsv"), "a number with a decimal comma makes two cells");
  EXPECT_SAYS(landmarks_at(data / "decimal_comma_one.fcsv"), "a number with a decimal comma makes two cells");
  EXPECT_EQ(landmarks_at(data / "extra_cells.fcsv")[0].points.at(0).model_mm, Vector3d(12.5, 30.1, -7.2));
}

TEST_F(Markups, DiagnosesSeedsWithoutAFragment) {
  put(folder / "a.mrk.json", with(kJson, "distal-2", ""));
  EXPECT_SAYS(seeds_at(folder / "a.mrk.json"),
              "a.mrk.json: point 2: it has no label; give it its fragment's name in 3D Slicer, or give fragment");
  put(folder / "s.yaml", "marrow-seeds: 1\nfragments:\n  proximal: {seeds: [[1, 2, 3]]}\n");
  EXPECT_SAYS(seeds_at(folder / "s.yaml", {{"fragment", "femur"}}),
              "s.yaml: names its fragments itself; fragment is only for files of 3D Slicer, so leave it out");
  EXPECT_SAYS(landmarks_at(folder / "a.mrk.json", {{"fragment", ""}}), "fragment");
}

RigidTransform read(const std::filesystem::path& path, const std::string& maps = "world_to_ct") {
  return read_by<Pose>("read.pose", path, {{"maps", maps}}).world_from_model;
}

std::string file(const std::string& type, const std::string& parameters, const std::string& fixed = "0 0 0") {
  return "#Insight Transform File V1.0\n#Transform 0\nTransform: " + type + "\nParameters: " + parameters +
         "\nFixedParameters: " + fixed + "\n";
}

// A quarter turn about z that takes x to y, and a way of (1, 2, 3).
const std::string kQuarter = file("AffineTransform_double_3_3", "0 -1 0 1 0 0 0 0 1 1 2 3");

TEST_F(ItkTransform, BothDirectionsAndTheCentreOfRotationCount) {
  put(folder / "a.tfm", kQuarter);
  const RigidTransform itself = read(folder / "a.tfm", "ct_to_world");
  EXPECT_EQ(itself.target, "world");
  EXPECT_EQ(itself.source, "ct");
  EXPECT_EQ(itself * Vector3d(10, 0, 0), Vector3d(1, 12, 3));
  const RigidTransform inverted = read(folder / "a.tfm");
  EXPECT_EQ(inverted.target, "world");
  EXPECT_EQ(inverted.source, "ct");
  EXPECT_EQ(inverted * Vector3d(1, 12, 3), Vector3d(10, 0, 0));
  // 3D Slicer shows, in RAS, a "transform to parent" that moves a model by (-12, 14, 6), and saves this file for it. In
  // LPS the model moves by (12, -14, 6).
  put(folder / "a.tfm", file("AffineTransform_double_3_3", "1 0 0 0 1 0 0 0 1 -12 14 -6"));
  EXPECT_EQ(read(folder / "a.tfm") * Vector3d(0, 0, 0), Vector3d(12, -14, 6));
  put(folder / "a.txt", file("MatrixOffsetTransformBase_float_3_3", "0 -1 0 1 0 0 0 0 1 1 2 3", "10 0 0"));
  // y = R (x - c) + c + t: the centre itself moves by t only.
  EXPECT_EQ(read(folder / "a.txt", "ct_to_world") * Vector3d(10, 0, 0), Vector3d(11, 2, 3));
}

TEST_F(ItkTransform, RigidTypesOfItk) {
  // Half the sine of the angle: a quarter turn about z.
  put(folder / "versor.tfm", file("VersorRigid3DTransform_double_3_3", "0 0 0.70710678118654757 1 2 3"));
  EXPECT_LT((read(folder / "versor.tfm", "ct_to_world") * Vector3d(10, 0, 0) - Vector3d(1, 12, 3)).norm(), 1e-12);
  // Quarter turns about x and z. About y, x, z in this order, y goes to z; about x, y, z the same. z goes to -y and
  // then to x.
  const std::string quarters = "1.5707963267948966 0 1.5707963267948966 0 0 0";
  put(folder / "euler.tfm", file("Euler3DTransform_double_3_3", quarters));
  EXPECT_LT((read(folder / "euler.tfm", "ct_to_world") * Vector3d(0, 0, 1) - Vector3d(1, 0, 0)).norm(), 1e-12);
  // Quarter turns about x and y: x goes by y, then x, to -z and then to y; in the other order it goes to -z.
  const std::string two = "1.5707963267948966 1.5707963267948966 0 0 0 0";
  put(folder / "zxy.tfm", file("Euler3DTransform_double_3_3", two, "0 0 0 0"));
  EXPECT_LT((read(folder / "zxy.tfm", "ct_to_world") * Vector3d(1, 0, 0) - Vector3d(0, 1, 0)).norm(), 1e-12);
  put(folder / "zyx.tfm", file("Euler3DTransform_double_3_3", two, "0 0 0 1"));
  EXPECT_LT((read(folder / "zyx.tfm", "ct_to_world") * Vector3d(1, 0, 0) - Vector3d(0, 0, -1)).norm(), 1e-12);
}

TEST_F(ItkTransform, WhatIsWrittenIsReadBack) {
  Pose pose;
  pose.world_from_model.rotation = rotation_from_vector({0.3, -0.5, 0.8});
  pose.world_from_model.translation_mm = {1.0 / 3, -20, 1e-7};
  const std::string itself =
      written_by<ItkTransformFile>("write.tfm", "pose", pose, folder / "a.tfm", {{"maps", "ct_to_world"}});
  const RigidTransform read_back = read(folder / "a.tfm", "ct_to_world");
  EXPECT_EQ(read_back.rotation, pose.world_from_model.rotation);
  EXPECT_EQ(read_back.translation_mm, pose.world_from_model.translation_mm);
  const std::string inverted = written_by<ItkTransformFile>("write.tfm", "pose", pose, folder / "b.tfm");
  EXPECT_NE(inverted, itself);
  EXPECT_EQ(read(folder / "b.tfm").rotation, pose.world_from_model.rotation);
  EXPECT_LT((read(folder / "b.tfm").translation_mm - pose.world_from_model.translation_mm).norm(), 1e-13);
}

// What is written for 3D Slicer has the inverse's numbers.
TEST_F(ItkTransform, TheBytesThatAreWritten) {
  Pose pose;
  pose.world_from_model.translation_mm = {12, -14, 6};
  EXPECT_EQ(written_by<ItkTransformFile>("write.tfm", "pose", pose, folder / "a.tfm"),
            file("AffineTransform_double_3_3", "1 0 0 0 1 0 0 0 1 -12 14 -6"));
}

TEST_F(ItkTransform, DiagnosesFaults) {
  put(folder / "p.yaml", "marrow-pose: 1\n");
  EXPECT_SAYS(read(folder / "p.yaml", "ct_to_world"),
              "p.yaml: says itself what it maps; maps is only for transforms of ITK (.tfm or .txt), so leave it out");
  const std::string affine = "AffineTransform_double_3_3";
  expect_faults(
      folder / "a.tfm", kQuarter,
      {{"V1.0", "V2.0", "a.tfm:1: expected '#Insight Transform File V1.0', got '#Insight Transform File V2.0'"},
       {"", "marrow-pose: 1\n", "save the transform as .tfm in 3D Slicer or ITK"},
       {"", kQuarter.substr(0, kQuarter.find("Fixed")),
        "there is no line 'FixedParameters:'; the file is cut off, or no"},
       {"Transform: Aff", "Transformation: Aff", "a.tfm:3: expected 'Transform:', 'Parameters:' or 'Fixed"},
       {"", kQuarter + "#Transform 1\nTransform: " + affine + "\n",
        "a.tfm:7: a second transform begins, but a pose is one; in 3D Slicer, harden the transforms into one"},
       {affine, "BSplineTransform_double_3_3",
        "a.tfm:3: the type 'BSplineTransform_double_3_3' is not read; expected AffineTransform_double_3_3"},
       {affine, "AffineTransform_double_2_2", "the type 'AffineTransform_double_2_2' is not read"},
       {" 1 2 3", " 1 2", "a.tfm:4: AffineTransform_double_3_3 has 12 parameters, got 11"},
       {"0 0 0\n", "0 0\n", "a.tfm:5: AffineTransform_double_3_3 has 3 fixed parameters, got 2"},
       {" 1 2 3", " 1 nan 3", "a.tfm:4: expected numbers of at most 1e6, got 'nan'"},
       {" 1 2 3", " 1 2e300 3", "a.tfm:4: expected numbers of at most 1e6, got '2e300'"},
       {" 1 2 3", " 1 two 3", "a.tfm:4: expected numbers of at most 1e6, got 'two'"},
       {"0 -1 0 1", "0 -2 0 1", "a.tfm:4: the matrix scales, shears or mirrors, but a pose is a rotation"},
       {"0 -1 0 1", "0 1 0 1", "the matrix scales, shears or mirrors, but a pose is a rotation"},
       {"", file("VersorRigid3DTransform_double_3_3", "1 1 0 1 2 3"),
        "a.tfm:4: the versor is longer than 1, so it is no"},
       {"", file("VersorRigid3DTransform_double_3_3", "1 0 0 1 2"),
        "VersorRigid3DTransform_double_3_3 has 6 parameters, got 5"}},
      [](const auto& path) { read(path); });
}

}  // namespace markups_test
