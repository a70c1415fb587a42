// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "marrow/base/export.hpp"

namespace MARROW_EXPORT marrow {

/// Named items along one axis ("view", "fragment", ...). The port declares the axis; a list only knows the names along
/// it. Items are shared and immutable, so a list is cheap to copy and safe to read from several threads.
template <class T>
class List {
 public:
  using value_type = T;

  void add(std::string name, T item) { add_shared(std::move(name), std::make_shared<const T>(std::move(item))); }
  void add_shared(std::string name, std::shared_ptr<const T> item) {
    names_.push_back(std::move(name));
    items_.push_back(std::move(item));
  }

  std::size_t size() const { return items_.size(); }
  bool empty() const { return items_.empty(); }
  const T& operator[](std::size_t index) const { return *items_[index]; }
  const std::string& name(std::size_t index) const { return names_[index]; }
  const std::vector<std::string>& names() const { return names_; }
  const std::shared_ptr<const T>& shared(std::size_t index) const { return items_[index]; }

  /// The item of that name, or nullptr.
  const T* find(const std::string& name) const {
    for (std::size_t i = 0; i < names_.size(); ++i)
      if (names_[i] == name) return items_[i].get();
    return nullptr;
  }

  /// The same names with copies of the items, after change(copy, index) of each.
  template <class Change>
  List changed(const Change& change) const {
    List all;
    for (std::size_t i = 0; i < size(); ++i) {
      T item = *items_[i];
      change(item, i);
      all.add(names_[i], std::move(item));
    }
    return all;
  }

  class const_iterator {
   public:
    explicit const_iterator(const std::shared_ptr<const T>* at) : at_(at) {}
    const T& operator*() const { return **at_; }
    const_iterator& operator++() {
      ++at_;
      return *this;
    }
    bool operator!=(const const_iterator& other) const { return at_ != other.at_; }

   private:
    const std::shared_ptr<const T>* at_;
  };
  const_iterator begin() const { return const_iterator(items_.data()); }
  const_iterator end() const { return const_iterator(items_.data() + items_.size()); }

 private:
  std::vector<std::string> names_;
  std::vector<std::shared_ptr<const T>> items_;
};

}  // namespace marrow
