// SPDX-License-Identifier: Apache-2.0
// Radiographs on a graphics card, or on any other device that has a driver for OpenCL.
#include <condition_variable>
#include <exception>

#include "marrow/project/slices.hpp"
#include "opencl_device.hpp"
#include "opencl_kernel.hpp"

namespace marrow::opencl {

/// A radiograph that is wanted. `view` has all but the places in buffers.
struct Request {
  View view{};
  std::vector<Eigen::Vector2f> pixels;  ///< from the middle of the image, if there is no grid
  RadiographExpansion result;
  bool is_done = false;
  std::exception_ptr failure = nullptr;
};

/// A volume on a device, and radiographs of it. Those that several threads want at the same time are computed by one
/// call of the kernel. Each has the same bytes in any company.
class Radiographs {
 public:
  /// Empty voxels around those that attenuate.
  static constexpr int kBorder = 1;

  /// Throws Error if the device cannot hold the volume. The attenuation must not be empty.
  Radiographs(std::shared_ptr<const Device> device, const rays::Attenuation& attenuation);
  /// Number of voxels along the axes, with the border.
  const std::array<int, 3>& size() const { return size_; }
  /// Computes request.result. Throws Error if the device fails. Safe to call from several threads at once.
  void compute(Request& request) const;

 private:
  void run(const std::vector<Request*>& batch) const;
  void start(const std::vector<View>& views, const std::vector<Eigen::Vector2f>& pixels, std::size_t results) const;

  const std::shared_ptr<const Device> device_;
  std::array<int, 3> size_;
  std::array<float, 3> spacing_mm_;
  Buffer voxels_;
  Kernel kernel_;

