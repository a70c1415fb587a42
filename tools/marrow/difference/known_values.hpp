// SPDX-License-Identifier: Apache-2.0
#pragma once
// The values that runs came to, as far as they are still to be had.
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "difference/amounts.hpp"
#include "marrow/runtime/catalogue.hpp"
#include "marrow/runtime/store.hpp"

namespace marrow::cli {

/// One value of one run, and where it may be found.
struct ValueOfRun {
  std::string key;
  std::filesystem::path file;  ///< below outputs/; empty where the run wrote none
  std::string uses;            ///< the node that made it
};

class KnownValues {
 public:
  /// Keeps a value of a run that was made in this process, with all its items.
  void add(const Value& value);
  /// By how much two values differ. Says so where it comes from files, and where nothing but the keys is left.
  Amount amount(const ValueOfRun& before, const ValueOfRun& now);

 private:
  std::optional<Value> find(const std::string& key);
  std::optional<std::string> packed(const Value& value, const std::string& uses);
  std::optional<Amount> amount_of_values(const Value& before, const Value& now, const ValueOfRun& made_before,
                                         const ValueOfRun& made_now);

  std::map<std::string, Value> held_;
  Store store_;
  std::optional<std::map<std::string, Digest>> entries_;  ///< of the store, by the keys of what they hold
  std::unique_ptr<Catalogue> catalogue_;                  ///< made when a value of a plugin's own type is met
};

}  // namespace marrow::cli
