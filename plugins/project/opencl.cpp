// SPDX-License-Identifier: Apache-2.0
// Radiographs on a graphics card, or on any other device that has a driver for OpenCL.
#include <array>
#include <cmath>
#include <marrow/plugin.hpp>

#include "marrow/project/joseph_projector.hpp"
#include "opencl_device.hpp"
#include "opencl_kernel.hpp"

namespace {

using marrow::Camera;
using marrow::FragmentFrame;
using marrow::PixelGrid;
using marrow::RadiographExpansion;
using marrow::RigidTransform;
using marrow::opencl::Buffer;
using marrow::opencl::Device;
using marrow::rays::Attenuation;

struct Options : marrow::rays::AttenuationOptions {
  std::string device;
};

/// As the kernel declares it.
struct DeviceView {
  std::array<float, 3> source, middle;
  std::array<float, 2> pixel;
  std::array<float, 9> direction_from_pixel;
  std::array<float, 6> place_from_pixel;
  std::array<float, 9> frame_from_direction, frame_from_gradient;
  std::array<float, 3> source_mm;
  std::int32_t across;
};

template <std::size_t count, class Matrix>
void fill(std::array<float, count>& values, const Matrix& matrix) {
  for (std::size_t i = 0; i < count; ++i)
    values[i] = float(matrix(Eigen::Index(i) / matrix.cols(), Eigen::Index(i) % matrix.cols()));
}

class OpenClProjector : public marrow::RadiographProjector {
 public:
  OpenClProjector(Attenuation attenuation, std::shared_ptr<const Device> device)
      : attenuation_(std::move(attenuation)), device_(std::move(device)) {
    if (attenuation_.is_empty()) return;
    const auto& [first, last] = std::pair(attenuation_.first, attenuation_.last);
    for (std::size_t k = 0; k < 3; ++k) size_[k] = last[k] - first[k] + 1 + 2 * kBorder;
    std::vector<std::int16_t> voxels(std::size_t(size_[0]) * std::size_t(size_[1]) * std::size_t(size_[2]), 0);
    for (int z = first[2]; z <= last[2]; ++z)
      for (int y = first[1]; y <= last[1]; ++y)
        std::copy_n(attenuation_.thousandths.begin() + std::ptrdiff_t(attenuation_.grid.offset(first[0], y, z)),
                    last[0] - first[0] + 1,
                    voxels.begin() + kBorder +
                        size_[0] * (y - first[1] + kBorder + std::ptrdiff_t(size_[1]) * (z - first[2] + kBorder)));
    voxels_ = device_->filled(voxels.data(), voxels.size() * sizeof(std::int16_t));
  }

  std::vector<float> radiograph(const Camera& camera, const RigidTransform& world_from_model,
                                const PixelGrid& grid) const override {
    return on_device(camera, world_from_model, FragmentFrame(), pixels_of(grid), false).values;
  }
  std::vector<float> radiograph(const Camera& camera, const RigidTransform& world_from_model,
                                const std::vector<Eigen::Vector2f>& pixels) const override {
    return on_device(camera, world_from_model, FragmentFrame(), pixels, false).values;
  }
  std::optional<RadiographExpansion> expansion(const Camera& camera, const RigidTransform& world_from_model,
                                               const FragmentFrame& frame, const PixelGrid& grid) const override {
    return on_device(camera, world_from_model, frame, pixels_of(grid), true);
  }

  PixelGrid region(const Camera& camera, const RigidTransform& world_from_model) const override {
    return region_of(attenuation_, camera, world_from_model);
  }
  std::shared_ptr<const marrow::RadiographProjector> smoothed(double sigma_mm) const override {
    return std::make_shared<OpenClProjector>(marrow::rays::smoothed(attenuation_, sigma_mm), device_);
  }

 private:
  static constexpr int kBorder = 1;  ///< empty voxels around those that attenuate

  static std::vector<Eigen::Vector2f> pixels_of(const PixelGrid& grid) {
    std::vector<Eigen::Vector2f> pixels;
    for (int row = 0; row < grid.rows; ++row)
      for (int column = 0; column < grid.columns; ++column) pixels.push_back(grid.pixel(column, row).cast<float>());
    return pixels;
  }

