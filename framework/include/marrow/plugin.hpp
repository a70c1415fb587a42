// SPDX-License-Identifier: Apache-2.0
#pragma once
// All that a plugin author includes. A node is a plain function, declared once:
//
//   struct Options { double low = 50; };
//   marrow::EdgeMap find(const marrow::View& view, const Options& options) { ... }
//
//   MARROW_PLUGIN(plugin) {
//     plugin.node("edges.mine", find)
//         .summary("One line that says what it does")
//         .in("view", "X-ray view")
//         .out("edges", "edge pixels")
//         .option("low", &Options::low, "lower threshold", marrow::at_least(0), marrow::unit("%"));
//   }
//
// Ports come from the signature, and .in() calls follow the order of its arguments:
//   const T&          a required input           const List<T>&   a whole list (say which axis: over("view"))
//   const T*          an optional input          const List<T>*   an optional list
//   Context&          seed, cancel, progress, log
//   const Options&    the one struct that is no registered value type: the options
// Returned: a value, std::optional of one, List<T>, std::shared_ptr<const Interface> for a function, a std::tuple, or a
// struct whose members are named with .out("port", &Struct::member, "help").
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <deque>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "marrow/runtime/abi.hpp"
#include "marrow/runtime/context.hpp"
#include "marrow/runtime/node.hpp"
#include "marrow/runtime/types.hpp"

namespace marrow {

// Attributes of ports and options.
struct Over {
  std::string axis;
};
struct Unit {
  std::string text;
};
struct Minimum {
  double value;
};
struct Maximum {
  double value;
};
struct Choices {
  std::vector<std::string> names;
};
struct Required {};

/// The axis along which a list port runs.
inline Over over(std::string axis) { return {std::move(axis)}; }
/// The unit of an option whose name does not end in one (_mm, _deg, _rad, _px and _s are read off the name).
inline Unit unit(std::string text) { return {std::move(text)}; }
inline Minimum at_least(double value) { return {value}; }
inline Maximum at_most(double value) { return {value}; }
inline Choices one_of(std::vector<std::string> names) { return {std::move(names)}; }
/// A pipeline must give this option.
inline Required required() { return {}; }

namespace detail {

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

/// The item type of something returned: of a list, an optional, a shared function, or itself.
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

  /// The value in a member of `whole`, which it keeps alive.
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

template <class M>
OptionValue to_option_value(const M& member) {
  if constexpr (std::is_same_v<M, bool>)
    return member;
  else if constexpr (std::is_integral_v<M>)
    return std::int64_t(member);
  else if constexpr (std::is_floating_point_v<M>)
    return double(member);
  else if constexpr (std::is_same_v<M, std::string>)
    return member;
  else if constexpr (std::is_same_v<M, std::filesystem::path>)
    return member.string();
  else if constexpr (std::is_same_v<M, std::vector<std::string>>)
    return member;
  else if constexpr (std::is_same_v<M, std::vector<std::filesystem::path>>) {
    std::vector<std::string> texts;
    for (const auto& path : member) texts.push_back(path.string());
    return texts;
  } else {  // a list of numbers: std::vector<double>, std::array<double, N>, Eigen::Vector3d
    return std::vector<double>(member.begin(), member.end());
  }
}

template <class M>
void from_option_value(M& member, const OptionValue& value) {
  if constexpr (std::is_same_v<M, bool>)
    member = std::get<bool>(value);
  else if constexpr (std::is_integral_v<M>)
    member = M(std::get<std::int64_t>(value));
  else if constexpr (std::is_floating_point_v<M>)
    member = M(std::get<double>(value));
  else if constexpr (std::is_same_v<M, std::string> || std::is_same_v<M, std::filesystem::path>)
    member = std::get<std::string>(value);
  else if constexpr (std::is_same_v<M, std::vector<std::string>>)
    member = std::get<std::vector<std::string>>(value);
  else if constexpr (std::is_same_v<M, std::vector<std::filesystem::path>>) {
    member.clear();
    for (const auto& text : std::get<std::vector<std::string>>(value)) member.emplace_back(text);
  } else {
    const auto& numbers = std::get<std::vector<double>>(value);
    if constexpr (std::is_same_v<M, std::vector<double>>)
      member = numbers;
    else
      for (std::size_t i = 0; i < numbers.size(); ++i) member[i] = numbers[i];
  }
}

template <class M>
constexpr OptionType option_type() {
  if constexpr (std::is_same_v<M, bool>)
    return OptionType::boolean;
  else if constexpr (std::is_integral_v<M>)
    return OptionType::integer;
  else if constexpr (std::is_floating_point_v<M>)
    return OptionType::number;
  else if constexpr (std::is_same_v<M, std::string>)
    return OptionType::text;
  else if constexpr (std::is_same_v<M, std::filesystem::path>)
    return OptionType::path;
  else if constexpr (std::is_same_v<M, std::vector<std::string>>)
    return OptionType::texts;
  else if constexpr (std::is_same_v<M, std::vector<std::filesystem::path>>)
    return OptionType::paths;
  else
    return OptionType::numbers;
}

/// The number of numbers that a fixed-size list option takes; 0 for std::vector.
template <class M>
constexpr std::size_t option_length() {
  if constexpr (requires { std::tuple_size<M>::value; })
    return std::tuple_size<M>::value;
  else if constexpr (requires { M::SizeAtCompileTime; })
    return std::size_t(M::SizeAtCompileTime);
  else
    return 0;
}

/// A whole number that the member cannot hold is out of the option's range.
template <class M>
void narrow_range(OptionInfo& info) {
  using Limits = std::numeric_limits<M>;
  constexpr bool kWhole = std::is_integral_v<M> && !std::is_same_v<M, bool>;
  if constexpr (kWhole && (sizeof(M) < sizeof(std::int64_t) || std::is_unsigned_v<M>))
    info.minimum = std::max(info.minimum.value_or(double(Limits::min())), double(Limits::min()));
  if constexpr (kWhole && sizeof(M) < sizeof(std::int64_t))
    info.maximum = std::min(info.maximum.value_or(double(Limits::max())), double(Limits::max()));
}

/// Unit by the suffix of a name: "sigma_mm" is in mm.
std::string unit_of_name(const std::string& name);
/// Checks the declaration itself (defaults within their range, names well formed, kind's contract) and fills `faults`.
void check_declaration(NodeDefinition& node);

}  // namespace detail

template <class R, class... Args>
class NodeBuilder {
 public:
  using Options = std::conditional_t<std::is_void_v<typename detail::OptionsOf<Args...>::type>, detail::NoOptions,
                                     typename detail::OptionsOf<Args...>::type>;

