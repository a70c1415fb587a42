// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the libraries of the framework export: what public headers declare. All else is hidden, so that no other code
// can come to depend on it. Plugins see no mark: what they compile of these headers stays their own.
#ifdef MARROW_BUILDS_FRAMEWORK
#define MARROW_EXPORT [[gnu::visibility("default")]]
#define MARROW_EXPORT_INSTANCE __attribute__((visibility("default")))  ///< of a template, for types of other libraries
#else
#define MARROW_EXPORT
#define MARROW_EXPORT_INSTANCE
#endif
// What a private header declares and marrow's own tests call: exported only from builds that have the tests.
#if defined(MARROW_BUILDS_FRAMEWORK) && defined(MARROW_HAS_TESTS)
#define MARROW_EXPORT_TO_TESTS [[gnu::visibility("default")]]
#else
#define MARROW_EXPORT_TO_TESTS
#endif

/// A function with this mark is also compiled for newer processors (AVX2). The best version is chosen when the library
/// is loaded. All versions give the same bits, because none contracts products and sums. For hot loops over arrays.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define MARROW_DISPATCH __attribute__((target_clones("avx2", "default")))
#else
#define MARROW_DISPATCH
#endif