  /// `pixel`: in the middle of those that are asked for.
  DeviceView view_of(const marrow::rays::RayMotion& motion, const Eigen::Vector2d& pixel) const {
    DeviceView view;
    Eigen::Vector3d source = motion.rays().source, middle;
    for (int k = 0; k < 3; ++k) {
      source[k] -= attenuation_.first[std::size_t(k)] - kBorder;
      middle[k] = size_[std::size_t(k)] / 2;
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
    fill(view.pixel, pixel);
    fill(view.direction_from_pixel, direction_from_pixel);
    fill(view.place_from_pixel, place_from_pixel);
    fill(view.frame_from_direction, motion.frame_from_direction());
    fill(view.frame_from_gradient, motion.frame_from_gradient());
    fill(view.source_mm, motion.source_mm());
    return view;
  }

  RadiographExpansion on_device(const Camera& camera, const RigidTransform& world_from_model,
                                const FragmentFrame& frame, const std::vector<Eigen::Vector2f>& pixels,
                                bool with_slopes) const {
    const marrow::rays::RayMotion motion(camera, world_from_model, attenuation_.grid, frame);
    RadiographExpansion result;
    result.values.assign(pixels.size(), 0.0f);
    if (with_slopes)
      for (auto& slopes : result.slopes) slopes.assign(pixels.size(), 0.0f);
    if (attenuation_.is_empty() || pixels.empty()) return result;
    Eigen::Vector2d middle = Eigen::Vector2d::Zero();
    for (const Eigen::Vector2f& pixel : pixels) middle += pixel.cast<double>() / double(pixels.size());
    const DeviceView view = view_of(motion, middle);
    const Buffer views = device_->filled(&view, sizeof(view)),
                 places = device_->filled(pixels.data(), pixels.size() * sizeof(pixels[0])),
                 values = device_->empty(pixels.size() * sizeof(float)),
                 slopes = device_->empty(with_slopes ? 6 * pixels.size() * sizeof(float) : 1);
    const marrow::opencl::Kernel kernel = device_->kernel("radiograph");
    const cl_int4 size{{size_[0], size_[1], size_[2], 0}};
    const Eigen::Vector3f mm = motion.rays().spacing_mm.cast<float>();
    const cl_float4 spacing{{mm.x(), mm.y(), mm.z(), 0}};
    const cl_int count = cl_int(pixels.size()), has_slopes = with_slopes;
    cl_uint index = 0;
    const auto argument = [&](std::size_t bytes, const void* value) {
      marrow::opencl::check(clSetKernelArg(kernel.get(), index++, bytes, value), "to prepare a radiograph");
    };
    const auto buffer = [&](const Buffer& one) {
      const cl_mem memory = one.get();
      argument(sizeof(memory), &memory);
    };
    buffer(voxels_);
    argument(sizeof(size), &size);
    argument(sizeof(spacing), &spacing);
    buffer(views);
    buffer(places);
    argument(sizeof(count), &count);
    argument(sizeof(has_slopes), &has_slopes);
    buffer(values);
    buffer(slopes);
    constexpr std::size_t kGroup = 64;
    const std::size_t threads[2] = {(pixels.size() + kGroup - 1) / kGroup * kGroup, 1}, group[2] = {kGroup, 1};
    marrow::opencl::check(
        clEnqueueNDRangeKernel(device_->queue(), kernel.get(), 2, nullptr, threads, group, 0, nullptr, nullptr),
        "to compute a radiograph");
    const auto fetch = [&](const Buffer& from, std::size_t offset, std::vector<float>& to) {
      marrow::opencl::check(clEnqueueReadBuffer(device_->queue(), from.get(), CL_TRUE, offset * sizeof(float),
                                                to.size() * sizeof(float), to.data(), 0, nullptr, nullptr),
                            "to fetch a radiograph");
    };
    fetch(values, 0, result.values);
    if (with_slopes)
      for (std::size_t k = 0; k < 6; ++k) fetch(slopes, k * pixels.size(), result.slopes[k]);
    return result;
  }

  const Attenuation attenuation_;
  const std::shared_ptr<const Device> device_;
  std::array<int, 3> size_{0, 0, 0};
  Buffer voxels_;
};

std::shared_ptr<const marrow::RadiographProjector> opencl(const marrow::Volume& volume,
                                                          const marrow::SignedField* field, const Options& options,
                                                          marrow::Context& context) {
  Attenuation attenuation = attenuation_of(volume, field, options);
  if (const auto device = Device::find(options.device, marrow::opencl::kKernel)) {
    context.info("radiographs are computed by '" + device->name() + "'");
    return std::make_shared<OpenClProjector>(std::move(attenuation), device);
  }
  const std::vector<std::string> names = Device::names();
  if (!names.empty()) {
    std::string known;
    for (const std::string& name : names) known += (known.empty() ? "'" : ", '") + name + "'";
    throw marrow::Error("no device's name contains '" + options.device + "'; there are " + known);
  }
  context.warn(
      "no device with OpenCL is here, so the radiographs are computed as by project.joseph; a driver for the graphics "
      "card, or the package pocl-opencl-icd, would provide one");
  return std::make_shared<marrow::rays::JosephProjector>(std::move(attenuation));
}

}  // namespace

MARROW_PLUGIN(plugin) {
  auto node = plugin.node("project.opencl", opencl);
  marrow::rays::declare<Options>(node.summary("Joseph's radiographs on a graphics card, by OpenCL; on a machine "
                                              "without one as by project.joseph")
                                     .trait("derivatives"))
      .option("device", &Options::device, "part of the device's name, as clinfo tells it; none: the first one");
}
