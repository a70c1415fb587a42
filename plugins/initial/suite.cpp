// SPDX-License-Identifier: Apache-2.0
// Checks for starts, on a long bone at a known pose. A start must lie within the range from which a registration finds
// the pose, also where the world has other axes, and for the bone of the other side.
#include "suite.hpp"

#include <algorithm>
#include <cmath>

#include "marrow/runtime/node/types.hpp"
#include "scene.hpp"

namespace marrow::conformance {
namespace {

constexpr int kCases = 3;

/// How far a start is from the truth: in its rotation, and in the middle of what the views show.
struct Off {
  double deg = 0, mm = 0;
  double most() const { return std::max(deg, mm); }
};

Off off_truth(const Subject& subject, const Inputs& inputs, const RigidTransform& right) {
  const RigidTransform found = subject.output(inputs, "pose").as<Pose>().world_from_model;
  return {degrees(geodesic_angle_rad(found.rotation, right.rotation)),
          (found.translation_mm - right.translation_mm).norm()};  // the CT's origin is in the middle
}

/// The largest over some cases, in degrees and in mm.
Off largest(const Subject& subject, bool is_mirrored, bool is_turned) {
  Off most;
  for (int seed = 1; seed <= kCases; ++seed) {
    const Off off =
        off_truth(subject, inputs_of({seed, is_mirrored, is_turned}), truth({seed, is_mirrored, is_turned}));
    most = {std::max(most.deg, off.deg), std::max(most.mm, off.mm)};
  }
  return most;
}

/// The angle between the long axis of the start and that of the bone.
double long_axis_off_deg(const Subject& subject) {
  const Inputs inputs = inputs_of({});
  const FragmentFrame found = subject.output(inputs, "pose").as<Pose>().frame;
  expect(found.is_anatomical, "its start does not have the axes of the fragment");
  const Eigen::Vector3d axis = fragment_frame(inputs.at("model").as<Mesh>()).axes.col(2);
  return degrees(found.axes.col(2).cross(axis).norm());
}

/// The same at all poses, without a word.
class Constant : public Cost {
 public:
  explicit Constant(double value) : value_(value) {}
  double value(const RigidTransform&) const override { return value_; }
  std::shared_ptr<const Cost> at_level(const CostLevel&) const override { return std::make_shared<Constant>(*this); }

