// SPDX-License-Identifier: Apache-2.0
#pragma once
// Declares a node. Plugin::node() returns this builder. Each plugin compiles its templates, so they hold only what
// depends on the function's type.
#include <array>
#include <cstddef>
#include <initializer_list>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "marrow/runtime/node/node.hpp"
#include "marrow/runtime/node/signature.hpp"

namespace MARROW_EXPORT marrow {

// Attributes of ports and options in a declaration.

/// The axis of a list port. The text must live until the port is declared.
struct Over {
  std::string_view axis;
};
/// A property of an option. The texts must live until the option is declared.
struct Attribute {
  enum class Type { minimum, maximum, unit, choices, required, replaces, beside };
  Type type = Type::required;
  double number = 0;
  std::string_view text = {};
  std::initializer_list<std::string_view> names = {};
};

/// The axis along which a list port runs.
inline Over over(std::string_view axis) { return {axis}; }
/// The unit of an option whose name does not end in one. The endings _mm, _deg, _rad, _px, _s, _hu, _kev and _percent
/// already give the unit.
inline Attribute unit(std::string_view text) { return {.type = Attribute::Type::unit, .text = text}; }
inline Attribute at_least(double value) { return {.type = Attribute::Type::minimum, .number = value}; }
inline Attribute at_most(double value) { return {.type = Attribute::Type::maximum, .number = value}; }
inline Attribute one_of(std::initializer_list<std::string_view> names) {
  return {.type = Attribute::Type::choices, .names = names};
}
/// A pipeline must give this option.
inline Attribute required() { return {}; }
/// This option replaces options of the nodes whose functions reach this node: those with these names. Their own values
/// then have no effect here. "input.option" means only nodes behind that input. An empty list or a 0 replaces nothing.
/// If a pipeline gives both, `marrow check` prints a note.
inline Attribute replaces(std::initializer_list<std::string_view> names) {
  return {.type = Attribute::Type::replaces, .names = names};
}

/// Beside the file that this option of type path names lie files that belong to it. They have its name, but these
/// endings: ".onnx". They count in the key of the result by their content, and the node may open them.
inline Attribute beside(std::initializer_list<std::string_view> endings) {
  return {.type = Attribute::Type::beside, .names = endings};
}

/// The number of option `low` must not be above that of option `high`.
inline RelationInfo not_above(std::string low, std::string high) {
  return {RelationType::not_above, {std::move(low), std::move(high)}};
}
/// The number of option `low` must be less than that of option `high`.
inline RelationInfo below(std::string low, std::string high) {
  return {RelationType::below, {std::move(low), std::move(high)}};
}
/// These lists must have the same length.
inline RelationInfo same_length(std::vector<std::string> lists) {
  return {RelationType::same_length, std::move(lists)};
}
/// The first list must be empty or have as many items as the second.
inline RelationInfo as_many_or_none(std::string list, std::string like) {
  return {RelationType::as_many_or_none, {std::move(list), std::move(like)}};
}
/// Exactly one of these must be given. A name is an option, which is given if it is not empty, or an input, written as
/// "in.camera".
inline RelationInfo exactly_one(std::vector<std::string> names) {
  return {RelationType::exactly_one, std::move(names)};
}
/// At least one of these must be given. Names are written as for exactly_one(). A single name is an option that must
/// not be empty.
inline RelationInfo at_least_one(std::vector<std::string> names) {
  return {RelationType::at_least_one, std::move(names)};
}
/// No item of this list may occur twice.
inline RelationInfo distinct(std::string list) { return {RelationType::distinct, {std::move(list)}}; }
namespace detail {

/// An output as a part of what a node's function returns.
struct ReturnedPart {
  TypeInfo type;
  bool is_list = false;
  bool is_optional = false;
  std::ptrdiff_t offset = 0;  ///< in bytes from the beginning of the returned object
  Value (*value)(const TypeInfo& type, const std::shared_ptr<const void>& part, std::string_view axis) = nullptr;
  std::string axis = {};
};

/// Checks the declaration itself: names are well formed, texts are given, defaults are within their range, relations
/// fit. Adds what is wrong to `faults`. It does not check the contract of the kind.
void check_declaration(NodeDefinition& node);

/// The part of a NodeBuilder that does not depend on the function's type.
class NodeDeclaration {
 public:
  using Function = void (*)();
  /// Calls `function` with inputs and options, and returns what it returned.
  using Call = std::shared_ptr<const void> (*)(Function function, const std::vector<Value>& inputs, const void* options,
                                               Context& context);

