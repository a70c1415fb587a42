// SPDX-License-Identifier: Apache-2.0
// Fragments of a case that are given by labels or surfaces instead of seeds.
#include <gtest/gtest.h>

#include "marrow/domain/case.hpp"
#include "marrow/domain/mesh.hpp"
#include "shipped.hpp"
#include "tests/plugins/read/files.hpp"
#include "tests/plugins/read/itk_files.hpp"

namespace case_fragments_test {

using marrow::test::ItkGrid;
using marrow::test::message_of;
using marrow::test::put;
using marrow::test::TemporaryFolder;
using marrow::test::with;
using marrow::test::write_itk;

const std::string kViews = R"(views:
  - name: frontal
    image: frontal.png
    camera:
      width_px: 6
      height_px: 4
      intrinsics: [[10, 0, 2.5], [0, 10, 1.5], [0, 0, 1]]
      camera_from_world:
        {target: camera, source: world, rotation: [[1, 0, 0], [0, 1, 0], [0, 0, 1]], translation_mm: [0, 0, 600]}
)";

const std::string kTriangles = "v 0 0 0\nv 10 0 0\nv 0 10 0\nv 0 0 10\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

class CaseFragments : public testing::Test {
 protected:
  CaseFragments() {
    write_itk(folder / "ct.mha",
              ItkGrid<std::int16_t>{.size = {4, 4, 4}, .samples = std::vector<std::int16_t>(64, 40)});
    std::vector<std::uint8_t> labels(64, 0);
    labels[21] = labels[22] = 11;
    labels[42] = 12;
    write_itk(folder / "labels.nii.gz", ItkGrid<std::uint8_t>{.size = {4, 4, 4}, .samples = labels});
    write_itk(folder / "frontal.png",
              ItkGrid<std::uint16_t>{.size = {6, 4}, .samples = std::vector<std::uint16_t>(24, 5000)});
    put(folder / "tibia.obj", kTriangles);
  }
  shipped::Outputs read(const std::string& text) {
    put(folder / "case.yaml", "marrow-case: 1\n" + text + kViews);
    return shipped::call("read.case", {}, {{"path", folder.path().string()}});
  }
  std::string said(const std::string& text) {
    return message_of([&] { read(text); });
  }
  void expect_said(const std::string& text, const std::string& expected) {
    EXPECT_NE(said(text).find(expected), std::string::npos) << "it said: " << said(text);
  }
  TemporaryFolder folder;
};

const std::string kLabelled =
    "ct: ct.mha\nlabels: labels.nii.gz\nfragments:\n  tibia: {label: 11}\n  fibula: {label: 12, register: false}\n";

TEST_F(CaseFragments, LabelsGiveTheMaskOfEachRegisteredFragment) {
  const shipped::Outputs outputs = read(kLabelled);
  const auto label = outputs.at("label").as_list<marrow::Volume>();
  ASSERT_EQ(label.names(), std::vector<std::string>{"tibia"});
  EXPECT_EQ(std::count(label[0].values.begin(), label[0].values.end(), 1.0f), 2);
  EXPECT_TRUE(outputs.at("seeds").as_list<marrow::Seeds>().empty());
  EXPECT_TRUE(outputs.at("surface").as_list<marrow::Mesh>().empty());
  EXPECT_FALSE(outputs.at("ct").is_absent());
}

TEST_F(CaseFragments, ASurfaceNeedsNoCt) {
  const shipped::Outputs outputs = read("fragments: {tibia: {surface: tibia.obj}}\n");
  EXPECT_TRUE(outputs.at("ct").is_absent());
  const auto surface = outputs.at("surface").as_list<marrow::Mesh>();
  ASSERT_EQ(surface.names(), std::vector<std::string>{"tibia"});
  EXPECT_NEAR(marrow::enclosed_volume_mm3(surface[0]), 1000.0 / 6, 1e-6);
}

TEST_F(CaseFragments, ASurfaceInCm) {
  const auto surface =
      read("fragments: {tibia: {surface: {file: tibia.obj, scale: 10}}}\n").at("surface").as_list<marrow::Mesh>();
  EXPECT_NEAR(marrow::enclosed_volume_mm3(surface[0]), 1e6 / 6, 1e-3);
}

TEST_F(CaseFragments, FragmentsInSeveralWays) {
  const std::string expected =
      "give one of seeds (points inside), label (with `labels` of the case) and surface (a file)";
  expect_said("ct: ct.mha\nfragments: {tibia: {register: true}}\n", "fragment 'tibia': " + expected);
  expect_said("ct: ct.mha\nfragments: {tibia: {seeds: [[1, 2, 3]], surface: tibia.obj}}\n",
              expected + ", not seeds and surface");
  expect_said(with(kLabelled, "label: 12", "seeds: [[1, 2, 3]]"),
              "some are given by label, some by seeds; give all of them in the same way");
}

TEST_F(CaseFragments, LabelsWithoutAFileAndAFileWithoutLabels) {
  expect_said(with(kLabelled, "labels: labels.nii.gz\n", ""),
              "label: the case names no file of labels; add `labels: FILE` beside `ct`");
  expect_said("ct: ct.mha\nlabels: labels.nii.gz\nfragments: {tibia: {seeds: [[1, 2, 3]]}}\n",
              "labels: no fragment has a label of this file; give it as `NAME: {label: NUMBER_OR_NAME}`");
}

TEST_F(CaseFragments, FaultsOfFilesStandAtTheirKeys) {
  expect_said(with(kLabelled, "label: 11", "label: 13"), "labels.nii.gz: has no label 13; it has 11, 12");
  expect_said(with(kLabelled, "label: 12", "label: 13"), "labels.nii.gz: has no label 13; it has 11, 12");
  expect_said(with(kLabelled, "labels.nii.gz", "label.nii.gz"), "labels: there is no 'label.nii.gz'");
  expect_said("fragments: {tibia: {surface: /tmp/tibia.obj}}\n", "lies outside the case's folder");
  expect_said("fragments: {tibia: {surface: {file: tibia.obj, scale: 0}}}\n",
              "scale: expected a factor of at least 1e-6, such as 10 for cm");
}

TEST_F(CaseFragments, SeedsNeedACt) { expect_said("fragments: {tibia: {seeds: [[1, 2, 3]]}}\n", "'ct' is missing"); }

}  // namespace case_fragments_test
