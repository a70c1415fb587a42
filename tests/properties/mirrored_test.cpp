// SPDX-License-Identifier: Apache-2.0
// A left and a right limb are mirror images. Each node of these kinds gives for the mirrored patient the mirrored
// answer, and the same medial, varus or internal. A new node is tested, or is named here with the reason.
#include <set>

#include "tests/properties/mirrored_values.hpp"

namespace mirrored_test {

using mirrored_patient::Checks;

const std::set<std::string> kKinds{"fracture", "guide", "plan", "robot", "simulate"};

/// Nodes for which left and right are no question.
const std::map<std::string, std::string>& apart() {
  static const std::map<std::string, std::string> nodes{
      {"guide.begin", "has no input"},
      {"guide.target", "finds a board of beads in an image, no part of a patient"},
      {"robot.stations", "shows the same board"},
      {"simulate.bead_board", "images of a board"},
      {"simulate.camera_arm", "a camera beside a platform"},
      {"simulate.camera_faults", "draws its faults, and a draw has no mirror image"},
      {"simulate.case", "puts its inputs together"},
      {"simulate.case_folder", "fills surfaces that are given with labels"},
      {"simulate.case_parts", "takes them apart"},
      {"simulate.chessboard", "images of a board"},
      {"simulate.distortion_plate", "images of a plate"},
      {"simulate.export", "changes the grey values of an image"},
      {"simulate.implant", "an implant that is given, in a pose that is drawn"},
      {"simulate.knee_implant", "a part of a given asymmetry, of which either side is on the market"},
      {"simulate.labels", "names what the rays of simulate.cluttered_fluoroscopy meet, which has a check"},
      {"simulate.landmarks", "takes any points of the surface, and tests/plugins/simulate says that they lie on it"},
      {"simulate.mistake", "takes the other side for this one on purpose"},
      {"simulate.nail", "a nail is the same for both sides"},
      {"simulate.pelvis", "both halves are alike"},
      {"simulate.photograph", "photographs of a platform, by a camera that is given"},
      {"simulate.skin_markers", "draws the markers' places around the bone"},
      {"simulate.surface", "reads a bone of either side from a file"},
      {"simulate.sweeps", "motions that are given"},
      {"simulate.vertebra", "is its own mirror image"}};
  return nodes;
}

Checks all_checks() {
  Checks checks = mirrored_patient::checks_of_plans_and_robots();
  checks.merge(mirrored_patient::checks_of_simulations());
  return checks;
}

std::vector<std::string> nodes_of_these_kinds() {
  std::vector<std::string> nodes = marrow::Catalogue().node_names();
  std::erase_if(nodes, [](const std::string& node) { return !kKinds.count(node.substr(0, node.find('.'))); });
  return nodes;
}

TEST(MirroredPatient, EachNodeIsTestedOrHasAReason) {
  const std::vector<std::string> nodes = nodes_of_these_kinds();
  const Checks checks = all_checks();
  for (const std::string& node : nodes)
    EXPECT_EQ(checks.count(node) + apart().count(node), 1u)
        << node << ": add a check of the mirrored patient, or the reason why left and right are no question for it";
  const auto exists = [&](const std::string& name) {
    return std::find(nodes.begin(), nodes.end(), name) != nodes.end();
  };
  for (const auto& [node, check] : checks) EXPECT_TRUE(exists(node)) << node;
  for (const auto& [node, reason] : apart()) EXPECT_TRUE(exists(node)) << node;
}

TEST(MirroredPatient, EachNodeGivesTheMirroredAnswer) {
  for (const auto& [node, check] : all_checks()) {
    SCOPED_TRACE(node);
    EXPECT_NO_THROW(check());
  }
}

}  // namespace mirrored_test
