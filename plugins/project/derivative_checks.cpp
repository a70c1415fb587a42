// SPDX-License-Identifier: Apache-2.0
#include "checks.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/domain/quantile.hpp"
#include "marrow/domain/random.hpp"

namespace marrow::conformance {
namespace {

using namespace analytic;

constexpr int kPoses = 200;

/// Every fourth pixel of the image.
PixelGrid coarse() { return {1, 2, 4, 39, 39}; }

/// The exact radiograph of a Gaussian cloud, for nodes that pass the radiographs of others on.
class Cloud : public RadiographProjector {
 public:
  std::vector<float> radiograph(const Camera& camera, const RigidTransform& pose,
                                const PixelGrid& grid) const override {
    std::vector<float> values;
    for (int row = 0; row < grid.rows; ++row)
      for (int column = 0; column < grid.columns; ++column)
        values.push_back(float(integral(camera, pose, grid.pixel(column, row))));
    return values;
  }
  std::vector<float> radiograph(const Camera& camera, const RigidTransform& pose,
                                const std::vector<Eigen::Vector2f>& pixels) const override {
    std::vector<float> values;
    for (const Eigen::Vector2f& pixel : pixels) values.push_back(float(integral(camera, pose, pixel.cast<double>())));
    return values;
  }
  std::optional<RadiographExpansion> expansion(const Camera& camera, const RigidTransform& pose,
                                               const FragmentFrame& about, const PixelGrid& grid) const override {
    constexpr double kStep = 1e-5;
    RadiographExpansion expansion{radiograph(camera, pose, grid), {}};
    for (int k = 0; k < 6; ++k)
      for (int row = 0; row < grid.rows; ++row)
        for (int column = 0; column < grid.columns; ++column) {
          const auto at = [&](double step) {
            return integral(camera, moved(pose, about, step * Vector6d::Unit(k)), grid.pixel(column, row));
          };
          expansion.slopes[std::size_t(k)].push_back(float((at(kStep) - at(-kStep)) / (2 * kStep)));
        }
    return expansion;
  }
  PixelGrid region(const Camera& camera, const RigidTransform&) const override {
    return {0, 0, 1, camera.width_px, camera.height_px};
  }

