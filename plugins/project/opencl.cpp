// SPDX-License-Identifier: Apache-2.0
// Radiographs on a graphics card, or on any other device that has a driver for OpenCL.
#include <array>
#include <cmath>
#include <marrow/plugin.hpp>

#include "marrow/project/joseph_projector.hpp"
#include "opencl_device.hpp"
#include "opencl_radiographs.hpp"

namespace {

using marrow::Camera;
using marrow::FragmentFrame;
using marrow::PixelGrid;
using marrow::RadiographExpansion;
using marrow::RigidTransform;
using marrow::opencl::Device;
using marrow::opencl::Radiographs;
using marrow::opencl::Request;
using marrow::opencl::View;
using marrow::rays::Attenuation;
using marrow::rays::RayMotion;

constexpr const char* kAsJoseph = "; so the radiographs are computed as by project.joseph";

struct Options : marrow::rays::AttenuationOptions {
  std::string device;
};

template <std::size_t count, class Matrix>
void fill(std::array<float, count>& values, const Matrix& matrix) {
  for (std::size_t i = 0; i < count; ++i)
    values[i] = float(matrix(Eigen::Index(i) / matrix.cols(), Eigen::Index(i) % matrix.cols()));
}

class OpenClProjector : public marrow::RadiographProjector {
 public:
  /// `radiographs` are of this attenuation; null if nothing attenuates.
  OpenClProjector(Attenuation attenuation, std::shared_ptr<const Device> device,
                  std::unique_ptr<const Radiographs> radiographs)
      : attenuation_(std::move(attenuation)), device_(std::move(device)), radiographs_(std::move(radiographs)) {}

  std::vector<float> radiograph(const Camera& camera, const RigidTransform& world_from_model,
                                const PixelGrid& grid) const override {
    return at_grid({camera, world_from_model, attenuation_.grid, FragmentFrame()}, grid, false).values;
  }
  std::vector<float> radiograph(const Camera& camera, const RigidTransform& world_from_model,
                                const std::vector<Eigen::Vector2f>& pixels) const override {
    const RayMotion motion(camera, world_from_model, attenuation_.grid, FragmentFrame());
    Eigen::Vector2d middle = Eigen::Vector2d::Zero();
    for (const Eigen::Vector2f& pixel : pixels) middle += pixel.cast<double>() / double(pixels.size());
    Request request;
    for (const Eigen::Vector2f& pixel : pixels) request.pixels.push_back((pixel.cast<double>() - middle).cast<float>());
    return computed(motion, middle, pixels.size(), request).values;
  }
  std::optional<RadiographExpansion> expansion(const Camera& camera, const RigidTransform& world_from_model,
                                               const FragmentFrame& frame, const PixelGrid& grid) const override {
    return at_grid({camera, world_from_model, attenuation_.grid, frame}, grid, true);
  }

  PixelGrid region(const Camera& camera, const RigidTransform& world_from_model) const override {
    return region_of(attenuation_, camera, world_from_model);
  }
  std::shared_ptr<const marrow::RadiographProjector> smoothed(double sigma_mm) const override {
    return projector_of(marrow::rays::smoothed(attenuation_, sigma_mm), device_, nullptr);
  }

  /// Of project.joseph, with a warning in `context` if it is given, if the device cannot hold the volume.
  static std::shared_ptr<const marrow::RadiographProjector> projector_of(Attenuation attenuation,
                                                                         std::shared_ptr<const Device> device,
                                                                         marrow::Context* context) {
    try {
      std::unique_ptr<const Radiographs> radiographs;
      if (!attenuation.is_empty()) radiographs = std::make_unique<const Radiographs>(device, attenuation);
      return std::make_shared<OpenClProjector>(std::move(attenuation), std::move(device), std::move(radiographs));
    } catch (const marrow::Error& error) {
      if (context) context->warn(error.what() + std::string(kAsJoseph));
      return std::make_shared<marrow::rays::JosephProjector>(std::move(attenuation));
    }
  }

