// SPDX-License-Identifier: Apache-2.0
// What project.opencl does where a device is not as it should be. The functions of OpenCL that are defined here are
// found before those of the library. They pass on, or pretend.
#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>
#include <dlfcn.h>
#include <thread>

#include "tests/harness/node_test.hpp"

namespace marrow::test::opencl_test {

enum class Fault { none, no_platform, little_memory, full, no_compiler };
Fault fault = Fault::none;

template <class Function>
Function* next(const char* name) {
  static void* const library = dlopen("libOpenCL.so.1", RTLD_NOW | RTLD_LOCAL);
  return reinterpret_cast<Function*>(dlsym(library, name));
}

}  // namespace marrow::test::opencl_test

namespace opencl_test = marrow::test::opencl_test;
extern "C" {

cl_int clGetPlatformIDs(cl_uint room, cl_platform_id* platforms, cl_uint* count) {
  if (opencl_test::fault == opencl_test::Fault::no_platform) return -1001;  // CL_PLATFORM_NOT_FOUND_KHR
  return opencl_test::next<decltype(clGetPlatformIDs)>("clGetPlatformIDs")(room, platforms, count);
}

cl_int clGetDeviceInfo(cl_device_id device, cl_device_info what, size_t room, void* value, size_t* size) {
  const cl_int code = opencl_test::next<decltype(clGetDeviceInfo)>("clGetDeviceInfo")(device, what, room, value, size);
  if (opencl_test::fault == opencl_test::Fault::little_memory && what == CL_DEVICE_MAX_MEM_ALLOC_SIZE)
    *static_cast<cl_ulong*>(value) = 1000;
  return code;
}

cl_mem clCreateBuffer(cl_context context, cl_mem_flags flags, size_t bytes, void* data, cl_int* code) {
  if (opencl_test::fault == opencl_test::Fault::full) {
    *code = CL_MEM_OBJECT_ALLOCATION_FAILURE;
    return nullptr;
  }
  return opencl_test::next<decltype(clCreateBuffer)>("clCreateBuffer")(context, flags, bytes, data, code);
}

cl_int clBuildProgram(cl_program program, cl_uint count, const cl_device_id* devices, const char* options,
                      void(CL_CALLBACK* done)(cl_program, void*), void* data) {
  if (opencl_test::fault == opencl_test::Fault::no_compiler) return CL_BUILD_PROGRAM_FAILURE;
  return opencl_test::next<decltype(clBuildProgram)>("clBuildProgram")(program, count, devices, options, done, data);
}

cl_int clGetProgramBuildInfo(cl_program program, cl_device_id device, cl_program_build_info what, size_t room,
                             void* value, size_t* size) {
  if (opencl_test::fault != opencl_test::Fault::no_compiler)
    return opencl_test::next<decltype(clGetProgramBuildInfo)>("clGetProgramBuildInfo")(program, device, what, room,
                                                                                       value, size);
  const char log[] = "line 1: no float3\n\nline 2: no clamp\nline 3: a\nline 4: b\nline 5: never shown\n";
  if (size) *size = sizeof(log);
  if (value) std::memcpy(value, log, sizeof(log));
  return CL_SUCCESS;
}
}

