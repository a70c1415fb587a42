// SPDX-License-Identifier: Apache-2.0
// Radiographs from tables: line integrals of the volume are computed once for a set of rays around each view. The value
// of a pixel is interpolated between them. LaRose (PhD thesis, Carnegie Mellon University 2001, transgraph); Russakoff,
// Rohlfing et al. (IEEE Trans Med Imaging 24(11), 2005, attenuation fields) after Levoy and Hanrahan (SIGGRAPH 1996).
#include <tbb/parallel_for.h>

#include "marrow/project/rays.hpp"

namespace {

using marrow::rays::Attenuation, marrow::rays::Bricks, marrow::rays::Rays;

struct Options : marrow::rays::AttenuationOptions {
  double max_rotation_deg = 8;
  double ray_spacing_mm = 2;
  double direction_spacing_deg = 1.2;
  int max_memory_mb = 1024;
};

/// One dimension of a table: `count` samples, the first at `low`.
struct Side {
  double low = 0, step = 1;
  int count = 0;

  static Side of(double low, double high, double step) {
    const int count = int(std::ceil((high - low) / step)) + 1;
    return {0.5 * (low + high) - 0.5 * step * (count - 1), step, count};
  }
  double at(int i) const { return low + step * i; }
  /// Finds the sample before `value` and the fraction of the step to the next. False outside the table.
  bool find(double value, int& i, float& fraction) const {
    const double x = (value - low) / step;
    if (!(x >= 0 && x < count - 1)) return false;
    i = int(x);
    fraction = float(x - i);
    return true;
  }
};

/// The table of rays around one view. A ray has four coordinates: the point where it meets the plane across the view's
/// axis through the middle of the attenuating voxels, and its two slopes against that axis. Coordinates are in mm along
/// the grid's axes.
class Field {
 public:
  Field(const Attenuation& attenuation, const marrow::Camera& camera, const Options& options) {
    const marrow::Grid& grid = attenuation.grid;
    axes_ = (camera.camera_from_world.rotation * grid.direction)
                .transpose();  // columns: the camera's axes, for a model that is not rotated
    Eigen::Vector3d low, high;
    for (int k = 0; k < 3; ++k) {
      low[k] = (attenuation.first[std::size_t(k)] - 1) * grid.spacing_mm[k];
      high[k] = (attenuation.last[std::size_t(k)] + 1) * grid.spacing_mm[k];
    }
    middle_ = 0.5 * (low + high);
    radius_mm_ = 0.5 * (high - low).norm();
    const Eigen::Matrix3d ray_from_pixel = camera.intrinsics.inverse();
    Eigen::Vector2d steepest(0, 0);
    for (const double u : {0.0, double(camera.width_px - 1)})
      for (const double v : {0.0, double(camera.height_px - 1)})
        steepest = steepest.cwiseMax((ray_from_pixel * Eigen::Vector3d(u, v, 1)).hnormalized().cwiseAbs());
    const double slope_step = std::tan(marrow::radians(options.direction_spacing_deg));
    for (int k = 0; k < 2; ++k) {
      const double most =
          std::tan(std::min(std::atan(steepest[k]) + marrow::radians(options.max_rotation_deg), marrow::radians(60)));
      slopes_[k] = Side::of(-most, most, slope_step);
      // The places must cover all rays with these slopes that meet the box.
      double reach = 0;
      for (int corner = 0; corner < 8; ++corner) {
        const Eigen::Vector3d half(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1),
            at = axes_.transpose() * half.cwiseProduct(0.5 * (high - low));
        reach = std::max(reach, std::abs(at[k]) + most * std::abs(at.z()));
      }
      places_[k] = Side::of(-reach - options.ray_spacing_mm, reach + options.ray_spacing_mm, options.ray_spacing_mm);
    }
  }

  std::size_t count() const {
    return std::size_t(places_[0].count) * std::size_t(places_[1].count) * std::size_t(slopes_[0].count) *
           std::size_t(slopes_[1].count);
  }
  Eigen::Vector3d axis() const { return axes_.col(2); }
  const Eigen::Matrix3d& axes() const { return axes_; }
  Eigen::Vector3d from_middle(const Eigen::Vector3d& point_mm) const {
    return axes_.transpose() * (point_mm - middle_);
  }
  double radius_mm() const { return radius_mm_; }

  void fill(const Bricks& bricks, const Eigen::Vector3d& spacing_mm) {
    values_.resize(count());
    const Eigen::Vector3d per_mm = spacing_mm.cwiseInverse();
    const std::size_t directions = std::size_t(slopes_[0].count) * std::size_t(slopes_[1].count),
                      plane = count() / directions;
    tbb::parallel_for(std::size_t(0), directions, [&](std::size_t d) {
      const Eigen::Vector3d along = axes_ * Eigen::Vector3d(slopes_[0].at(int(d) % slopes_[0].count),
                                                            slopes_[1].at(int(d) / slopes_[0].count), 1);
      std::size_t at = d * plane;
      for (int y = 0; y < places_[1].count; ++y)
        for (int x = 0; x < places_[0].count; ++x) {
          const Eigen::Vector3d start =
              middle_ + axes_ * Eigen::Vector3d(places_[0].at(x), places_[1].at(y), 0) - 2 * radius_mm_ * along;
          const float value = bricks.integral(start.cwiseProduct(per_mm), along.cwiseProduct(per_mm));
          values_[at++] = std::uint16_t(std::lround(std::min(value / kUnit_mm, 65535.0f)));
        }
    });
  }

