// SPDX-License-Identifier: Apache-2.0
#pragma once
#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>

#include <cstdint>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

namespace marrow::opencl {

template <class Handle, cl_int (*release)(Handle)>
struct Released {
  using pointer = Handle;
  void operator()(Handle handle) const { release(handle); }
};
using Context = std::unique_ptr<std::remove_pointer_t<cl_context>, Released<cl_context, clReleaseContext>>;
using Queue =
    std::unique_ptr<std::remove_pointer_t<cl_command_queue>, Released<cl_command_queue, clReleaseCommandQueue>>;
using Program = std::unique_ptr<std::remove_pointer_t<cl_program>, Released<cl_program, clReleaseProgram>>;
using Kernel = std::unique_ptr<std::remove_pointer_t<cl_kernel>, Released<cl_kernel, clReleaseKernel>>;
using Buffer = std::unique_ptr<std::remove_pointer_t<cl_mem>, Released<cl_mem, clReleaseMemObject>>;

/// Throws Error with what was tried and OpenCL's number unless the code is CL_SUCCESS.
void check(cl_int code, const std::string& tried);

class Device;
/// A device, or null and one sentence that says why there is none.
struct Choice {
  std::shared_ptr<const Device> device;
  std::string lacks;
};

/// A device with the kernels that were built for it. Safe to use from several threads at once.
class Device {
 public:
  /// The first device whose name contains `name`, graphics cards before others. Throws Error if there are devices, but
  /// none of that name.
  static Choice choose(const std::string& name, const char* source);
  /// One sentence: which device choose() tries first if no name is given, or that there is none.
  static std::string first();

  const std::string& name() const { return name_; }
  cl_command_queue queue() const { return queue_.get(); }
  /// The most that a buffer can hold.
  std::uint64_t largest_buffer_bytes() const { return largest_buffer_bytes_; }
  Kernel kernel(const char* name) const;
  /// A buffer that holds these bytes.
  Buffer filled(const void* data, std::size_t bytes) const;
  Buffer empty(std::size_t bytes) const;

 private:
  Device(cl_device_id id, const char* source);

  std::string name_;
  std::uint64_t largest_buffer_bytes_ = 0;
  Context context_;
  Queue queue_;
  Program program_;
};

}  // namespace marrow::opencl
