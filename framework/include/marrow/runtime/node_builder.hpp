// SPDX-License-Identifier: Apache-2.0
#pragma once
// Declares a node. Plugin::node() returns this builder.
#include <array>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "marrow/runtime/attributes.hpp"
#include "marrow/runtime/node.hpp"
#include "marrow/runtime/option_values.hpp"
#include "marrow/runtime/signature.hpp"

namespace marrow {
namespace detail {

/// The part of a NodeBuilder that does not depend on the function's type. It is compiled once, not in each plugin.
class NodeDeclaration {
 public:
  explicit NodeDeclaration(NodeDefinition& node) : node_(node) {}
  NodeDeclaration(const NodeDeclaration&) = delete;
  /// Checks the declaration itself (names are well formed, texts are given, defaults are within their range, relations
  /// fit) and fills `faults`. It does not check the contract of the kind.
  ~NodeDeclaration();

  NodeInfo& info() { return node_.info; }
  void add_input(const TypeInfo& type, bool is_list, bool is_optional);
  void name_input(std::string name, std::string help, Over axis);
  void add_output(std::string name, std::string help, const TypeInfo& type, const Over& axis, bool is_list,
                  bool is_optional);
  /// An option with the unit that the suffix of its name gives ("mm" for "sigma_mm").
  static OptionInfo option(std::string name, std::string help, OptionType type, std::size_t length,
                           OptionValue default_value);
  void add_option(OptionInfo info, std::function<void(void* options, const OptionValue&)> set);
  void output_fault(const std::string& name, const char* fault);

 private:
  NodeDefinition& node_;
  std::size_t named_inputs_ = 0;
};

}  // namespace detail

template <class R, class... Args>
class NodeBuilder {
 public:
  using Options = std::conditional_t<std::is_void_v<typename detail::OptionsOf<Args...>::type>, detail::NoOptions,
                                     typename detail::OptionsOf<Args...>::type>;

  NodeBuilder(NodeDefinition& node, R (*function)(Args...)) : declaration_(node) {
    (add_port<Args>(), ...);
    node.make_options = [] { return std::make_shared<Options>(); };
    node.call = [function, outputs = outputs_](const std::vector<Value>& inputs, const void* options,
                                               Context& context) {
      return call(function, *outputs, inputs, options, context, std::index_sequence_for<Args...>{});
    };
  }

  NodeBuilder& summary(std::string text) {
    declaration_.info().summary = std::move(text);
    return *this;
  }
  /// The node has this trait of its kind.
  NodeBuilder& trait(std::string name) {
    declaration_.info().traits.push_back(std::move(name));
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

  NodeBuilder& in(std::string name, std::string help, Over axis = {}) {
    declaration_.name_input(std::move(name), std::move(help), std::move(axis));
    return *this;
  }

  /// Names the returned value, or the next item of a returned tuple.
  NodeBuilder& out(const std::string& name, const std::string& help, const Over& axis = {}) {
    const std::size_t index = outputs_->size();
    if constexpr (detail::IsTuple<R>::value) {
      add_tuple_output(index, name, help, axis, std::make_index_sequence<std::tuple_size_v<R>>{});
    } else if constexpr (Registered<typename detail::Returned<R>::Item>) {
      add_output<R>(name, help, axis, [axis = axis.axis](const std::shared_ptr<const R>& whole) {
        return detail::Returned<R>::value(whole, *whole, axis);
      });
    } else {
      declaration_.output_fault(name, "the returned type is not registered with MARROW_VALUE_TYPE");
    }
    return *this;
  }
  /// Names a member of the returned struct.
  template <class M, class S>
  NodeBuilder& out(const std::string& name, M S::*member, const std::string& help, const Over& axis = {}) {
    static_assert(std::is_base_of_v<S, R>, "the output is not a member of the struct that the node returns");
    return add_output<M>(name, help, axis, [member, axis = axis.axis](const std::shared_ptr<const R>& whole) {
      return detail::Returned<M>::value(whole, (*whole).*member, axis);
    });
  }

  /// An option, bound to a member of the options struct. Its default is the value of the member in a
  /// default-constructed struct. Attributes: at_least, at_most, one_of, unit, required.
  template <class M, class O, class... Attributes>
  NodeBuilder& option(const std::string& name, M O::*member, const std::string& help, const Attributes&... attributes) {
    static_assert(std::is_base_of_v<O, Options>, "the option is not a member of the node's options struct");
    OptionInfo info = detail::NodeDeclaration::option(name, help, detail::option_type<M>(), detail::option_length<M>(),
                                                      detail::to_option_value<M>(Options{}.*member));
    (apply(info, attributes), ...);
    detail::narrow_range<M>(info);
    declaration_.add_option(std::move(info), [member](void* options, const OptionValue& value) {
      detail::from_option_value<M>(static_cast<Options*>(options)->*member, value);
    });
    return *this;
  }

 private:
  using Output = std::function<Value(const std::shared_ptr<const R>&)>;

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
  NodeBuilder& add_output(const std::string& name, const std::string& help, const Over& axis, Output output) {
    using Returned = detail::Returned<M>;
    declaration_.add_output(name, help, TypeInfo::of<typename Returned::Item>(), axis, Returned::kList,
                            Returned::kOptional);
    outputs_->push_back(std::move(output));
    return *this;
  }

  template <std::size_t... I>
  void add_tuple_output(std::size_t index, const std::string& name, const std::string& help, const Over& axis,
                        std::index_sequence<I...>) {
    const bool found = ((I == index && (add_output<std::tuple_element_t<I, R>>(
                                            name, help, axis,
                                            [axis = axis.axis](const std::shared_ptr<const R>& whole) {
                                              return detail::Returned<std::tuple_element_t<I, R>>::value(
                                                  whole, std::get<I>(*whole), axis);
                                            }),
                                        true)) ||
                        ...);
    if (!found) declaration_.output_fault(name, "the returned tuple has fewer items");
  }

  static void apply(OptionInfo& info, const Minimum& minimum) { info.minimum = minimum.value; }
  static void apply(OptionInfo& info, const Maximum& maximum) { info.maximum = maximum.value; }
  static void apply(OptionInfo& info, const Unit& unit) { info.unit = unit.text; }
  static void apply(OptionInfo& info, const Choices& choices) { info.choices = choices.names; }
  static void apply(OptionInfo& info, const Required&) { info.required = true; }

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
  static std::vector<Value> call(R (*function)(Args...), const std::vector<Output>& outputs,
                                 const std::vector<Value>& inputs, [[maybe_unused]] const void* options,
                                 Context& context, std::index_sequence<I...>) {
    std::tuple<Holder<Args>...> holders{Holder<Args>(inputs, port_index<I>(), options, context)...};
    const auto whole = std::make_shared<const R>(function(std::get<I>(holders).get()...));
    std::vector<Value> values;
    for (const Output& output : outputs) values.push_back(output(whole));
    return values;
  }

  detail::NodeDeclaration declaration_;
  std::shared_ptr<std::vector<Output>> outputs_ = std::make_shared<std::vector<Output>>();
};

}  // namespace marrow
