// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "marrow/base/hash.hpp"
#include "marrow/domain/archived.hpp"

namespace MARROW_EXPORT marrow {

/// Specialised by MARROW_VALUE_TYPE for each type that may travel along an edge of a pipeline.
template <class T>
struct ValueType {};

template <class T>
concept Registered = requires {
  ValueType<T>::kId;
};

/// Registers a type as a value. Use at global scope. `id` is the name that pipelines and messages show. Raise `version`
/// whenever the meaning or layout of the type changes. A function (projector, cost, optimizer) has no content: its key
/// is made from its recipe, and it is never stored.
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

/// How the content of a data type is hashed, written and read. The code is in the library that knows the type.
struct Content {
  Digest (*hash)(const void*);
  void (*pack)(const void*, Archive&);
  std::shared_ptr<const void> (*unpack)(Unpacker&);
};

/// The Content of a type. For marrow's own types it is compiled once, in marrow's library (types.hpp), so that plugins
/// do not compile it again.
template <class T>
__attribute__((visibility("default"))) const Content* content_of() {
  static constexpr Content kContent{
      [](const void* data) { return hash_of(*static_cast<const T*>(data)); },
      [](const void* data, Archive& archive) { archive.add(*static_cast<const T*>(data)); },
      [](Unpacker& packed) -> std::shared_ptr<const void> { return std::make_shared<const T>(packed.get<T>()); }};
  return &kContent;
}

/// A type as the graph compares it: by id, version, size and whether it is a function. typeid would be equal for two
/// structs in two plugins that have the same name but different layouts.
struct TypeInfo {
  std::string id;
  int version = 0;
  std::size_t size = 0;
  bool is_function = false;
  const Content* content = nullptr;  ///< for a data type; null if the type is only known from a manifest

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

/// Makes the data of a value when they are first needed: reads them from the store, or calls the node that makes them.
class Source {
 public:
  virtual ~Source() = default;
  /// Returns the same pointer each time. Safe to call from several threads. For a data type, `type` must have its
  /// Content. Throws Error (inside the runtime also MissingInput) if the data cannot be made.
  virtual std::shared_ptr<const void> data(const TypeInfo& type) = 0;
};

/// A value on an edge of the graph: absent, one item, or a list of items along an axis. The items of a list may be
/// lists too. Immutable and cheap to copy.
struct Value {
  TypeInfo type;
  std::shared_ptr<const void> data;  ///< data of one item
  std::shared_ptr<Source> source;    ///< source of one item whose data were not needed yet

  std::string axis;  ///< axis of a list; empty for one item
  std::vector<std::string> names;
  std::vector<Value> items;

  /// Why an absent item could not be made ("node 'edges' failed"). Empty if the item simply does not exist.
  std::string missing;
  /// The item is missing because a node failed that may fail. A node that can do without the item runs as if nothing
  /// were wired.
  bool may_be_missing = false;
  /// Identifies the value: the content hash of data, or the recipe key of a function. Set by the executor.
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
