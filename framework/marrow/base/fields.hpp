// SPDX-License-Identifier: Apache-2.0
#pragma once
// The members of a value type, by which it is hashed, stored and compared. Their number is checked, because a member
// that the list forgets would be neither hashed nor stored.
#include <cstddef>
#include <type_traits>

#include "marrow/base/export.hpp"

namespace MARROW_EXPORT marrow {

/// The members of a value type, in the order in which they are hashed and stored:
///
///   struct Edge { double u_px = 0, v_px = 0; using fields = Fields<&Edge::u_px, &Edge::v_px>; };
template <auto... Members>
struct Fields {};

namespace detail {

template <class T>
concept HasFields = requires {
  typename T::fields;
};

/// Compiles only if T has exactly `Count` members, 16 at most. If the compiler says that a structured binding has too
/// few or too many names, then T::fields leaves out a member or lists one twice.
template <std::size_t Count, class T>
void has_as_many_members([[maybe_unused]] const T& value) {
  static_assert(Count >= 1 && Count <= 16, "fields lists 1 to 16 members; make a struct of some that belong together");
#define MARROW_BINDS(count, ...)       \
  if constexpr (Count == count) {      \
    const auto& [__VA_ARGS__] = value; \
    static_cast<void>(a);              \
  }
  MARROW_BINDS(1, a)
  MARROW_BINDS(2, a, b)
  MARROW_BINDS(3, a, b, c)
  MARROW_BINDS(4, a, b, c, d)
  MARROW_BINDS(5, a, b, c, d, e)
  MARROW_BINDS(6, a, b, c, d, e, f)
  MARROW_BINDS(7, a, b, c, d, e, f, g)
  MARROW_BINDS(8, a, b, c, d, e, f, g, h)
  MARROW_BINDS(9, a, b, c, d, e, f, g, h, i)
  MARROW_BINDS(10, a, b, c, d, e, f, g, h, i, j)
  MARROW_BINDS(11, a, b, c, d, e, f, g, h, i, j, k)
  MARROW_BINDS(12, a, b, c, d, e, f, g, h, i, j, k, l)
  MARROW_BINDS(13, a, b, c, d, e, f, g, h, i, j, k, l, m)
  MARROW_BINDS(14, a, b, c, d, e, f, g, h, i, j, k, l, m, n)
  MARROW_BINDS(15, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o)
  MARROW_BINDS(16, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p)
#undef MARROW_BINDS
}

template <class T, class Function, auto... Members>
void for_each_field(Fields<Members...>, const Function& function) {
  if constexpr (std::is_aggregate_v<T>) {
    [[maybe_unused]] constexpr auto check = &has_as_many_members<sizeof...(Members), T>;
  }
  (function(Members), ...);
}

/// Calls function(pointer to member) for each member of T, which `fields` must list completely. The members of a type
/// with constructors or private members cannot be counted, so its list is not checked.
template <HasFields T, class Function>
void for_each_field(const Function& function) {
  for_each_field<T>(typename T::fields(), function);
}

}  // namespace detail
}  // namespace marrow
