// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/match/inputs.hpp"

#include "marrow/toolbox/match/nearest_edges.hpp"

namespace marrow::match {
namespace {

/// Marks the pixels of a row or column between an outline point at which the bone begins and one at which it ends.
/// `ends`: position of each point, and whether the bone ends there.
void fill_line(std::vector<std::pair<float, bool>>& ends, int size, const std::function<void(int)>& mark) {
  std::sort(ends.begin(), ends.end());
  for (std::size_t i = 0; i + 1 < ends.size(); ++i)
    if (!ends[i].second && ends[i + 1].second)
      for (int at = std::max(0, int(std::ceil(ends[i].first))); at <= std::min(size - 1, int(ends[i + 1].first)); ++at)
        mark(at);
}

/// Marks the pixels inside an outline: those between two of its points in a row or in a column. Both are used because
/// the outline may be open where the CT ends.
void fill_outline(const std::vector<OutlinePoint>& outline, cv::Mat& mask) {
  std::vector<std::vector<std::pair<float, bool>>> rows(std::size_t(mask.rows)), columns(std::size_t(mask.cols));
  for (const OutlinePoint& p : outline) {
    const int u = std::clamp(int(std::lround(p.u_px)), 0, mask.cols - 1),
              v = std::clamp(int(std::lround(p.v_px)), 0, mask.rows - 1);
    if (std::abs(p.normal_u) > 0.5f) rows[std::size_t(v)].emplace_back(p.u_px, p.normal_u > 0);
    if (std::abs(p.normal_v) > 0.5f) columns[std::size_t(u)].emplace_back(p.v_px, p.normal_v > 0);
  }
  for (int v = 0; v < mask.rows; ++v)
    fill_line(rows[std::size_t(v)], mask.cols, [&](int u) { mask.at<std::uint8_t>(v, u) = 1; });
  for (int u = 0; u < mask.cols; ++u)
    fill_line(columns[std::size_t(u)], mask.rows, [&](int v) { mask.at<std::uint8_t>(v, u) = 1; });
}

void add_shadow(const OutlineProjector& projector, const RigidTransform& world_from_model, const Camera& camera,
                cv::Mat& mask) {
  fill_outline(projector.outline(camera, world_from_model, 0.5), mask);
}

void add_shadow(const RadiographProjector& projector, const RigidTransform& world_from_model, const Camera& camera,
                cv::Mat& mask) {
  const PixelGrid region = projector.region(camera, world_from_model);
  const std::vector<float> values = projector.radiograph(camera, world_from_model, region);
  for (int row = 0; row < region.rows; ++row)
    for (int column = 0; column < region.columns; ++column)
      if (values[std::size_t(row) * std::size_t(region.columns) + std::size_t(column)] > 0)
        mask.at<std::uint8_t>(int(region.v_px) + row, int(region.u_px) + column) = 1;
}

/// Marks the pixels that show the other fragment.
void add_shadow(const Other& other, const Camera& camera, cv::Mat& mask) {
  std::visit([&](const auto* projector) { add_shadow(*projector, other.world_from_model, camera, mask); },
             other.projector);
}

constexpr const char* kNoPoses = "there are projectors of other fragments, but no poses; wire 'others'";

/// The pose of a fragment that the node's input `port` names. Throws Error if there is none.
const RigidTransform& pose_of(const std::string& fragment, const List<Pose>& poses, const std::string& port) {
  const Pose* pose = poses.find(fragment);
  if (!pose)
    throw Error(port + " has the fragment '" + fragment +
                "', but others has no pose of it; give the poses of the same fragments");
  return pose->world_from_model;
}

}  // namespace

void check_views(const List<View>& views) {
  if (views.size() == 0) throw Error("there is no view to compare the model with");
  for (const View& view : views) {
    check_view(view);
    check_camera(view.camera, "view '" + view.name + "'");
  }
}

void check_weights(const std::vector<double>& weights, std::size_t views) {
  if (!weights.empty() && weights.size() != views)
    throw Error(formatted("weights has {} numbers, but there are {} views; give one for each", weights.size(), views));
  double sum = 0;
  for (const double weight : weights) {
    if (!(weight >= 0)) throw Error(formatted("weights: each must be 0 or more, got {:f}", weight));
    sum += weight;
  }
  if (!weights.empty() && !(sum > 0)) throw Error("weights: one at least must be above 0");
}

void check_edges(const List<View>& views, const List<EdgeMap>& edges) {
  if (views.size() == 0) throw Error("there is no view to compare the model with");
  if (views.size() != edges.size())
    throw Error(
        formatted("there are {} views, but edge maps of {}; give the edges of each view", views.size(), edges.size()));
  const auto size = [](int width, int height) { return formatted("{} x {}", width, height); };
  for (std::size_t i = 0; i < views.size(); ++i) {
    check_camera(views[i].camera, "view '" + views.name(i) + "'");
    if (edges[i].pixels.empty())
      throw Error("view '" + views.name(i) +
                  "': the edge map is empty, so nothing can be compared; lower the thresholds of the edge detector, or "
                  "check that the image shows the bone");
    const Camera& camera = views[i].camera;
    if (edges[i].width_px != camera.width_px || edges[i].height_px != camera.height_px)
      throw Error("view '" + views.name(i) + "': the edge map has " + size(edges[i].width_px, edges[i].height_px) +
                  " pixels, but the camera " + size(camera.width_px, camera.height_px) +
                  "; give the edges of this view's own image");
  }
}

template <class Projector>
std::vector<OtherDrawnBy<Projector>> others_of(const Projector* own, const List<Pose>* poses,
                                               const List<Projector>* projectors, const std::string& own_port) {
  std::vector<OtherDrawnBy<Projector>> others;
  if (poses && !projectors)
    throw Error("there are poses of other fragments, but nothing draws them; wire 'other_projectors'");
  if (!projectors) return others;
  if (!poses) throw Error(kNoPoses);
  if (!own)
    throw Error("there are other fragments, but it is not known which of them is this one; wire '" + own_port +
                "', the one that draws this fragment");
  for (std::size_t i = 0; i < projectors->size(); ++i)
    if (&(*projectors)[i] != own)
      others.push_back({&(*projectors)[i], pose_of(projectors->name(i), *poses, "other_projectors")});
  return others;
}
template std::vector<OtherOutline> others_of(const OutlineProjector*, const List<Pose>*, const List<OutlineProjector>*,
                                             const std::string&);
template std::vector<Other> others_of(const RadiographProjector*, const List<Pose>*, const List<RadiographProjector>*,
                                      const std::string&);

std::vector<Other> shadows_of(const RadiographProjector* own, const List<Pose>* poses,
                              const List<RadiographProjector>* projectors, const List<OutlineProjector>* outlines) {
  if (!outlines) return others_of(own, poses, projectors);
  if (!poses) throw Error(kNoPoses);
  std::vector<Other> others;
  if (projectors) others = others_of(own, poses, projectors);
  for (std::size_t i = 0; i < outlines->size(); ++i)
    others.push_back({&(*outlines)[i], pose_of(outlines->name(i), *poses, "other_outlines")});
  return others;
}

List<View> without_shadows(const List<View>& views, const std::vector<Other>& others) {
  if (others.empty()) return views;
  List<View> left;
  for (std::size_t i = 0; i < views.size(); ++i) {
    View view = views[i];
    cv::Mat shadow = cv::Mat::zeros(view.image.pixels.size(), CV_8U);
    for (const Other& other : others) add_shadow(other, view.camera, shadow);
    cv::Mat mask = view.mask.empty() ? cv::Mat(view.image.pixels.size(), CV_8U, cv::Scalar(255)) : view.mask.clone();
    mask.setTo(0, shadow);
    view.mask = mask;
    left.add(views.name(i), std::move(view));
  }
  return left;
}

List<EdgeMap> without_outlines(const List<View>& views, const List<EdgeMap>& edges,
                               const std::vector<OtherOutline>& others, double reach_px, double tolerance_deg) {
  if (others.empty()) return edges;
  List<EdgeMap> left;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const Camera& camera = views[i].camera;
    EdgeMap kept = edges[i];
    for (const OtherOutline& other : others) {
      const std::vector<OutlinePoint> outline = other.projector->outline(camera, other.world_from_model, 1);
      const NearestOutline nearest(outline, camera.width_px, camera.height_px, reach_px);
      const float least_cosine = float(std::cos(radians(tolerance_deg)));
      std::erase_if(kept.pixels,
                    [&](const EdgePixel& edge) { return nearest.find(edge, reach_px, least_cosine) >= 0; });
    }
    left.add(edges.name(i), std::move(kept));
  }
  return left;
}

}  // namespace marrow::match