  mutable std::mutex mutex_;  ///< of what follows
  mutable std::condition_variable changed_;
  mutable std::vector<Request*> waiting_;
  mutable bool is_busy_ = false;  ///< a thread uses kernel and results
  mutable Buffer results_;
  mutable std::size_t results_room_ = 0;
};

namespace {

constexpr std::size_t kFloat = sizeof(float);

std::size_t results_of(const View& view) { return std::size_t(view.count) * (view.with_slopes ? 7 : 1); }

/// Room for the part of the volume that attenuates, in voxels.
std::array<int, 3> size_of(const rays::Attenuation& attenuation) {
  std::array<int, 3> size;
  for (std::size_t k = 0; k < 3; ++k)
    size[k] = attenuation.last[k] - attenuation.first[k] + 1 + 2 * Radiographs::kBorder;
  return size;
}

/// As many requests as have room together.
std::vector<Request*>::const_iterator end_of_call(std::vector<Request*>::const_iterator begin,
                                                  std::vector<Request*>::const_iterator end) {
  constexpr std::ptrdiff_t kMostViews = 64;
  constexpr std::size_t kMostResults = std::size_t(32) << 20;
  std::size_t results = results_of((*begin)->view);
  auto last = begin + 1;
  while (last != end && last - begin < kMostViews && (results += results_of((*last)->view)) <= kMostResults) ++last;
  return last;
}

Buffer copy_of(const rays::Attenuation& attenuation, const std::array<int, 3>& size, const Device& device) {
  constexpr std::uint64_t kMostVoxels = 1u << 31;  // the kernel counts them by int
  constexpr double kMegabyte = 1e6;
  const std::uint64_t count = std::uint64_t(size[0]) * std::uint64_t(size[1]) * std::uint64_t(size[2]),
                      most = std::min(device.largest_buffer_bytes() / sizeof(std::int16_t), kMostVoxels);
  if (count > most)
    throw Error(
        formatted("'{}' has no room for the CT: the part that attenuates takes {:.0f} MB, and at most {:.0f} "
                  "MB can be had at once; crop the CT",
                  device.name(), sizeof(std::int16_t) * double(count) / kMegabyte,
                  sizeof(std::int16_t) * double(most) / kMegabyte));
  std::vector<std::int16_t> voxels(count, 0);
  const auto& [first, last] = std::pair(attenuation.first, attenuation.last);
  constexpr int kBorder = Radiographs::kBorder;
  for (int z = first[2]; z <= last[2]; ++z)
    for (int y = first[1]; y <= last[1]; ++y)
      std::copy_n(attenuation.thousandths.begin() + std::ptrdiff_t(attenuation.grid.offset(first[0], y, z)),
                  last[0] - first[0] + 1,
                  voxels.begin() + kBorder +
                      size[0] * (y - first[1] + kBorder + std::ptrdiff_t(size[1]) * (z - first[2] + kBorder)));
  return device.filled(voxels.data(), voxels.size() * sizeof(std::int16_t));
}

}  // namespace

Radiographs::Radiographs(std::shared_ptr<const Device> device, const rays::Attenuation& attenuation)
    : device_(std::move(device)),
      size_(size_of(attenuation)),
      voxels_(copy_of(attenuation, size_, *device_)),
      kernel_(device_->kernel("radiograph")) {
  for (std::size_t k = 0; k < 3; ++k) spacing_mm_[k] = float(attenuation.grid.spacing_mm[int(k)]);
}

void Radiographs::compute(Request& request) const {
  std::unique_lock lock(mutex_);
  waiting_.push_back(&request);
  changed_.wait(lock, [&] { return request.is_done || !is_busy_; });
  if (!request.is_done) {  // the thread that finds the device free computes what all others want by then
    std::vector<Request*> batch;
    batch.swap(waiting_);
    is_busy_ = true;
    lock.unlock();
    std::exception_ptr failure;
    try {
      for (auto begin = batch.cbegin(); begin != batch.cend();) {
        const auto end = end_of_call(begin, batch.cend());
        run({begin, end});
        begin = end;
      }
    } catch (...) {
      failure = std::current_exception();
      clFinish(device_->queue());  // no result may be fetched into memory that is gone
    }
    lock.lock();
    is_busy_ = false;
    for (Request* one : batch) {
      one->failure = failure;
      one->is_done = true;
    }
    changed_.notify_all();
  }
  if (request.failure) std::rethrow_exception(request.failure);
}

void Radiographs::start(const std::vector<View>& views, const std::vector<Eigen::Vector2f>& pixels,
                        std::size_t results) const {
  if (results > results_room_) {
    results_room_ = 0;
    results_.reset();
    results_ = device_->empty(results * kFloat);
    results_room_ = results;
  }
  const Buffer view_buffer = device_->filled(views.data(), views.size() * sizeof(View));
  const Buffer pixel_buffer =
      pixels.empty() ? device_->empty(1) : device_->filled(pixels.data(), pixels.size() * sizeof(pixels[0]));
  cl_uint index = 0;
  const auto argument = [&](std::size_t bytes, const void* value) {
    check(clSetKernelArg(kernel_.get(), index++, bytes, value), "to prepare a radiograph");
  };
  const auto buffer = [&](const Buffer& one) {
    const cl_mem memory = one.get();
    argument(sizeof(memory), &memory);
  };
  const cl_int4 size{{size_[0], size_[1], size_[2], 0}};
  const cl_float4 spacing{{spacing_mm_[0], spacing_mm_[1], spacing_mm_[2], 0}};
  buffer(voxels_);
  argument(sizeof(size), &size);
  argument(sizeof(spacing), &spacing);
  buffer(view_buffer);
  buffer(pixel_buffer);
  buffer(results_);
  constexpr std::size_t kGroup = 64;
  int most = 0;
  for (const View& view : views) most = std::max(most, view.count);
  const std::size_t threads[2] = {(std::size_t(most) + kGroup - 1) / kGroup * kGroup, views.size()},
                    group[2] = {kGroup, 1};
  check(clEnqueueNDRangeKernel(device_->queue(), kernel_.get(), 2, nullptr, threads, group, 0, nullptr, nullptr),
        "to compute a radiograph");
}

void Radiographs::run(const std::vector<Request*>& batch) const {
  std::vector<View> views;
  std::vector<Eigen::Vector2f> pixels;
  std::size_t results = 0;
  for (const Request* one : batch) {
    views.push_back(one->view);
    views.back().first_pixel = std::uint32_t(pixels.size());
    views.back().first_result = std::uint32_t(results);
    pixels.insert(pixels.end(), one->pixels.begin(), one->pixels.end());
    results += results_of(one->view);
  }
  start(views, pixels, results);
  for (std::size_t i = 0; i < batch.size(); ++i) {
    const std::size_t count = std::size_t(views[i].count);
    std::size_t from = views[i].first_result;
    const auto fetch = [&](std::vector<float>& to) {
      to.resize(count);
      check(clEnqueueReadBuffer(device_->queue(), results_.get(), CL_FALSE, from * kFloat, count * kFloat, to.data(), 0,
                                nullptr, nullptr),
            "to fetch a radiograph");
      from += count;
    };
    fetch(batch[i]->result.values);
    if (views[i].with_slopes)
      for (std::vector<float>& slopes : batch[i]->result.slopes) fetch(slopes);
  }
  check(clFinish(device_->queue()), "to compute a radiograph");
}

}  // namespace marrow::opencl

namespace {

using marrow::Camera, marrow::FragmentFrame, marrow::PixelGrid, marrow::RadiographExpansion, marrow::RigidTransform;
using marrow::opencl::Device, marrow::opencl::Radiographs, marrow::opencl::Request, marrow::opencl::View;
using marrow::rays::Attenuation, marrow::rays::RayMotion;

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
