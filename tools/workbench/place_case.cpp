// SPDX-License-Identifier: Apache-2.0
// Opens a case for the page "Place": one run of pipelines/workbench/place.yaml, and the start of each bone.
#include <algorithm>
#include <cmath>

#include "marrow/base/printable.hpp"
#include "marrow/domain/decompositions.hpp"
#include "marrow/domain/quantile.hpp"
#include "marrow/runtime/node/types.hpp"
#include "workbench/place.hpp"

namespace marrow::workbench {
namespace {

using nlohmann::json;

constexpr std::size_t kMostCases = 2;

/// Whether the middle of the bone is in the image of every view.
bool is_seen(const List<View>& views, const Eigen::Vector3d& middle_mm) {
  for (const View& view : views) {
    const Eigen::Vector2d pixel = project(view.camera, middle_mm);
    if (!(pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() < view.camera.width_px && pixel.y() < view.camera.height_px))
      return false;
  }
  return true;
}

/// The poses that the pipeline found, by bone.
List<Pose> poses_of(const Value& value) {
  List<Pose> poses;
  for (std::size_t i = 0; i < value.items.size(); ++i)
    if (value.items[i].data) poses.add(value.names[i], value.items[i].as<Pose>());
  return poses;
}

/// A coarser cost, for the figures that are shown during a drag. It keeps the fine cost alive, because it may use the
/// images of that. It is made once: smoothing the CT for grey values takes longer than a comparison.
std::shared_ptr<const Cost> coarse(std::shared_ptr<const Cost> fine) {
  constexpr double kSpacing_px = 4, kReach_px = 24;
  constexpr int kPixelStep = 4;
  std::shared_ptr<const Cost> made = fine->at_level({kSpacing_px, kReach_px, kPixelStep});
  const Cost* cost = made.get();
  return {cost, [fine = std::move(fine), made = std::move(made)](const Cost*) {}};
}

/// The point nearest to the middle rays of all views.
Eigen::Vector3d common_centre_mm(const List<View>& views) {
  Eigen::Matrix3d sum = 1e-9 * Eigen::Matrix3d::Identity();  // so that a single view has a centre, too
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const View& view : views) {
    const Eigen::Vector3d along =
        ray_direction(view.camera, {0.5 * (view.camera.width_px - 1), 0.5 * (view.camera.height_px - 1)});
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - along * along.transpose();
    sum += across;
    right += across * source_position_mm(view.camera);
  }
  return solve_symmetric<3>(sum, right);
}

void begin_at(PlacedBone& bone, const Pose* placed, const Pose* by_landmarks, const Pose& nominal,
              const List<View>& views) {
  bone.frame = nominal.frame;
  bone.start = nominal.world_from_model;
  const Eigen::Vector3d middle_mm = bone.start * bone.frame.origin_mm;
  if (placed) {
    bone.start = placed->world_from_model;
    bone.start_is = "the start of the case";
  } else if (by_landmarks) {
    bone.start = by_landmarks->world_from_model;
    bone.start_is = "from the landmarks of the case";
  } else if (is_seen(views, middle_mm)) {
    bone.start_is = "CT coordinates taken as world coordinates";
  } else {
    bone.start.translation_mm += common_centre_mm(views) - middle_mm;
    bone.start_is = "where the views look at";
  }
}

/// The line integral that only one pixel in two hundred exceeds, with the bone in the middle of the first view.
double brightest_mm(const PlacedBone& bone, const List<View>& views) {
  constexpr double kStep_px = 4;
  const Camera& camera = views[0].camera;
  RigidTransform middle = bone.start;
  middle.translation_mm += common_centre_mm(views) - middle * bone.frame.origin_mm;
  PixelGrid grid = bone.radiograph->region(camera, middle);
  grid.columns = int(grid.columns * grid.step_px / kStep_px);
  grid.rows = int(grid.rows * grid.step_px / kStep_px);
  grid.step_px = kStep_px;
  std::vector<float> values = bone.radiograph->radiograph(camera, middle, grid);
  std::erase_if(values, [](float value) { return !(value > 0); });
  if (values.empty()) return 1;
  return quantile_in_place(values, 0.995);
}

}  // namespace