  /// The integral along a ray, interpolated linearly in place and slopes. Nothing if the ray is steeper than the rays
  /// in the table; 0 if it misses the box. `start` and `direction` are in this field's own axes.
  std::optional<float> find(const Eigen::Vector3d& start, const Eigen::Vector3d& direction) const {
    int i[4];
    float f[4];
    const double p = direction.x() / direction.z(), q = direction.y() / direction.z();
    if (!slopes_[0].find(p, i[2], f[2]) || !slopes_[1].find(q, i[3], f[3])) return std::nullopt;
    if (!places_[0].find(start.x() - p * start.z(), i[0], f[0]) ||
        !places_[1].find(start.y() - q * start.z(), i[1], f[1]))
      return 0.0f;
    const std::size_t row = std::size_t(places_[0].count), plane = row * std::size_t(places_[1].count),
                      sheet = plane * std::size_t(slopes_[0].count);
    const std::uint16_t* const at = values_.data() + std::size_t(i[3]) * sheet + std::size_t(i[2]) * plane +
                                    std::size_t(i[1]) * row + std::size_t(i[0]);
    const auto mix = [](float a, float b, float t) { return a + t * (b - a); };
    const auto in_plane = [&](const std::uint16_t* v) {
      return mix(mix(v[0], v[1], f[0]), mix(v[row], v[row + 1], f[0]), f[1]);
    };
    return kUnit_mm * mix(mix(in_plane(at), in_plane(at + plane), f[2]),
                          mix(in_plane(at + sheet), in_plane(at + sheet + plane), f[2]), f[3]);
  }

 private:
  static constexpr float kUnit_mm = 0.02f;  // unit of the stored integrals, whose largest value is 1.3 m of water

  Eigen::Matrix3d axes_;
  Eigen::Vector3d middle_;
  double radius_mm_ = 0;
  Side places_[2], slopes_[2];
  std::vector<std::uint16_t> values_;
};

class LightField : public marrow::rays::RayProjector {
 public:
  LightField(Attenuation attenuation, Bricks bricks, std::vector<Field> fields)
      : RayProjector(std::move(attenuation)), bricks_(std::move(bricks)), fields_(std::move(fields)) {}

 protected:
  float integral(const Eigen::Vector3d& source, const Eigen::Vector3d& direction) const override {
    const Eigen::Vector3d& spacing = attenuation_.grid.spacing_mm;
    const Eigen::Vector3d along = direction.cwiseProduct(spacing);
    const Field* nearest = nullptr;
    double least = 0;
    for (const Field& field : fields_)
      if (const double share = field.axis().dot(along); share > least) least = share, nearest = &field;
    if (nearest) {
      const Eigen::Vector3d start = nearest->from_middle(source.cwiseProduct(spacing));
      // The source must lie in front of all attenuating voxels.
      if (start.z() < -nearest->radius_mm())
        if (const auto value = nearest->find(start, nearest->axes().transpose() * along)) return *value;
    }
    return bricks_.integral(source, direction);
  }

 private:
  Bricks bricks_;
  std::vector<Field> fields_;
};

std::shared_ptr<const marrow::RadiographProjector> lightfield(const marrow::Volume& volume,
                                                              const marrow::SignedField* field,
                                                              const marrow::List<marrow::View>& views,
                                                              marrow::Context& context, const Options& options) {
  if (views.size() == 0)
    throw marrow::Error("there is no view, so the directions to integrate along are not known; wire 'views'");
  for (const marrow::View& view : views) check_camera(view.camera, "view '" + view.name + "'");
  Attenuation attenuation = attenuation_of(volume, field, options);
  std::vector<Field> fields;
  std::size_t count = 0;
  for (std::size_t i = 0; i < views.size() && !attenuation.is_empty(); ++i) {
    fields.emplace_back(attenuation, views[i].camera, options);
    count += fields.back().count();
  }
  const std::size_t mb = count * sizeof(std::uint16_t) >> 20;
  if (mb > std::size_t(options.max_memory_mb))
    throw marrow::Error(
        marrow::formatted("the integrals would take {} MB, but max_memory_mb is {}; raise ray_spacing_mm or "
                          "direction_spacing_deg, take a smaller max_rotation_deg, or the field of a fragment",
                          mb, options.max_memory_mb));
  context.info(marrow::formatted("keeps {} integrals, {} MB", count, mb));
  Bricks bricks(attenuation);
  for (Field& one : fields) one.fill(bricks, attenuation.grid.spacing_mm);
  return std::make_shared<LightField>(std::move(attenuation), std::move(bricks), std::move(fields));
}

}  // namespace

MARROW_PLUGIN(plugin) {
  auto node = plugin.node("project.lightfield", lightfield);
  marrow::rays::declare<Options>(
      node.summary("Radiographs interpolated from line integrals that are computed once around each view (LaRose 2001; "
                   "Russakoff et al., IEEE Trans Med Imaging 2005); rays that are not in the table are integrated by "
                   "Joseph's method"))
      .in("views", "views around which integrals are stored", marrow::over("view"))
      .option("max_rotation_deg", &Options::max_rotation_deg,
              "largest rotation of the bone that the table covers, from CT axes parallel to the world's axes",
              marrow::at_least(0), marrow::at_most(40))
      .option("ray_spacing_mm", &Options::ray_spacing_mm, "distance between neighbouring rays of the table",
              marrow::at_least(0.2), marrow::at_most(20))
      .option("direction_spacing_deg", &Options::direction_spacing_deg,
              "angle between neighbouring directions of the table", marrow::at_least(0.1), marrow::at_most(10))
      .option("max_memory_mb", &Options::max_memory_mb, "largest memory for the integrals", marrow::at_least(1),
              marrow::unit("MB"));
}
