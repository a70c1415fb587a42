// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a plugin library states about itself before it registers anything. A plugin that was built with other compiler
// flags than the program can silently corrupt memory: Eigen's alignment, for example, changes with -mavx. So the stamps
// of both must agree.
#include <Eigen/Core>
#include <cstdint>
#include <opencv2/core/version.hpp>

#include "marrow/base/export.hpp"
#include "marrow/runtime/node/headers_digest.hpp"

#ifndef MARROW_API_MAJOR
#define MARROW_API_MAJOR 1  ///< raised when plugins must be changed
#define MARROW_API_MINOR 0  ///< raised when something is added
#endif

namespace MARROW_EXPORT marrow {

class Plugin;

struct AbiStamp {
  char compiler[32];
  std::int64_t cxx_standard;
  std::int32_t cxx11_abi;
  std::int32_t glibcxx_debug;  ///< -D_GLIBCXX_DEBUG changes the layout of every container
  std::int32_t sanitizers;     ///< bit 0 address, bit 1 thread
  std::int32_t fast_math;      ///< -ffast-math: NaN is not seen, and small numbers become 0 in the whole process
  std::int32_t eigen_max_align;
  std::int32_t eigen_version;
  std::int32_t opencv_version;
  std::uint64_t headers;  ///< digest of all headers that plugins of this version are built with
};

/// What a plugin exports, through the C function marrow_plugin_entry().
struct PluginEntry {
  char magic[8];
  std::uint32_t size;
  std::uint32_t api_major, api_minor;
  AbiStamp stamp;
  void (*register_nodes)(Plugin&);
};

#ifdef __SANITIZE_ADDRESS__
#define MARROW_SANITIZE_ADDRESS 1
#else
#define MARROW_SANITIZE_ADDRESS 0
#endif
#ifdef __SANITIZE_THREAD__
#define MARROW_SANITIZE_THREAD 2
#else
#define MARROW_SANITIZE_THREAD 0
#endif
#ifdef __FAST_MATH__
#define MARROW_FAST_MATH 1
#else
#define MARROW_FAST_MATH 0
#endif
#ifdef _GLIBCXX_DEBUG
#define MARROW_GLIBCXX_DEBUG 1
#else
#define MARROW_GLIBCXX_DEBUG 0
#endif
#define MARROW_TEXT_(x) #x
#define MARROW_TEXT(x) MARROW_TEXT_(x)
#if defined(__clang__)
#define MARROW_COMPILER "clang " MARROW_TEXT(__clang_major__)
#else
#define MARROW_COMPILER "gcc " MARROW_TEXT(__GNUC__)
#endif

/// The stamp of the code that is being compiled.
constexpr AbiStamp abi_stamp() {
  return {MARROW_COMPILER,
          __cplusplus,
          _GLIBCXX_USE_CXX11_ABI,
          MARROW_GLIBCXX_DEBUG,
          MARROW_SANITIZE_ADDRESS | MARROW_SANITIZE_THREAD,
          MARROW_FAST_MATH,
          EIGEN_MAX_ALIGN_BYTES,
          EIGEN_WORLD_VERSION * 10000 + EIGEN_MAJOR_VERSION * 100 + EIGEN_MINOR_VERSION,
          CV_VERSION_MAJOR * 10000 + CV_VERSION_MINOR * 100,
          MARROW_HEADERS_DIGEST};
}

}  // namespace marrow
