// SPDX-License-Identifier: Apache-2.0
// Nothing that marrow finds depends on where the world has its origin and axes, on the frame of the CT, or on how much
// of an image was kept around the bone. Each node of these kinds gives the moved answer. What the moved answer is
// follows from the definitions of the frames alone. A new node is tested by itself, or is named here with the reason.
#include <gtest/gtest.h>

#include <set>

#include "tests/properties/moved_world_scene.hpp"

namespace moved_world_test {

using namespace moved_world;
using marrow::RigidTransform, marrow::Value;

/// Nodes whose inputs do not say where anything is.
const std::map<std::string, std::string>& apart() {
  static const std::map<std::string, std::string> nodes{
      {"evaluate.calibration", "compares two camera matrices of one device, which have no place"},
      {"evaluate.common_offset", "sums up figures"},
      {"evaluate.contact", "needs several bones; tests/plugins/evaluate moves them together"},
      {"evaluate.deepfluoro", "reads a file"},
      {"evaluate.distortion", "compares two distortions of one device, which have no place"},
      {"evaluate.edges", "compares edges of one image"},
      {"evaluate.frames", "sums up figures"},
      {"evaluate.locking", "a plan of plan.locking; tests/plugins/plan moves its world"},
      {"evaluate.pose_difference", "tells shifts along the axes of the world"},
      {"evaluate.true_edges", "takes the camera of one view by itself; tests/plugins/evaluate knows the borders"},
      {"evaluate.utrecht", "reads files"},
      {"initial.silhouette", "needs silhouettes of a whole part; the suite of its kind turns their world"},
      {"register.together", "needs the costs of several bones; tests/plugins/register has wells for each"},
      {"similarity.with_contact", "needs several bones; its penalty is that of evaluate.contact"},
      {"track.autoscoper", "with a volume, its poses are of the volume's corner; tests/plugins/read checks both ways"},
      {"track.keyframes", "reads files; their poses are those of the world they were placed in"}};
  return nodes;
}

/// Costs that refer to the whole image: to its brightest grey and its noise, or to patches counted from its corner.
/// What is cut off is missing there.
bool is_of_whole_image(const std::string& node) {
  static const std::set<std::string> nodes{"similarity.entropy_of_difference", "similarity.gradient_difference",
                                           "similarity.gradient_projection",   "similarity.metal_gradient_correlation",
                                           "similarity.patch_correlation",     "similarity.patch_gradient_correlation",
                                           "similarity.pattern_intensity"};
  return nodes.count(node) > 0;
}

/// What is allowed of a node, in millionths of the span. Infinite: a node is not compared after such a change.
double allowed(const std::string& node, const Change& change) {
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  const std::string kind = node.substr(0, node.find('.'));
  const bool is_search = kind == "register" || node == "initial.best_of" || node == "initial.global_search" ||
                         node == "evaluate.mirror_pose";
  const bool is_cut = change.cut_px != Eigen::Vector2i::Zero();
  if (change.is_mirrored) {
    if (node == "similarity.ray_to_surface") return kInfinite;  // every second edge pixel, counted from the left
    // Every second pixel is compared, from the left of the bone on. A search goes another way. A mirrored triangle is
    // sampled at other points.
    return kind == "similarity" ? 250000 : is_search ? 700000 : 50000;
  }
  if (is_cut && is_of_whole_image(node)) return kInfinite;
  // Pixels of an outline are floats of 32 bits. Their last digits send a search another way; it ends within a last
  // step.
  if (is_cut && is_search) return 200000;
  if (is_cut && kind == "shaft") return 30000;  // places along a border are counted in whole pixels of the image
  if (node == "register.icp") return 500;       // nearest points are searched for in floats of 32 bits
  return is_cut || is_search || node == "similarity.with_prior" ? 50 : 1;  // points of an outline are such floats, too
}

/// Fewer poses, so that a search takes a moment and the bone stays in a cut image; and options that are places or
/// directions themselves.
shipped::Options options_of(const std::string& node, const Change& change) {
  if (node == "initial.global_search")
    return {{"poses", std::int64_t(200)}, {"candidates", std::int64_t(4)}, {"finalists", std::int64_t(1)},
            {"translation_side_mm", 5.0}, {"translation_axial_mm", 5.0},   {"rotation_axial_deg", 10.0},
            {"rotation_side_deg", 5.0}};
  if (node == "initial.manual") return {{"rotation_deg", std::vector<double>{3, 0, 0}}};
  if (node == "track.joint") {
    const Eigen::Vector3d centre_mm = change.in_ct({0, 0, 50});
    return {{"centre_mm", std::vector<double>(centre_mm.begin(), centre_mm.end())}};
  }
  if (node == "evaluate.landscape") return {{"profile_points", std::int64_t(5)}};
  return {};
}

RigidTransform motion(const std::string& frame, const Eigen::Vector3d& turn_rad, const Eigen::Vector3d& shift_mm) {
  return {frame, frame, marrow::rotation_from_vector(turn_rad), shift_mm};
}

std::vector<Change> world_motions() {
  return {{"world shifted by 300 mm along x", motion("world", {0, 0, 0}, {300, 0, 0})},
          {"world shifted by 300 mm along y", motion("world", {0, 0, 0}, {0, -300, 0})},
          {"world turned by half a turn", motion("world", {0, 3.14, 0}, {0, 0, 0})},
          {"world turned and shifted", motion("world", {0.7, -1.1, 0.4}, {80, -45, 120})},
          {"world turned and shifted far", motion("world", {-1.6, 0.9, 2.1}, {-250, 310, 170})}};
}
Change ct_shifted() {
  Change change{"origin of the CT shifted"};
  change.ct = motion("ct", {0, 0, 0}, {120, -80, 300});
  return change;
}
/// A fragment's frontal axis is that of the CT, so only costs are the same in a turned one.
Change ct_turned() {
  Change change{"axes of the CT turned"};
  change.ct = motion("ct", {0.5, -0.3, 0.9}, {-60, 210, 35});
  return change;
}
Change images_cut() {
  Change change{"images cut, and with them the principal point shifted"};
  change.cut_px = {32, 16};
  return change;
}

Change all_mirrored() {
  Change change{"world, CT and images mirrored"};
  change.is_mirrored = true;
  return change;
}

/// What a node needs of a scene; false if the scene lacks something.
bool fill(const marrow::NodeDefinition& node, const Scene& scene, shipped::Inputs& inputs) {
  for (const marrow::PortInfo& port : node.info.inputs) {
    const bool is_of_others = port.name.rfind("other", 0) == 0;
    const Value value = is_of_others ? Value() : scene.value_for(port);
    if (!value.is_absent()) inputs[port.name] = value;
    if (value.is_absent() && !port.optional) return false;
  }
  return true;
}

/// The numbers of a value, after the change if there is one.
Numbers numbers_of(const Value& value, const Change& change) {
  Numbers numbers;
  if (value.is_list()) {
    for (const Value& item : value.items) {
      const Numbers more = numbers_of(item, change);
      numbers.insert(numbers.end(), more.begin(), more.end());
    }
    return numbers;
  }
  if (value.is_absent()) return numbers;
  bool is_known = false;
  const auto take = [&]<class T>() {
    if (value.type.id != marrow::ValueType<T>::kId) return;
    add(numbers, changed(value.as<T>(), change));
    is_known = true;
  };
  take.operator()<marrow::Pose>();
  take.operator()<marrow::Metrics>();
  take.operator()<marrow::Landscape>();
  take.operator()<marrow::ShaftLines>();
  take.operator()<marrow::View>();
  take.operator()<marrow::track::TrackState>();
  take.operator()<marrow::track::AutoscoperTrack>();
  take.operator()<marrow::track::Trajectory>();
  EXPECT_TRUE(is_known) << "add the type '" << value.type.id << "' to moved_world_scene.hpp";
  return numbers;
}

/// The values of a cost at the poses, at its own level and at a coarse one.
Numbers values_of(const marrow::Cost& cost, const Change& change) {
  Numbers all;
  for (const auto& [own, level] :
       {std::pair(&cost, std::shared_ptr<const marrow::Cost>()), std::pair(&cost, cost.at_level({4, 12, 4}))}) {
    std::vector<RigidTransform> poses;
    for (const RigidTransform& pose : poses_to_compare()) poses.push_back(changed(pose, change));
    const std::vector<double> values = (level ? *level : *own).values(poses);
    const auto [least, most] = std::minmax_element(values.begin(), values.end());
    for (const double value : values) all.push_back({value, *most - *least});
  }
  return all;
}

/// The largest difference in millionths of the span. In a mirrored world figures are compared without their signs. The
/// blocks of an image that give a covariance are others in a cut or mirrored one.
double compare(const Numbers& expected, const Numbers& found, const Change& change) {
  constexpr double kAllowed = 1e-6;
  EXPECT_EQ(expected.size(), found.size());
  double worst = 0;
  for (std::size_t i = 0; i < std::min(expected.size(), found.size()); ++i) {
    if (std::isnan(expected[i].value) && std::isnan(found[i].value)) continue;
    double before = expected[i].value, after = found[i].value;
    if (expected[i].is_of_blocks && (change.is_mirrored || change.cut_px != Eigen::Vector2i::Zero())) continue;
    if (change.is_mirrored && expected[i].is_figure) before = std::abs(before), after = std::abs(after);
    const double off = std::abs(after - before) / (kAllowed * expected[i].span);
    worst = std::max(worst, std::isnan(off) ? 1e300 : off);
  }
  return worst;
}

/// A node's outputs for a scene, and the inputs that they refer to.
struct Answer {
  shipped::Inputs inputs;
  shipped::Outputs outputs;

