// SPDX-License-Identifier: Apache-2.0
#pragma once
// Derives the ports of a node from the arguments and the return type of its function.
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "marrow/base/export.hpp"
#include "marrow/domain/list.hpp"
#include "marrow/runtime/node/context.hpp"
#include "marrow/runtime/node/value.hpp"

namespace MARROW_EXPORT marrow {
namespace detail {

template <class T>
struct IsList : std::false_type {};
template <class T>
struct IsList<List<T>> : std::true_type {};
template <class T>
struct IsTuple : std::false_type {};
template <class... T>
struct IsTuple<std::tuple<T...>> : std::true_type {};

enum class Role { input, optional_input, list, optional_list, context, options };

/// What an argument of a node's function stands for.
template <class A>
struct Argument {
  using Plain = std::remove_cv_t<std::remove_pointer_t<std::remove_reference_t<A>>>;
  static constexpr bool kPointer = std::is_pointer_v<std::remove_reference_t<A>>;
  static constexpr Role role() {
    if constexpr (std::is_same_v<Plain, Context>)
      return Role::context;
    else if constexpr (IsList<Plain>::value)
      return kPointer ? Role::optional_list : Role::list;
    else if constexpr (Registered<Plain>)
      return kPointer ? Role::optional_input : Role::input;
    else
      return Role::options;
  }
  static constexpr bool kPort = role() != Role::context && role() != Role::options;
};

template <class... Args>
struct OptionsOf {
  using type = void;
};
template <class A, class... Rest>
struct OptionsOf<A, Rest...> {
  using type = std::conditional_t<Argument<A>::role() == Role::options, typename Argument<A>::Plain,
                                  typename OptionsOf<Rest...>::type>;
};

struct NoOptions {};

/// A value that holds one item; absent if `item` is null.
Value value_of_item(const TypeInfo& type, std::shared_ptr<const void> item);
/// A value that holds a list; absent if it is empty.
Value value_of_list(const TypeInfo& type, const std::vector<std::string>& names,
                    std::vector<std::shared_ptr<const void>> items, std::string_view axis);

/// The item type of a returned type: the item of a list, of an optional or of a shared pointer, else the type itself.
template <class M>
struct ItemOf : std::type_identity<M> {};
template <class T>
struct ItemOf<List<T>> : std::type_identity<T> {};
template <class T>
struct ItemOf<std::optional<T>> : std::type_identity<T> {};
template <class T>
struct ItemOf<std::shared_ptr<const T>> : std::type_identity<T> {};

/// What a node's function returns, or a member of it.
template <class M>
struct Returned {
  using Item = typename ItemOf<M>::type;
  static constexpr bool kList = IsList<M>::value;
  static constexpr bool kOptional = std::is_same_v<M, std::optional<Item>>;
  static constexpr bool kShared = std::is_same_v<M, std::shared_ptr<const Item>>;

  /// The value of a member of type M in the object that a node returned. The value keeps the object alive.
  static Value value(const TypeInfo& type, const std::shared_ptr<const void>& member, std::string_view axis) {
    const M& returned = *static_cast<const M*>(member.get());
    if constexpr (kList) {
      std::vector<std::shared_ptr<const void>> items;
      for (std::size_t i = 0; i < returned.size(); ++i) items.push_back(returned.shared(i));
      return value_of_list(type, returned.names(), std::move(items), axis);
    } else if constexpr (kOptional) {
      return value_of_item(type, {member, returned ? &*returned : nullptr});
    } else if constexpr (kShared) {
      return value_of_item(type, returned);
    } else {
      return value_of_item(type, member);
    }
  }
};

}  // namespace detail
}  // namespace marrow
