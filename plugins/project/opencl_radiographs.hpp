// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <array>
#include <condition_variable>
#include <exception>
#include <memory>
#include <mutex>
#include <vector>

#include "marrow/domain/functions.hpp"
#include "marrow/project/attenuation.hpp"
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

}  // namespace marrow::opencl