  Answer(const std::string& name, const Scene& scene, const Change& change) {
    EXPECT_TRUE(fill(shipped::definition_of(name), scene, inputs))
        << "the scene has not all that " << name << " needs: add it to moved_world_scene.cpp, or name the node in "
        << "apart() with the reason";
    outputs = shipped::call(name, inputs, options_of(name, change));
  }
  /// Of all outputs; those of costs at poses after `poses`, all others after `values`.
  Numbers numbers(const Change& poses, const Change& values) const {
    Numbers all;
    for (const auto& [port, value] : outputs) {
      const bool is_cost = value.type.id == marrow::ValueType<marrow::Cost>::kId;
      const Numbers more = is_cost ? values_of(value.as<marrow::Cost>(), poses) : numbers_of(value, values);
      all.insert(all.end(), more.begin(), more.end());
    }
    return all;
  }
};

void check(const std::string& kind, const std::vector<Change>& changes, int views) {
  const Scene still(Change{"nothing"}, views);
  std::vector<Scene> scenes;
  for (const Change& change : changes) scenes.emplace_back(change, views);
  int nodes = 0;
  double worst = 0;
  for (const std::string& name : marrow::Catalogue().node_names()) {
    if (name.rfind(kind + ".", 0) != 0 || apart().count(name)) continue;
    ++nodes;
    const Answer before(name, still, {});
    for (std::size_t i = 0; i < changes.size(); ++i) {
      const Answer after(name, scenes[i], changes[i]);
      const double off = 1 / allowed(name, changes[i]) *
                         compare(before.numbers({}, changes[i]), after.numbers(changes[i], {}), changes[i]);
      EXPECT_LT(off, 1) << name << " with " << views << " views, " << changes[i].name;
      worst = std::max(worst, off);
    }
  }
  std::printf("%s with %d views: %d nodes, %zu changes, off by %.2g of what is allowed at most\n", kind.c_str(), views,
              nodes, changes.size(), worst);
  EXPECT_GT(nodes, 0);
}

std::vector<Change> all_changes(std::vector<Change> more = {}) {
  std::vector<Change> all = world_motions();
  all.push_back(ct_shifted());
  all.push_back(images_cut());
  all.push_back(all_mirrored());
  all.insert(all.end(), more.begin(), more.end());
  return all;
}

TEST(MovedWorldSimilarity, TwoViews) { check("similarity", all_changes({ct_turned()}), 2); }
TEST(MovedWorldSimilarityOfOneView, OneView) { check("similarity", all_changes({ct_turned()}), 1); }
TEST(MovedWorldRegister, TwoViews) { check("register", all_changes(), 2); }
TEST(MovedWorldInitial, TwoViews) { check("initial", all_changes(), 2); }
TEST(MovedWorldShaft, TwoViews) { check("shaft", all_changes(), 2); }
TEST(MovedWorldShaft, OneView) { check("shaft", all_changes(), 1); }
TEST(MovedWorldTrack, TwoViews) { check("track", all_changes(), 2); }
TEST(MovedWorldEvaluate, TwoViews) { check("evaluate", all_changes(), 2); }

TEST(MovedWorldApart, OnlyNodesThatAreAndNeedIt) {
  const Scene scene(Change{"nothing"}, 2);
  for (const auto& [name, reason] : apart()) EXPECT_TRUE(marrow::Catalogue().find(name)) << name << ": " << reason;
}

}  // namespace moved_world_test