 private:
  static double integral(const Camera& camera, const RigidTransform& pose, const Eigen::Vector2d& pixel) {
    constexpr double kWidth_mm = 9, kHeight_mm = 30;
    const Eigen::Vector3d middle = pose * Eigen::Vector3d(4, -6, 5) - source_position_mm(camera);
    const double distance = middle.cross(ray_direction(camera, pixel)).norm() / kWidth_mm;
    return kHeight_mm * std::exp(-0.5 * distance * distance);
  }
};

FragmentFrame frame() { return {{5, -9, 14}, rotation_from_vector({0.4, 0.1, -0.7})}; }

RigidTransform random_pose(Random& random) {
  const auto vector = [&](double most) {
    Eigen::Vector3d v;
    for (int k = 0; k < 3; ++k) v[k] = most * (2 * random.uniform() - 1);
    return v;
  };
  const Eigen::Vector3d turn = vector(1.5), shift = vector(30);
  return moved_by(turn, shift);
}

/// How far the derivatives at a pose are from central differences: the root mean square over the pixels, divided by the
/// largest difference. The worst of the six. A single pixel may be farther off, where a ray passes from one voxel to
/// the next: there the derivative of interpolated values jumps.
double slopes_off(const RadiographProjector& projector, const Camera& camera, const RigidTransform& at) {
  const PixelGrid grid = coarse();
  const auto expansion = projector.expansion(camera, at, frame(), grid);
  expect(expansion.has_value(), "it declares the trait 'derivatives', but its radiographs have none");
  double worst = 0;
  for (int k = 0; k < 6; ++k) {
    const double step = k < 3 ? 1e-4 : 0.004;
    const std::vector<float>& slopes = expansion->slopes[std::size_t(k)];
    expect(slopes.size() == grid.count() && expansion->values.size() == grid.count(),
           formatted("of {} pixels it gives {} derivatives", grid.count(), slopes.size()));
    const auto above = projector.radiograph(camera, moved(at, frame(), step * Vector6d::Unit(k)), grid),
               below = projector.radiograph(camera, moved(at, frame(), -step * Vector6d::Unit(k)), grid);
    double squares = 0, largest = 0;
    for (std::size_t i = 0; i < slopes.size(); ++i) {
      const double expected = (double(above[i]) - double(below[i])) / (2 * step);
      squares += std::pow(slopes[i] - expected, 2);
      largest = std::max(largest, std::abs(expected));
    }
    // A model that is hardly seen has derivatives that are no larger than rounding errors.
    const double least = k < 3 ? 1 : 0.1;
    worst = std::max(worst, std::sqrt(squares / double(slopes.size())) / std::max(largest, least));
  }
  return worst;
}

/// At random poses. At one in twenty it may be worse: a radiograph may jump a little where its sampling changes.
double slopes_off(const RadiographProjector& projector) {
  Random random(7);
  std::vector<double> off;
  for (int i = 0; i < kPoses; ++i)
    off.push_back(slopes_off(projector, camera_at(angles()[std::size_t(i) % angles().size()]), random_pose(random)));
  return quantile_in_place(off, 0.95);
}

/// Of a model that is smoothed as costs smooth it, if it can be: a bone's sharp border has no derivative.
double slopes_of_smooth_off(const RadiographProjector& projector) {
  constexpr double kSigma_mm = 1.5;
  const auto smooth = projector.smoothed(kSigma_mm);
  return slopes_off(smooth ? *smooth : projector);
}

/// The largest difference between the values of an expansion and those of a radiograph.
double values_off_mm(const RadiographProjector& projector) {
  double most = 0;
  for (const double angle : angles()) {
    const auto expansion = projector.expansion(camera_at(angle), pose(), frame(), coarse());
    expect(expansion.has_value(), "it declares the trait 'derivatives', but its radiographs have none");
    const std::vector<float> values = projector.radiograph(camera_at(angle), pose(), coarse());
    for (std::size_t i = 0; i < values.size(); ++i)
      most = std::max(most, std::abs(double(expansion->values.at(i)) - double(values[i])));
  }
  return most;
}

/// Whether it has derivatives, as it declares. Throws NotApplicable if it has none.
void check_declared(const Subject& subject, const RadiographProjector& projector) {
  const bool is_declared = subject.has_trait("derivatives");
  const bool has_some = projector.expansion(camera_at(0), pose(), frame(), coarse()).has_value();
  expect(is_declared || !has_some, "its radiographs have derivatives, but it does not declare the trait 'derivatives'");
  if (!is_declared) throw NotApplicable("its radiographs have no derivatives");
}

/// An egg; one of two balls, with the field's edge between them; and a ball that the end of the CT cuts.
std::vector<Inputs> scenes() {
  const Body two{{{-9, 0, 0}, {9, 9, 9}}, {{9, 0, 0}, {9, 9, 9}}}, one{two[0]}, cut{{{20, 4, 10}, {18, 18, 18}}};
  const Grid grid = fine_grid();
  const auto scene = [&](const Body& body, const Body& fragment) {
    Inputs inputs = inputs_of(fragment);
    inputs.set("volume", item(volume_of(body, grid, 500, -1000)));
    inputs.set("projector", Value::of<RadiographProjector>(std::make_shared<const Cloud>()));
    return inputs;
  };
  return {scene(egg(), egg()), scene(two, one), scene(cut, cut)};
}

Check check_of(const char* name, const char* what, double limit, const char* unit,
               const std::function<double(const RadiographProjector&)>& figure) {
  return {{name, what, limit, unit}, [figure](const Subject& subject) {
            double most = 0;
            for (const Inputs& inputs : scenes())
              most = std::max(most, largest_of<RadiographProjector>(subject, inputs, "it makes no radiographs",
                                                                    [&](const RadiographProjector& projector) {
                                                                      check_declared(subject, projector);
                                                                      return figure(projector);
                                                                    }));
            return most;
          }};
}

}  // namespace

std::vector<Check> derivative_checks() {
  return {check_of("slopes",
                   "derivatives of radiographs against differences at 200 poses: root mean square over the pixels, as "
                   "a part of the largest derivative",
                   3e-3, "1", slopes_of_smooth_off),
          check_of("values_with_slopes", "a radiograph with derivatives against one without: largest difference", 1e-3,
                   "mm of water", values_off_mm)};
}

}  // namespace marrow::conformance