  NodeBuilder(NodeDefinition& node, R (*function)(Args...)) : node_(node) {
    (add_port<Args>(), ...);
    ports_ = node_.info.inputs.size();
    node_.make_options = [] { return std::make_shared<Options>(); };
    node_.call = [function, outputs = outputs_](const std::vector<Value>& inputs, const void* options,
                                                Context& context) {
      return call(function, *outputs, inputs, options, context, std::index_sequence_for<Args...>{});
    };
  }
  NodeBuilder(const NodeBuilder&) = delete;
  ~NodeBuilder() {
    if (named_inputs_ != ports_)
      node_.faults.push_back("the function takes " + std::to_string(ports_) + " inputs, but .in() names " +
                             std::to_string(named_inputs_));
    detail::check_declaration(node_);
  }

  NodeBuilder& summary(std::string text) {
    node_.info.summary = std::move(text);
    return *this;
  }
  /// The node draws from Context::seed(); its results then depend on the run's seed.
  NodeBuilder& random() {
    node_.info.random = true;
    return *this;
  }

  NodeBuilder& in(std::string name, std::string help, Over axis = {}) {
    if (named_inputs_ < ports_) {
      PortInfo& port = node_.info.inputs[named_inputs_];
      if (axis.axis.empty() != port.axis.empty()) {
        std::string fault = "input '" + name;
        node_.faults.push_back(
            fault.append(axis.axis.empty() ? "': a List needs over(\"axis\")" : "': over() is for List inputs"));
      }
      port.name = std::move(name);
      port.help = std::move(help);
      port.axis = std::move(axis.axis);
    }
    ++named_inputs_;
    return *this;
  }

  /// The value returned, or the next item of a returned tuple.
  NodeBuilder& out(std::string name, std::string help, Over axis = {}) {
    const std::size_t index = outputs_->size();
    if constexpr (detail::IsTuple<R>::value) {
      add_tuple_output(index, std::move(name), std::move(help), std::move(axis),
                       std::make_index_sequence<std::tuple_size_v<R>>{});
    } else if constexpr (Registered<typename detail::Returned<R>::Item>) {
      add_output<R>(std::move(name), std::move(help), axis, [axis = axis.axis](const std::shared_ptr<const R>& whole) {
        return detail::Returned<R>::value(whole, *whole, axis);
      });
    } else {
      node_.faults.push_back("output '" + name + "': the returned type is not registered with MARROW_VALUE_TYPE");
    }
    return *this;
  }
  /// A member of the struct returned.
  template <class M, class S>
  NodeBuilder& out(std::string name, M S::*member, std::string help, Over axis = {}) {
    static_assert(std::is_base_of_v<S, R>, "the output is not a member of the struct that the node returns");
    return add_output<M>(std::move(name), std::move(help), axis,
                         [member, axis = axis.axis](const std::shared_ptr<const R>& whole) {
                           return detail::Returned<M>::value(whole, (*whole).*member, axis);
                         });
  }