namespace marrow::test::opencl_test {

/// A block of bone in air.
Volume block() {
  Volume volume;
  volume.grid.size = {20, 22, 24};
  volume.grid.spacing_mm = {1, 1.2, 1.5};
  volume.values.assign(volume.grid.count(), -1000);
  for (int z = 5; z < 18; ++z)
    for (int y = 6; y < 16; ++y)
      for (int x = 4; x < 15; ++x) volume.values[volume.grid.offset(x, y, z)] = float(600 + 20 * x - 10 * z);
  return volume;
}

Camera camera() {
  Camera camera = pinhole(400, 64, 64);
  camera.camera_from_world.translation_mm = {-10, -12, 300};
  return camera;
}

struct Made {
  Outputs outputs;
  std::string warnings;
  const RadiographProjector& projector() const { return outputs.at("projector").as<RadiographProjector>(); }
};

Made made(const std::string& node, const Volume& volume, const Options& options = {}) {
  Made result;
  Context::Hooks hooks;
  hooks.log = [&](std::string_view message, LogLevel level) {
    if (level == LogLevel::warning) result.warnings += message;
  };
  result.outputs = call(node, {{"volume", item(volume)}}, options, Context(std::move(hooks)));
  return result;
}

class OpenCl : public testing::Test {
 protected:
  /// Whether there is a device, which all but the first test need.
  void SetUp() override {
    if (made("project.opencl", block()).warnings.find("no device with OpenCL") == 0)
      GTEST_SKIP() << "no device with OpenCL is here";
  }
  void TearDown() override { fault = Fault::none; }
};

struct Trial {
  const char* name;
  Fault fault;
  const char *begins, *ends;
};
void PrintTo(const Trial& trial, std::ostream* stream) { *stream << trial.name; }

class UnusableDevice : public OpenCl, public testing::WithParamInterface<Trial> {};
INSTANTIATE_TEST_SUITE_P(
    , UnusableDevice,
    testing::Values(Trial{"no_platform", Fault::no_platform,
                          "no device with OpenCL is here; a driver for the graphics card, or Debian's package "
                          "pocl-opencl-icd, provides one; so the radiographs are computed as by project.joseph",
                          ""},
                    Trial{"little_memory", Fault::little_memory, "'",
                          "' has no room for the CT: the part that attenuates takes 0 MB, and at most 0 MB can be had "
                          "at once; crop the CT; so the radiographs are computed as by project.joseph"},
                    Trial{"full", Fault::full, "OpenCL failed to copy ",
                          "(its error -4); the device has too little memory: crop the CT, or use project.joseph; so "
                          "the radiographs are computed as by project.joseph"},
                    Trial{"no_compiler", Fault::no_compiler, "'",
                          "' cannot build the program for radiographs (error -11): line 1: no float3 | line 2: no "
                          "clamp | line 3: a | line 4: b; so the radiographs are computed as by project.joseph"}),
    [](const auto& info) { return info.param.name; });

TEST_P(UnusableDevice, GivesJosephsRadiographAndSaysWhy) {
  fault = GetParam().fault;
  const Made one = made("project.opencl", block());
  EXPECT_FRAME(one.warnings, GetParam().begins, GetParam().ends);
  const PixelGrid grid{0, 0, 1, 64, 64};
  const RigidTransform pose{"world", "ct"};
  EXPECT_EQ(one.projector().radiograph(camera(), pose, grid),
            made("project.joseph", block()).projector().radiograph(camera(), pose, grid));
}

TEST_F(OpenCl, FailsWithASentenceIfMemoryRunsOutLater) {
  const Made one = made("project.opencl", block());
  fault = Fault::full;
  EXPECT_HAS(MESSAGE_OF(one.projector().radiograph(camera(), {"world", "ct"}, PixelGrid{0, 0, 1, 64, 64})),
             "the device has too little memory");
  fault = Fault::none;  // and the projector can still be used
  EXPECT_GT(one.projector().radiograph(camera(), {"world", "ct"}, PixelGrid{32, 32, 1, 1, 1}).at(0), 5);
}

TEST_F(OpenCl, ADeviceThatIsNotThereIsRefusedWithThoseThatAre) {
  const std::string told = refusal("project.opencl", {{"volume", item(block())}}, {{"device", "no such"}});
  EXPECT_BEGINS(told, "no device's name contains 'no such'; there are '");
}

TEST_F(OpenCl, OnePixelHasTheValueThatItHasInTheImage) {
  const Made one = made("project.opencl", block()), joseph = made("project.joseph", block());
  const RigidTransform pose{"world", "ct"};
  const float value = one.projector().radiograph(camera(), pose, PixelGrid{30, 33, 1, 1, 1}).at(0);
  EXPECT_NEAR(value, one.projector().radiograph(camera(), pose, PixelGrid{0, 0, 1, 64, 64}).at(33 * 64 + 30), 1e-4);
  EXPECT_NEAR(value, joseph.projector().radiograph(camera(), pose, {{30, 33}}).at(0), 1e-3);
  EXPECT_TRUE(one.projector().radiograph(camera(), pose, PixelGrid{}).empty());
}

/// Radiographs of several sizes, with and without derivatives, are asked for at once and then one by one.
TEST_F(OpenCl, CallsAtTheSameTimeGiveTheSameBytes) {
  const Made one = made("project.opencl", block());
  constexpr int kPoses = 60;
  const auto computed = [&](int i) {
    RigidTransform pose{"world", "ct"};
    pose.translation_mm = {0.1 * i, -0.05 * i, 0.3 * i};
    const PixelGrid grid{double(i % 5), 3, 1 + 0.5 * (i % 3), 20 + i % 7, 30 - i % 4};
    if (i % 3 == 0) return one.projector().radiograph(camera(), pose, {{30, 30}, {31.5f, 28}, {12, 40}});
    if (i % 3 == 1) return one.projector().radiograph(camera(), pose, grid);
    auto expansion = one.projector().expansion(camera(), pose, {}, grid);
    for (const std::vector<float>& slopes : expansion->slopes)
      expansion->values.insert(expansion->values.end(), slopes.begin(), slopes.end());
    return expansion->values;
  };
  std::vector<std::vector<float>> together(kPoses);
  std::vector<std::thread> threads;
  for (int i = 0; i < kPoses; ++i) threads.emplace_back([&, i] { together[std::size_t(i)] = computed(i); });
  for (std::thread& thread : threads) thread.join();
  for (int i = 0; i < kPoses; ++i) EXPECT_EQ(together[std::size_t(i)], computed(i)) << i;
}

}  // namespace marrow::test::opencl_test
