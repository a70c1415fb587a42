// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "marrow/runtime/hash.hpp"

namespace marrow {

/// Specialised by MARROW_VALUE_TYPE for each type that may travel along an edge of a pipeline.
template <class T>
struct ValueType {};

template <class T>
concept Registered = requires {
  ValueType<T>::kId;
};

/// Registers a type as a value. Use at global scope. `id` is the name that pipelines and messages show; raise `version`
/// whenever the meaning or layout changes. A function (projector, cost, optimizer) has no content, is keyed by its
/// recipe and never stored.
#define MARROW_VALUE_TYPE(Type, id, version)   \
  template <>                                  \
  struct marrow::ValueType<Type> {             \
    static constexpr const char* kId = id;     \
    static constexpr int kVersion = version;   \
    static constexpr bool kIsFunction = false; \
  };
#define MARROW_FUNCTION_TYPE(Type, id, version) \
  template <>                                   \
  struct marrow::ValueType<Type> {              \
    static constexpr const char* kId = id;      \
    static constexpr int kVersion = version;    \
    static constexpr bool kIsFunction = true;   \
  };

/// How the content of a data type is hashed, written and read. The code lies in the library that knows the type.
struct Content {
  Digest (*hash)(const void*);
  void (*pack)(const void*, Archive&);
  std::shared_ptr<const void> (*unpack)(Unpacker&);
};

/// The content of a type. Defined once for each of marrow's own types, in its library (types.hpp), so that not every
/// plugin compiles them all again.
template <class T>
__attribute__((visibility("default"))) const Content* content_of() {
  static constexpr Content kContent{
      [](const void* data) { return hash_of(*static_cast<const T*>(data)); },
      [](const void* data, Archive& archive) { archive.add(*static_cast<const T*>(data)); },
      [](Unpacker& packed) -> std::shared_ptr<const void> { return std::make_shared<const T>(packed.get<T>()); }};
  return &kContent;
}

/// What the graph compares: id, version and size. (Never typeid: two plugins with a same-named struct of different
/// layout would pass for each other.)
struct TypeInfo {
  std::string id;
  int version = 0;
  std::size_t size = 0;
  bool is_function = false;
  const Content* content = nullptr;  ///< of a data type; null where the type is only known from a manifest

  bool operator==(const TypeInfo& other) const {
    return id == other.id && version == other.version && size == other.size && is_function == other.is_function;
  }
  template <Registered T>
  static TypeInfo of() {
    TypeInfo type{ValueType<T>::kId, ValueType<T>::kVersion, sizeof(T), ValueType<T>::kIsFunction};
    if constexpr (!ValueType<T>::kIsFunction) type.content = content_of<T>();
    return type;
  }
};

/// Makes the data of a value when it is first needed: reads it from the store, or calls the node that makes it.
class Source {
 public:
  virtual ~Source() = default;
  /// The same pointer each time; safe to call from several threads. `type` must know the content of a data type. Throws
  /// Error when it cannot be made.
  virtual std::shared_ptr<const void> data(const TypeInfo& type) = 0;
};

/// A value on an edge: absent, one item, or items along an axis (each of which may again have an axis). Immutable and
/// cheap to copy.
struct Value {
  TypeInfo type;
  std::shared_ptr<const void> data;  ///< of one item
  std::shared_ptr<Source> source;    ///< of one item whose data are not here yet

  std::string axis;  ///< of a list; empty for one item
  std::vector<std::string> names;
  std::vector<Value> items;

  /// Of an absent item: why it could not be made ("node 'edges' failed"). Empty where there simply is none.
  std::string missing;
  /// What identifies the value: the content hash of data, the recipe key of a function. Set by the executor.
  Digest key;

  bool is_list() const { return !axis.empty(); }
  bool is_absent() const { return !data && !source && !is_list(); }

  template <Registered T>
  static Value of(std::shared_ptr<const T> item) {
    Value value;
    value.type = TypeInfo::of<T>();
    value.data = std::move(item);
    return value;
  }
  template <Registered T>
  static Value of(const List<T>& list, const std::string& axis) {
    Value value;
    value.type = TypeInfo::of<T>();
    if (list.empty()) return value;  // an empty list is an absent value
    value.axis = axis;
    value.names = list.names();
    for (std::size_t i = 0; i < list.size(); ++i) value.items.push_back(of<T>(list.shared(i)));
    return value;
  }
  template <Registered T>
  const T& as() const {
    return *static_cast<const T*>(data ? data.get() : source->data(TypeInfo::of<T>()).get());
  }
  template <Registered T>
  List<T> as_list() const {
    List<T> list;
    for (std::size_t i = 0; i < items.size(); ++i)
      list.add_shared(names[i], std::static_pointer_cast<const T>(
                                    items[i].data ? items[i].data : items[i].source->data(TypeInfo::of<T>())));
    return list;
  }
};

}  // namespace marrow
