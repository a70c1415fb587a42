// SPDX-License-Identifier: Apache-2.0
#include "opencl_radiographs.hpp"

#include <algorithm>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"

namespace marrow::opencl {
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
