// SPDX-License-Identifier: Apache-2.0
#pragma once
// Derives the ports of a node from the arguments and the return type of its function.
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <type_traits>

#include "marrow/domain/list.hpp"
#include "marrow/runtime/context.hpp"
#include "marrow/runtime/value.hpp"

namespace marrow::detail {

template <class T>
struct IsList : std::false_type {};
template <class T>
struct IsList<List<T>> : std::true_type {};
template <class T>
struct IsTuple : std::false_type {};
template <class... T>
struct IsTuple<std::tuple<T...>> : std::true_type {};
template <class T>
struct OptionalItem {
  using type = void;
};
template <class T>
struct OptionalItem<std::optional<T>> {
  using type = T;
};
template <class T>
struct SharedItem {
  using type = void;
};
template <class T>
struct SharedItem<std::shared_ptr<const T>> {
  using type = T;
};

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

/// The item type of a returned type: the item of a list, of an optional or of a shared pointer, else the type itself.
template <class M>
struct Returned {
  using Optional = typename OptionalItem<M>::type;
  using Shared = typename SharedItem<M>::type;
  static constexpr bool kOptional = !std::is_void_v<Optional>;
  static constexpr bool kShared = !std::is_void_v<Shared>;
  static constexpr bool kList = IsList<M>::value;
  static auto item() {
    if constexpr (kOptional)
      return std::type_identity<Optional>{};
    else if constexpr (kShared)
      return std::type_identity<Shared>{};
    else if constexpr (kList)
      return std::type_identity<typename M::value_type>{};
    else
      return std::type_identity<M>{};
  }
  using Item = typename decltype(item())::type;

  /// The value of `member`, which is a part of `whole`. The value keeps its data alive.
  template <class Whole>
  static Value value(const std::shared_ptr<const Whole>& whole, const M& member, const std::string& axis) {
    Value none;
    none.type = TypeInfo::of<Item>();
    if constexpr (kList) {
      return Value::of(member, axis);
    } else if constexpr (kOptional) {
      return member ? Value::of<Item>(std::shared_ptr<const Item>(whole, &*member)) : none;
    } else if constexpr (kShared) {
      return member ? Value::of<Item>(member) : none;
    } else {
      return Value::of<Item>(std::shared_ptr<const Item>(whole, &member));
    }
  }
};

}  // namespace marrow::detail