  /// An option, bound to a member of the options struct whose default-made value is the default. Attributes: at_least,
  /// at_most, one_of, unit, required.
  template <class M, class O, class... Attributes>
  NodeBuilder& option(std::string name, M O::*member, std::string help, Attributes... attributes) {
    static_assert(std::is_base_of_v<O, Options>, "the option is not a member of the node's options struct");
    OptionInfo info;
    info.name = name;
    info.help = std::move(help);
    info.unit = detail::unit_of_name(name);
    info.type = detail::option_type<M>();
    info.length = detail::option_length<M>();
    info.default_value = detail::to_option_value<M>(Options{}.*member);
    (apply(info, attributes), ...);
    detail::narrow_range<M>(info);
    node_.info.options.push_back(std::move(info));
    node_.set_option.push_back([member](void* options, const OptionValue& value) {
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
      PortInfo port;
      constexpr detail::Role role = Argument::role();
      port.optional = role == detail::Role::optional_input || role == detail::Role::optional_list;
      if constexpr (role == detail::Role::list || role == detail::Role::optional_list) {
        port.type = TypeInfo::of<typename Argument::Plain::value_type>();
        port.axis.assign(1, '?');  // named by over()
      } else {
        port.type = TypeInfo::of<typename Argument::Plain>();
      }
      node_.info.inputs.push_back(std::move(port));
    }
  }

  template <class M>
  NodeBuilder& add_output(std::string name, std::string help, const Over& axis, Output output) {
    using Returned = detail::Returned<M>;
    if (axis.axis.empty() == Returned::kList)
      node_.faults.push_back("output '" + name +
                             "': " + (Returned::kList ? "a List needs over(\"axis\")" : "over() is for a List"));
    node_.info.outputs.push_back({std::move(name), std::move(help), TypeInfo::of<typename Returned::Item>(),
                                  Returned::kOptional || Returned::kList, axis.axis});
    outputs_->push_back(std::move(output));
    return *this;
  }

  template <std::size_t... I>
  void add_tuple_output(std::size_t index, std::string name, std::string help, Over axis, std::index_sequence<I...>) {
    const bool found = ((I == index && (add_output<std::tuple_element_t<I, R>>(
                                            name, help, axis,
                                            [axis = axis.axis](const std::shared_ptr<const R>& whole) {
                                              return detail::Returned<std::tuple_element_t<I, R>>::value(
                                                  whole, std::get<I>(*whole), axis);
                                            }),
                                        true)) ||
                        ...);
    if (!found) node_.faults.push_back("output '" + name + "': the returned tuple has fewer items");
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

  /// Keeps a list built from a value alive during the call.
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

  NodeDefinition& node_;
  std::shared_ptr<std::vector<Output>> outputs_ = std::make_shared<std::vector<Output>>();
  std::size_t ports_ = 0, named_inputs_ = 0;
};

/// What a plugin library registers.
class Plugin {
 public:
  template <class R, class... Args>
  NodeBuilder<R, Args...> node(std::string name, R (*function)(Args...)) {
    nodes.emplace_back();
    nodes.back().info.name = std::move(name);
    return NodeBuilder<R, Args...>(nodes.back(), function);
  }
  /// How values of type T are written when they are outputs of a pipeline: `function` gets the full path, which ends in
  /// `extension` (an empty extension means a folder). It throws Error when it cannot.
  template <Registered T>
  void writer(std::string extension, void (*function)(const T&, const std::string& path), std::string help) {
    writers.push_back(
        {{TypeInfo::of<T>(), std::move(extension), std::move(help)},
         [function](const void* value, const std::string& path) { function(*static_cast<const T*>(value), path); }});
  }

  std::deque<NodeDefinition> nodes;
  std::vector<WriterDefinition> writers;
};

/// Opens the one function that makes a shared library a plugin.
#define MARROW_PLUGIN(plugin)                                                                            \
  static void marrow_register_nodes(::marrow::Plugin& plugin);                                           \
  extern "C" __attribute__((visibility("default"))) const ::marrow::PluginEntry* marrow_plugin_entry() { \
    static constexpr ::marrow::PluginEntry kEntry{{'m', 'a', 'r', 'r', 'o', 'w', '!', 0},                \
                                                  sizeof(::marrow::PluginEntry),                         \
                                                  MARROW_API_MAJOR,                                      \
                                                  MARROW_API_MINOR,                                      \
                                                  ::marrow::abi_stamp(),                                 \
                                                  &marrow_register_nodes};                               \
    return &kEntry;                                                                                      \
  }                                                                                                      \
  static void marrow_register_nodes(::marrow::Plugin& plugin)

}  // namespace marrow