 private:
  RadiographExpansion at_grid(const RayMotion& motion, const PixelGrid& grid, bool with_slopes) const {
    const Eigen::Vector2d half(0.5 * grid.step_px * (grid.columns - 1), 0.5 * grid.step_px * (grid.rows - 1));
    Request request;
    request.view.columns = grid.columns;
    request.view.with_slopes = with_slopes;
    fill(request.view.first, -half);
    request.view.step = float(grid.step_px);
    return computed(motion, Eigen::Vector2d(grid.u_px, grid.v_px) + half, grid.count(), request);
  }

  /// `pixel`: the middle, from which the request counts its pixels.
  RadiographExpansion computed(const RayMotion& motion, const Eigen::Vector2d& pixel, std::size_t count,
                               Request& request) const {
    if (radiographs_ && count > 0) {
      request.view.count = std::int32_t(count);
      place(motion, pixel, request.view);
      radiographs_->compute(request);
    } else {
      request.result.values.assign(count, 0.0f);
      if (request.view.with_slopes)
        for (std::vector<float>& slopes : request.result.slopes) slopes.assign(count, 0.0f);
    }
    return std::move(request.result);
  }

  /// Sets where the rays run.
  void place(const RayMotion& motion, const Eigen::Vector2d& pixel, View& view) const {
    const std::array<int, 3>& size = radiographs_->size();
    Eigen::Vector3d source = motion.rays().source, middle;
    for (int k = 0; k < 3; ++k) {
      source[k] -= attenuation_.first[std::size_t(k)] - Radiographs::kBorder;
      middle[k] = size[std::size_t(k)] / 2;
    }
    Eigen::Matrix3d direction_from_pixel = motion.rays().direction_from_pixel;
    direction_from_pixel.col(2) += direction_from_pixel.leftCols<2>() * pixel;
    direction_from_pixel.col(2).cwiseProduct(motion.rays().spacing_mm).cwiseAbs().maxCoeff(&view.across);
    const int c = view.across;
    Eigen::Matrix<double, 2, 3> place_from_pixel;
    for (int k = 0; k < 2; ++k) {
      const int axis = k == 0 ? (c == 0 ? 1 : 0) : (c == 2 ? 1 : 2);
      place_from_pixel.row(k) = (source[axis] - middle[axis]) * direction_from_pixel.row(c) +
                                (middle[c] - source[c]) * direction_from_pixel.row(axis);
    }
    fill(view.source, source);
    fill(view.middle, middle);
    fill(view.direction_from_pixel, direction_from_pixel);
    fill(view.place_from_pixel, place_from_pixel);
    fill(view.frame_from_direction, motion.frame_from_direction());
    fill(view.frame_from_gradient, motion.frame_from_gradient());
    fill(view.source_mm, motion.source_mm());
  }

  const Attenuation attenuation_;
  const std::shared_ptr<const Device> device_;
  std::unique_ptr<const Radiographs> radiographs_;
};

std::shared_ptr<const marrow::RadiographProjector> opencl(const marrow::Volume& volume,
                                                          const marrow::SignedField* field, const Options& options,
                                                          marrow::Context& context) {
  Attenuation attenuation = attenuation_of(volume, field, options);
  const auto [device, lacks] = Device::choose(options.device, marrow::opencl::kKernel);
  if (!device) {
    context.warn(lacks + kAsJoseph);
    return std::make_shared<marrow::rays::JosephProjector>(std::move(attenuation));
  }
  context.info("radiographs are computed by '" + device->name() + "'");
  return OpenClProjector::projector_of(std::move(attenuation), device, &context);
}

}  // namespace

MARROW_PLUGIN(plugin) {
  auto node = plugin.node("project.opencl", opencl);
  marrow::rays::declare<Options>(node.summary("Joseph's radiographs on a graphics card, by OpenCL; on a machine "
                                              "without one as by project.joseph")
                                     .trait("derivatives")
                                     .trait("device"))
      .option("device", &Options::device, "part of the device's name, as clinfo tells it; none: the first one");
}

/// What `marrow list --fits` says of this machine.
extern "C" __attribute__((visibility("default"))) const char* marrow_device() {
  static std::string text;
  try {
    text = Device::first();
  } catch (const std::exception& error) {
    text = error.what();
  }
  return text.c_str();
}
