// SPDX-License-Identifier: Apache-2.0
#include "opencl_device.hpp"

#include <signal.h>

#include <algorithm>
#include <array>
#include <mutex>
#include <sstream>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"

namespace marrow::opencl {
namespace {

/// Puts back how signals are handled: a device's compiler may take them over when it is used first. One at a time.
class KeptSignals {
 public:
  KeptSignals() : lock_(mutex()) {
    for (int signal = 1; signal < kEnd; ++signal) sigaction(signal, nullptr, &before_[std::size_t(signal)]);
  }
  ~KeptSignals() {
    for (int signal = 1; signal < kEnd; ++signal) sigaction(signal, &before_[std::size_t(signal)], nullptr);
  }
  KeptSignals(const KeptSignals&) = delete;
  KeptSignals& operator=(const KeptSignals&) = delete;

 private:
  static std::mutex& mutex() {
    static std::mutex one;
    return one;
  }
  static constexpr int kEnd = 32;  // the signals from here on belong to libraries
  const std::scoped_lock<std::mutex> lock_;
  std::array<struct sigaction, kEnd> before_{};
};

constexpr const char* kNoDevice =
    "no device with OpenCL is here; a driver for the graphics card, or Debian's package pocl-opencl-icd, provides one";

std::string name_of(cl_device_id device) {
  std::size_t size = 0;
  check(clGetDeviceInfo(device, CL_DEVICE_NAME, 0, nullptr, &size), "to ask for a device's name");
  std::string name(size, 0);
  check(clGetDeviceInfo(device, CL_DEVICE_NAME, size, name.data(), nullptr), "to ask for a device's name");
  while (!name.empty() && (name.back() == 0 || name.back() == ' ')) name.pop_back();
  return name;
}

bool is_graphics_card(cl_device_id device) {
  cl_device_type type = 0;
  return clGetDeviceInfo(device, CL_DEVICE_TYPE, sizeof(type), &type, nullptr) == CL_SUCCESS &&
         (type & CL_DEVICE_TYPE_GPU) != 0;
}

/// All devices, graphics cards first. A machine without a driver has no platform, which is no fault.
std::vector<cl_device_id> devices() {
  cl_uint count = 0;
  if (clGetPlatformIDs(0, nullptr, &count) != CL_SUCCESS || count == 0) return {};
  std::vector<cl_platform_id> platforms(count);
  check(clGetPlatformIDs(count, platforms.data(), nullptr), "to list the platforms");
  std::vector<cl_device_id> all;
  for (const cl_platform_id platform : platforms) {
    cl_uint here = 0;
    if (clGetDeviceIDs(platform, CL_DEVICE_TYPE_ALL, 0, nullptr, &here) != CL_SUCCESS || here == 0) continue;
    std::vector<cl_device_id> found(here);
    check(clGetDeviceIDs(platform, CL_DEVICE_TYPE_ALL, here, found.data(), nullptr), "to list the devices");
    all.insert(all.end(), found.begin(), found.end());
  }
  std::stable_partition(all.begin(), all.end(), is_graphics_card);
  return all;
}

/// The first lines of what a compiler says, in one line.
std::string beginning_of(const std::string& log) {
  constexpr int kLines = 4;
  std::istringstream lines(log);
  std::string text, line;
  for (int i = 0; i < kLines && std::getline(lines, line);)
    if (line.find_first_not_of(" \t\r") != std::string::npos) {
      text += (i++ ? " | " : "") + line;
    }
  return text.empty() ? "its compiler does not say why" : text;
}

}  // namespace

void check(cl_int code, const std::string& tried) {
  if (code == CL_SUCCESS) return;
  const bool is_full =
      code == CL_MEM_OBJECT_ALLOCATION_FAILURE || code == CL_OUT_OF_RESOURCES || code == CL_INVALID_BUFFER_SIZE;
  throw Error(formatted("OpenCL failed {} (its error {}){}", tried, code,
                        is_full ? "; the device has too little memory: crop the CT, or use project.joseph" : ""));
}

Choice Device::choose(const std::string& name, const char* source) {
  const KeptSignals signals;
  const std::vector<cl_device_id> all = devices();
  if (all.empty()) return {nullptr, kNoDevice};
  std::string known;
  for (const cl_device_id device : all) {
    if (name_of(device).find(name) == std::string::npos) {
      known += (known.empty() ? "'" : ", '") + name_of(device) + "'";
      continue;
    }
    try {
      return {std::shared_ptr<const Device>(new Device(device, source)), ""};
    } catch (const Error& error) {
      return {nullptr, error.what()};
    }
  }
  throw Error("no device's name contains '" + name + "'; there are " + known);
}

std::string Device::first() {
  const std::vector<cl_device_id> all = devices();
  if (all.empty()) return kNoDevice;
  return formatted("it would use the {} '{}'", is_graphics_card(all[0]) ? "graphics card" : "device", name_of(all[0]));
}

Device::Device(cl_device_id id, const char* source) : name_(name_of(id)) {
  cl_ulong largest = 0;
  check(clGetDeviceInfo(id, CL_DEVICE_MAX_MEM_ALLOC_SIZE, sizeof(largest), &largest, nullptr),
        "to ask '" + name_ + "' for its memory");
  largest_buffer_bytes_ = largest;
  cl_int code = CL_SUCCESS;
  context_.reset(clCreateContext(nullptr, 1, &id, nullptr, nullptr, &code));
  check(code, "to open '" + name_ + "'");
  queue_.reset(clCreateCommandQueue(context_.get(), id, 0, &code));
  check(code, "to open a queue on '" + name_ + "'");
  program_.reset(clCreateProgramWithSource(context_.get(), 1, &source, nullptr, &code));
  check(code, "to load a program");
  code = clBuildProgram(program_.get(), 1, &id, "-cl-std=CL1.2", nullptr, nullptr);
  if (code == CL_SUCCESS) return;
  std::size_t size = 0;
  clGetProgramBuildInfo(program_.get(), id, CL_PROGRAM_BUILD_LOG, 0, nullptr, &size);
  std::string log(size, 0);
  clGetProgramBuildInfo(program_.get(), id, CL_PROGRAM_BUILD_LOG, size, log.data(), nullptr);
  throw Error(formatted("'{}' cannot build the program for radiographs (error {}): {}", name_, code,
                        beginning_of(log.c_str())));
}

Kernel Device::kernel(const char* name) const {
  cl_int code = CL_SUCCESS;
  Kernel kernel(clCreateKernel(program_.get(), name, &code));
  check(code, "to prepare a radiograph");
  return kernel;
}

Buffer Device::filled(const void* data, std::size_t bytes) const {
  cl_int code = CL_SUCCESS;
  Buffer buffer(clCreateBuffer(context_.get(), CL_MEM_READ_ONLY | CL_MEM_COPY_HOST_PTR, std::max<std::size_t>(bytes, 1),
                               const_cast<void*>(data), &code));
  check(code, formatted("to copy {} bytes to '{}'", bytes, name_));
  return buffer;
}

Buffer Device::empty(std::size_t bytes) const {
  cl_int code = CL_SUCCESS;
  Buffer buffer(clCreateBuffer(context_.get(), CL_MEM_WRITE_ONLY, std::max<std::size_t>(bytes, 1), nullptr, &code));
  check(code, formatted("to reserve {} bytes on '{}'", bytes, name_));
  return buffer;
}

}  // namespace marrow::opencl
