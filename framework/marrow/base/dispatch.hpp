// SPDX-License-Identifier: Apache-2.0
#pragma once

/// A function with this mark is also compiled for newer processors (AVX2). The best version is chosen when the library
/// is loaded. All versions give the same bits, because none contracts products and sums. For hot loops over arrays.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define MARROW_DISPATCH __attribute__((target_clones("avx2", "default")))
#else
#define MARROW_DISPATCH
#endif