  NodeDeclaration(NodeDefinition& node, Function function, Call call, std::shared_ptr<void> (*make_options)());
  NodeDeclaration(const NodeDeclaration&) = delete;
  NodeDeclaration& operator=(const NodeDeclaration&) = delete;
  /// Checks the declaration.
  ~NodeDeclaration();

  NodeInfo& info() { return node_.info; }
  std::size_t outputs() const;
  void add_input(const TypeInfo& type, bool is_list, bool is_optional);
  void name_input(std::string_view name, std::string_view help, const Over& axis);
  void add_output(std::string_view name, std::string_view help, const Over& axis, ReturnedPart part);
  void output_fault(std::string_view name, const char* fault);
  void name_figures(std::initializer_list<std::string_view> names);
  /// An option whose member is `offset` bytes from the beginning of the options struct. It has the unit that the suffix
  /// of its name gives ("mm" for "sigma_mm").
  void add_option(std::string_view name, std::string_view help, const MemberType& type, std::ptrdiff_t offset,
                  const void* default_value, std::initializer_list<Attribute> attributes);

 private:
  NodeDefinition& node_;
  std::shared_ptr<std::vector<ReturnedPart>> parts_;
  std::size_t named_inputs_ = 0;
};

inline std::ptrdiff_t bytes_between(const void* begin, const void* part) {
  return static_cast<const std::byte*>(part) - static_cast<const std::byte*>(begin);
}

}  // namespace detail

template <class R, class... Args>
class NodeBuilder {
 public:
  using Options = std::conditional_t<std::is_void_v<typename detail::OptionsOf<Args...>::type>, detail::NoOptions,
                                     typename detail::OptionsOf<Args...>::type>;

  NodeBuilder(NodeDefinition& node, R (*function)(Args...))
      : declaration_(
            node, reinterpret_cast<detail::NodeDeclaration::Function>(function),
            [](detail::NodeDeclaration::Function called, const std::vector<Value>& inputs, const void* options,
               Context& context) {
              return call(reinterpret_cast<R (*)(Args...)>(called), inputs, options, context,
                          std::index_sequence_for<Args...>{});
            },
            []() -> std::shared_ptr<void> { return std::make_shared<Options>(); }) {
    (add_port<Args>(), ...);
  }

  NodeBuilder& summary(std::string_view text) {
    declaration_.info().summary = text;
    return *this;
  }
  /// The node has this trait of its kind.
  NodeBuilder& trait(std::string_view name) {
    declaration_.info().traits.emplace_back(name);
    return *this;
  }
  /// A condition on options: not_above, below, same_length, as_many_or_none, exactly_one, at_least_one or distinct. A
  /// pipeline that breaks it is refused with the line of the option, so the node need not check it.
  NodeBuilder& relation(RelationInfo relation) {
    declaration_.info().relations.push_back(std::move(relation));
    return *this;
  }
  /// The node draws from Context::seed(), so its results depend on the run's seed.
  NodeBuilder& random() {
    declaration_.info().random = true;
    return *this;
  }

  NodeBuilder& in(std::string_view name, std::string_view help, const Over& axis = {}) {
    declaration_.name_input(name, help, axis);
    return *this;
  }

  /// Names the returned value, or the next item of a returned tuple.
  NodeBuilder& out(std::string_view name, std::string_view help, const Over& axis = {}) {
    if constexpr (detail::IsTuple<R>::value) {
      add_tuple_output(declaration_.outputs(), name, help, axis, std::make_index_sequence<std::tuple_size_v<R>>{});
    } else if constexpr (Registered<typename detail::Returned<R>::Item>) {
      add_output<R>(name, help, axis, 0);
    } else {
      declaration_.output_fault(name, "the returned type is not registered with MARROW_VALUE_TYPE");
    }
    return *this;
  }
  /// Names a member of the returned struct.
  template <class M, class S>
  NodeBuilder& out(std::string_view name, M S::*member, std::string_view help, const Over& axis = {}) {
    static_assert(std::is_base_of_v<S, R>, "the output is not a member of the struct that the node returns");
    add_output<M>(name, help, axis, detail::bytes_between(&place(), &(place().*member)));
    return *this;
  }

  /// The names that the figures of the last output can have; * stands for any text, as in "*.median_px". A node that
  /// makes another figure fails. A pipeline that uses any other name is refused before anything runs.
  NodeBuilder& figures(std::initializer_list<std::string_view> names) {
    declaration_.name_figures(names);
    return *this;
  }

