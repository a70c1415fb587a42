// SPDX-License-Identifier: Apache-2.0
#pragma once
// The CTs that are open: they stay in memory, so that each slice comes at once and all tabs share one copy.
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "marrow/domain/volume.hpp"
#include "marrow/runtime/node/value.hpp"

namespace marrow::workbench {

struct OpenCt {
  std::string name;  ///< of this copy, unique as long as the server runs
  Value value;       ///< of type volume
  float lowest_hu = 0, highest_hu = 0;

  const Volume& volume() const { return value.as<Volume>(); }
  std::uintmax_t bytes() const { return volume().values.size() * sizeof(float); }
};

/// The memory that open CTs may take together: 3 GB, or half of the machine's memory where that is less.
std::uintmax_t most_ct_bytes();

/// All methods may be called from several threads.
class CtMemory {
 public:
  explicit CtMemory(std::uintmax_t most_bytes = most_ct_bytes()) : most_bytes_(most_bytes) {}

  /// `content` says which files with which options it was read from. nullptr if it is not here.
  std::shared_ptr<const OpenCt> by_content(const std::string& content);
  /// Throws Conflict if it is no longer here: the page then opens it again.
  std::shared_ptr<const OpenCt> by_name(const std::string& name);
  /// Keeps it. CTs that were not looked at for the longest time make room. Throws Error if it alone is too large.
  std::shared_ptr<const OpenCt> add(const std::string& content, Value value);
  /// Says that the files of `same` hold what those of `content` hold, because they were copied.
  void add_copy(const std::string& content, const std::string& same);
  /// To be held while a CT is read, so that two tabs do not read the same one twice.
  std::timed_mutex& reading() { return reading_; }
  /// Throws Error if files of this size hold a volume that is too large.
  void check_size(std::uintmax_t file_bytes) const;

 private:
  struct Entry {
    std::vector<std::string> contents;
    std::shared_ptr<const OpenCt> ct;
  };
  std::list<Entry>::iterator find(const std::string& content);
  std::shared_ptr<const OpenCt> used(std::list<Entry>::iterator entry);

  const std::uintmax_t most_bytes_;
  std::mutex mutex_;
  std::timed_mutex reading_;
  std::list<Entry> open_;  ///< the one that was used last comes first
  int count_ = 0;
};

/// {name, size, spacing_mm, origin_mm, direction: rows, lowest_hu, highest_hu, doubts}
nlohmann::json about_ct(const OpenCt& ct);

/// What looks wrong with a volume that is said to be a CT, as sentences for people.
std::vector<std::string> doubts_about(const OpenCt& ct);

/// The samples of one slice across an axis of the grid, as int16 in HU. The lower one of the two other axes runs
/// fastest. Values are rounded, and cut off at the limits of int16.
std::string slice_of(const Volume& volume, int axis, int index);

}  // namespace marrow::workbench
