// SPDX-License-Identifier: Apache-2.0
// A plain cost, 1 - correlation of grey values, and others that are wrong in one way each: the suite must catch each of
// them.
#include <atomic>
#include <cmath>
#include <marrow/plugin.hpp>

namespace {

enum class Fault { none, shifted, careless, moved, changing, unordered, unmasked, flat, levels, steep, alone };

template <Fault fault>
class Plain : public marrow::Cost {
 public:
  Plain(const marrow::RadiographProjector& projector, const marrow::List<marrow::View>& views, int step)
      : projector_(projector), views_(views), step_(step) {}

  double value(const marrow::RigidTransform& world_from_model) const override {
    static std::atomic<int> calls{0};
    marrow::RigidTransform pose = world_from_model;
    if (fault == Fault::shifted) pose.translation_mm.x() += 2.5;
    if (fault == Fault::flat) pose.rotation = marrow::rotation_from_vector({0.2, -0.15, 0.3});
    double sum = 0;
    for (const marrow::View& view : views_) sum += of_view(view, pose);
    return sum / double(views_.size()) + (fault == Fault::changing ? 1e-9 * ++calls : 0);
  }
  std::vector<double> values(const std::vector<marrow::RigidTransform>& poses) const override {
    std::vector<double> all = Cost::values(poses);
    if (fault == Fault::unordered) std::swap(all.front(), all.back());
    return all;
  }
  std::shared_ptr<const marrow::Cost> at_level(const marrow::CostLevel& level) const override {
    // Forgets that 0 means: as it was made.
    if (fault == Fault::levels) return std::make_shared<Plain>(projector_, views_, 1000 * level.pixel_step);
    return std::make_shared<Plain>(projector_, views_, level.pixel_step > 0 ? level.pixel_step : step_);
  }
  std::optional<Expansion> expansion(const marrow::RigidTransform& pose,
                                     const marrow::FragmentFrame& frame) const override {
    Expansion about;
    about.value = value(pose);
    for (int k = 0; k < 6; ++k) {
      const marrow::Vector6d step = (k < 3 ? 0.004 : 0.1) * marrow::Vector6d::Unit(k);
      about.gradient[k] = (value(moved(pose, frame, step)) - value(moved(pose, frame, -step))) / (2 * step[k]);
    }
    if (fault == Fault::steep) about.gradient.head<3>() *= marrow::radians(1);  // as if motions were degrees
    about.curvature.setIdentity();
    return about;
  }

 private:
  double of_view(const marrow::View& view, const marrow::RigidTransform& pose) const {
    marrow::PixelGrid grid = projector_.region(view.camera, pose);
    if (grid.count() == 0) return fault == Fault::careless ? std::nan("") : 2;
    grid.step_px = step_;
    grid.columns = (grid.columns - 1) / step_ + 1;
    grid.rows = (grid.rows - 1) / step_ + 1;
    const std::vector<float> rendered = projector_.radiograph(view.camera, pose, grid);
    double n = 0, a = 0, b = 0, aa = 0, bb = 0, ab = 0, squares = 0;
    cv::Mat pixels;
    view.image.pixels.convertTo(pixels, CV_32F);
    for (int row = 0; row < grid.rows; ++row)
      for (int column = 0; column < grid.columns; ++column) {
        const int u = int(grid.pixel(column, row).x()), v = int(grid.pixel(column, row).y());
        if (fault != Fault::unmasked && !view.mask.empty() && !view.mask.at<std::uint8_t>(v, u)) continue;
        const double y = -std::log(std::max(pixels.at<float>(v, u), 1.0f)),
                     x = double(rendered[std::size_t(row) * std::size_t(grid.columns) + std::size_t(column)]);
        if (!std::isfinite(y)) continue;
        n += 1, a += x, b += y, aa += x * x, bb += y * y, ab += x * y, squares += std::pow(0.02 * x - y - 9.5, 2);
      }
    const double va = aa - a * a / n, vb = bb - b * b / n;
    if (fault == Fault::moved && n > 0) return squares / n;
    if (!(n >= 16 && va > 1e-6 && vb > 1e-6)) return 2;
    return 1 - (ab - a * b / n) / std::sqrt(va * vb);
  }

  const marrow::RadiographProjector& projector_;
  const marrow::List<marrow::View> views_;
  const int step_;
};

template <Fault fault>
std::shared_ptr<const marrow::Cost> make(const marrow::RadiographProjector& projector,
                                         const marrow::List<marrow::View>& views,
                                         const marrow::List<marrow::Pose>* others,
                                         const marrow::List<marrow::RadiographProjector>* other_projectors) {
  if (views.size() == 0) throw marrow::Error("there is no view");
  marrow::List<marrow::View> own;
  for (marrow::View view : views) {
    check_view(view);
    check_camera(view.camera, "view '" + view.name + "'");
    for (std::size_t i = 0; other_projectors && others && i < other_projectors->size(); ++i) {
      const marrow::RadiographProjector& other = (*other_projectors)[i];
      if (&other == &projector && fault != Fault::alone) continue;
      const std::vector<float> shadow =
          other.radiograph(view.camera, (*others)[i].world_from_model,
                           marrow::PixelGrid{0, 0, 1, view.camera.width_px, view.camera.height_px});
      cv::Mat mask = view.mask.empty() ? cv::Mat(view.camera.height_px, view.camera.width_px, CV_8U, cv::Scalar(255))
                                       : view.mask.clone();
      for (std::size_t k = 0; k < shadow.size(); ++k)
        if (shadow[k] > 0) mask.data[k] = 0;
      view.mask = mask;
    }
    own.add(view.name, view);
  }
  return std::make_shared<Plain<fault>>(projector, own, 2);
}

}  // namespace

MARROW_PLUGIN(plugin) {
  const auto add = [&](const char* name, auto* function) {
    plugin.node(name, function)
        .summary("For a test of the suite")
        .trait("unmoved_by_gain")
        .trait("derivatives")
        .in("projector", "makes radiographs")
        .in("views", "views", marrow::over("view"))
        .in("others", "poses", marrow::over("fragment"))
        .in("other_projectors", "projectors", marrow::over("fragment"))
        .out("cost", "how badly radiograph and image agree");
  };
  add("similarity.plain", make<Fault::none>);
  add("similarity.shifted", make<Fault::shifted>);
  add("similarity.careless", make<Fault::careless>);
  add("similarity.moved", make<Fault::moved>);
  add("similarity.changing", make<Fault::changing>);
  add("similarity.unordered", make<Fault::unordered>);
  add("similarity.unmasked", make<Fault::unmasked>);
  add("similarity.flat", make<Fault::flat>);
  add("similarity.levels", make<Fault::levels>);
  add("similarity.steep", make<Fault::steep>);
  add("similarity.alone", make<Fault::alone>);
}