  /// An option, bound to a member of the options struct. Its default is the value of the member in a
  /// default-constructed struct. Attributes: at_least, at_most, one_of, unit, required, replaces, beside.
  template <class M, class O, class... Attributes>
  NodeBuilder& option(std::string_view name, M O::*member, std::string_view help, const Attributes&... attributes) {
    static_assert(std::is_base_of_v<O, Options>, "the option is not a member of the node's options struct");
    const M& value = defaults_.*member;
    declaration_.add_option(name, help, *detail::member_type<M>(), detail::bytes_between(&defaults_, &value), &value,
                            {attributes...});
    return *this;
  }

 private:
  /// A place for an R at which none is constructed. It only serves to compute the offsets of members.
  static const R& place() {
    alignas(R) static const std::byte bytes[sizeof(R)]{};
    return *reinterpret_cast<const R*>(bytes);
  }

  template <class A>
  void add_port() {
    using Argument = detail::Argument<A>;
    if constexpr (Argument::kPort) {
      constexpr detail::Role role = Argument::role();
      constexpr bool is_optional = role == detail::Role::optional_input || role == detail::Role::optional_list;
      if constexpr (role == detail::Role::list || role == detail::Role::optional_list)
        declaration_.add_input(TypeInfo::of<typename Argument::Plain::value_type>(), true, is_optional);
      else
        declaration_.add_input(TypeInfo::of<typename Argument::Plain>(), false, is_optional);
    }
  }

  template <class M>
  void add_output(std::string_view name, std::string_view help, const Over& axis, std::ptrdiff_t offset) {
    using Returned = detail::Returned<M>;
    declaration_.add_output(
        name, help, axis,
        {TypeInfo::of<typename Returned::Item>(), Returned::kList, Returned::kOptional, offset, Returned::value});
  }

  template <std::size_t... I>
  void add_tuple_output(std::size_t index, std::string_view name, std::string_view help, const Over& axis,
                        std::index_sequence<I...>) {
    const bool found = ((I == index && (add_output<std::tuple_element_t<I, R>>(
                                            name, help, axis, detail::bytes_between(&place(), &std::get<I>(place()))),
                                        true)) ||
                        ...);
    if (!found) declaration_.output_fault(name, "the returned tuple has fewer items");
  }

  /// Index of the port that argument `I` stands for.
  template <std::size_t I>
  static constexpr std::size_t port_index() {
    constexpr std::array<bool, sizeof...(Args) + 1> is_port{detail::Argument<Args>::kPort..., false};
    std::size_t count = 0;
    for (std::size_t i = 0; i < I; ++i) count += is_port[i];
    return count;
  }

  /// Gives one argument to the function. If the argument is a list, keeps the list alive during the call.
  template <class A>
  struct Holder {
    using Argument = detail::Argument<A>;
    using Plain = typename Argument::Plain;
    static constexpr detail::Role kRole = Argument::role();
    Holder(const std::vector<Value>& inputs, std::size_t port, const void* options, Context& context)
        : options_(options), context_(context) {
      if constexpr (Argument::kPort) value_ = &inputs[port];
      if constexpr (detail::IsList<Plain>::value) list_ = value_->template as_list<typename Plain::value_type>();
    }
    A get() {
      if constexpr (kRole == detail::Role::context)
        return context_;
      else if constexpr (kRole == detail::Role::options)
        return *static_cast<const Plain*>(options_);
      else if constexpr (kRole == detail::Role::list)
        return list_;
      else if constexpr (kRole == detail::Role::optional_list)
        return value_->is_absent() ? nullptr : &list_;
      else if constexpr (kRole == detail::Role::optional_input)
        return static_cast<const Plain*>(value_->data.get());
      else
        return *static_cast<const Plain*>(value_->data.get());
    }
    const void* options_;
    Context& context_;
    const Value* value_ = nullptr;
    std::conditional_t<detail::IsList<Plain>::value, Plain, char> list_{};
  };

  template <std::size_t... I>
  static std::shared_ptr<const void> call(R (*function)(Args...), [[maybe_unused]] const std::vector<Value>& inputs,
                                          [[maybe_unused]] const void* options, [[maybe_unused]] Context& context,
                                          std::index_sequence<I...>) {
    return std::make_shared<const R>(function(Holder<Args>(inputs, port_index<I>(), options, context).get()...));
  }

  detail::NodeDeclaration declaration_;
  const Options defaults_{};
};

}  // namespace marrow