const View& PlacedCase::view(const std::string& name) const {
  if (const View* found = views.find(name)) return *found;
  throw Error("the case has no view " + in_quotes(printable(name)));
}

const PlacedBone& PlacedCase::bone(const std::string& name) const {
  for (const PlacedBone& one : bones)
    if (one.name == name) return one;
  throw Error("the case has no bone " + in_quotes(printable(name)) + " that is registered");
}

std::shared_ptr<const PlacedCase> open_case(const std::string& path, const Workbench& workbench, Job& job) {
  PipelineCall call{workbench_pipeline("place")};
  call.arguments.inputs = {{"case", workbench.folder.inside(path).string()}};
  std::map<std::string, Value> made = outputs_of(call, workbench, job);
  const Value& drawn = made.at("radiographs");
  if (drawn.is_absent() ||
      std::any_of(drawn.items.begin(), drawn.items.end(), [](const Value& item) { return item.is_absent(); }))
    throw Error("this case has no CT, and this page shows bones by their radiographs; add the CT to the case");
  const auto placed = std::make_shared<PlacedCase>();
  placed->path = path;
  placed->views = made.at("views").as_list<View>();
  const auto nominal = poses_of(made.at("nominal"));
  const auto radiographs = made.at("radiographs").as_list<RadiographProjector>();
  const auto outlines = made.at("outlines").as_list<OutlineProjector>();
  const auto contour = made.at("contour").as_list<Cost>();
  const auto grey_values = made.at("grey_values").as_list<Cost>();
  const auto starts = poses_of(made.at("placed"));
  const auto by_landmarks = poses_of(made.at("by_landmarks"));
  for (std::size_t i = 0; i < nominal.size(); ++i) {
    PlacedBone bone;
    bone.name = nominal.name(i);
    bone.radiograph = radiographs.shared(i);
    bone.outline = outlines.shared(i);
    bone.contour = coarse(contour.shared(i));
    bone.grey_values = coarse(grey_values.shared(i));
    begin_at(bone, starts.find(bone.name), by_landmarks.find(bone.name), nominal[i], placed->views);
    bone.brightest_mm = brightest_mm(bone, placed->views);
    placed->bones.push_back(std::move(bone));
  }
  return placed;
}

void PlacedCases::keep(std::shared_ptr<const PlacedCase> one) {
  const std::lock_guard lock(mutex_);
  std::erase_if(cases_, [&](const auto& other) { return other->path == one->path; });
  cases_.insert(cases_.begin(), std::move(one));
  if (cases_.size() > kMostCases) cases_.resize(kMostCases);
}

std::shared_ptr<const PlacedCase> PlacedCases::find(const std::string& path) const {
  const std::lock_guard lock(mutex_);
  for (const auto& one : cases_)
    if (one->path == path) return one;
  throw Conflict("the case " + in_quotes(printable(path)) + " is no longer in memory; open it again");
}

RigidTransform placement_of(const json& matrix) {
  RigidTransform placement{"world", "ct"};
  const auto is_row = [](const json& row) {
    return row.is_array() && row.size() == 4 &&
           std::all_of(row.begin(), row.end(), [](const json& value) { return value.is_number(); });
  };
  if (!matrix.is_array() || matrix.size() != 4 || !std::all_of(matrix.begin(), matrix.end(), is_row))
    throw Error("a pose must be 4 rows of 4 numbers");
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) placement.rotation(i, j) = matrix[std::size_t(i)][std::size_t(j)].get<double>();
    placement.translation_mm(i) = matrix[std::size_t(i)][3].get<double>();
  }
  check_rigid(placement, "the pose");
  return placement;
}

}  // namespace marrow::workbench