 private:
  double value_;
};

bool takes(const Subject& subject, const std::string& input) {
  const auto& ports = subject.info().inputs;
  return std::any_of(ports.begin(), ports.end(), [&](const PortInfo& one) { return one.name == input; });
}

/// The number of costs without anything to compare that lead to a start.
double starts_of_nothing(const Subject& subject) {
  if (!takes(subject, "cost")) throw NotApplicable("it takes no cost");
  double count = 0;
  for (const double value : {0.0, 0.7, std::nan("")}) {
    Inputs inputs = inputs_of({});
    inputs.set("cost", Value::of<Cost>(std::make_shared<const Constant>(value)));
    const Result result = subject.call(inputs);
    if (result.refusal) expect_reason(*result.refusal);
    count += !result.refusal;
  }
  return count;
}

/// The larger of the angle and the distance, of a body in any orientation.
double without_start(const Subject& subject) {
  for (const char* port : {"projector", "views", "edges", "cost"})
    if (!takes(subject, port))
      throw NotApplicable(std::string("it takes no ") + port + ", so it needs more than images");
  double most = 0;
  for (int seed = 1; seed <= kCases; ++seed) {
    const FreeScene scene = free_scene(seed);
    most = std::max(most, off_truth(subject, scene.inputs, scene.truth).most());
  }
  return most;
}

void validate(const Inputs&, const std::vector<PortInfo>& ports, const std::vector<Value>& outputs) {
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    if (ports[i].name != "pose") continue;
    expect(outputs[i].data != nullptr, "it gives no start");
    const Pose& pose = outputs[i].as<Pose>();
    check_pose(pose, "the start");
    expect(std::isfinite(pose.cost), "the cost of its start is not finite");
  }
}

/// The inputs with a change of one of them.
template <class T>
Trial with_changed(const std::string& name, const std::string& port, const std::function<void(T&)>& change) {
  return {name, [port, change] {
            Inputs inputs = inputs_of({});
            T changed = inputs.at(port).as<T>();
            change(changed);
            inputs.set(port, item(changed));
            return inputs;
          }};
}

std::vector<Trial> trials() {
  const double none = std::nan("");
  const auto without = [](const char* port) {
    return [port] {
      Inputs inputs = inputs_of({});
      inputs.at(port).items.clear();
      inputs.at(port).names.clear();
      return inputs;
    };
  };
  const auto with_masks = [](const std::function<cv::Mat(const cv::Mat&)>& change) {
    return [change] {
      Inputs inputs = inputs_of({});
      List<View> silhouettes;
      for (const Value& one : inputs.at("silhouettes").items) {
        View view = one.as<View>();
        view.mask = change(view.mask);
        const std::string name = view.name;
        silhouettes.add(name, std::move(view));
      }
      inputs.set("silhouettes", Value::of(silhouettes, "view"));
      return inputs;
    };
  };
  return {
      with_changed<Landmarks>("no_landmarks", "landmarks", [](Landmarks& marks) { marks = {}; }),
      with_changed<Landmarks>("two_landmarks", "landmarks",
                              [](Landmarks& marks) {
                                marks.tracked.resize(2);
                                marks.seen.resize(4);
                              }),
      with_changed<Landmarks>("landmark_not_a_number", "landmarks",
                              [none](Landmarks& marks) {
                                marks.tracked[0].world_mm.x() = none;
                                marks.seen[0].pixel.x() = none;
                              }),
      with_changed<Landmarks>("unknown_landmark", "landmarks",
                              [](Landmarks& marks) { marks.points.erase(marks.points.begin()); }),
      {"no_lines", without("lines")},
      {"no_views", without("views")},
      {"no_silhouettes", without("silhouettes")},
      {"silhouettes_without_masks", with_masks([](const cv::Mat&) { return cv::Mat(); })},
      {"empty_silhouettes", with_masks([](const cv::Mat& mask) { return cv::Mat(mask.size(), CV_8U, cv::Scalar(0)); })},
      {"silhouettes_cut_off", with_masks([](const cv::Mat& mask) {
         cv::Mat cut = mask.clone();
         cut.rowRange(0, cut.rows / 2).setTo(255);
         return cut;
       })},
      {"broken_camera",
       [none] {
         Inputs inputs = inputs_of({});
         for (const char* port : {"views", "silhouettes"}) {
           List<View> views;
           for (const Value& one : inputs.at(port).items) {
             View view = one.as<View>();
             view.camera.intrinsics(0, 0) = none;
             const std::string name = view.name;
             views.add(name, std::move(view));
           }
           inputs.set(port, Value::of(views, "view"));
         }
         return inputs;
       }},
      with_changed<Mesh>("no_surface", "model", [](Mesh& mesh) { mesh = {}; }),
      with_changed<Pose>("start_not_a_number", "start",
                         [none](Pose& start) { start.world_from_model.translation_mm.x() = none; }),
      with_changed<Pose>("start_not_rigid", "start", [](Pose& start) { start.world_from_model.rotation *= 2; }),
      with_changed<Pose>("start_far_off", "start",
                         [](Pose& start) { start.world_from_model.translation_mm.z() += 5000; })};
}

}  // namespace

Suite initial_suite() {
  constexpr double kRange = 10;  // from which a registration finds the pose
  Suite suite{[] { return inputs_of({}); }, validate, trials(), {}};
  // The truth is near, so a search of many poses needs no more than this.
  suite.options = [] { return std::map<std::string, OptionValue>{{"poses", 1500}, {"candidates", 20}}; };
  const auto add = [&](const char* name, const std::string& what, double limit, const char* unit,
                       std::function<double(const Subject&)> measure) {
    suite.accuracy.push_back({{name, what, limit, unit}, std::move(measure)});
  };
  add("rotation", "the largest angle to the true pose, of 3 poses; the nominal placement is 4 to 8 degrees and mm off",
      kRange, "deg", [](const Subject& subject) { return largest(subject, false, false).deg; });
  add("position", "the largest distance of the bone from the truth in the middle of the views, of the same poses",
      kRange, "mm", [](const Subject& subject) { return largest(subject, false, false).mm; });
  add("turned_world", "the larger of both where the world has other axes and another origin", kRange, "degrees or mm",
      [](const Subject& subject) { return largest(subject, false, true).most(); });
  add("mirrored", "the larger of both for the bone of the other side", kRange, "degrees or mm",
      [](const Subject& subject) { return largest(subject, true, false).most(); });
  add("long_axis", "the long axis of the start from that of the bone", 1e-3, "deg", long_axis_off_deg);
  add("without_start", "the larger of both for a body of 8 cm in any of 3 orientations, about which nothing is known",
      kRange, "degrees or mm", without_start);
  add("nothing_compared", "starts found where the cost is constant or not a number", 0, "starts", starts_of_nothing);
  return suite;
}

}  // namespace marrow::conformance
