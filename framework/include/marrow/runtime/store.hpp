// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <atomic>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "marrow/runtime/value.hpp"

namespace marrow {

/// What a result was made from: all that its key depends on, in words, so that two keys can be compared.
struct Provenance {
  std::string node;  ///< kind.name
  Digest build_id;   ///< of its library
  std::map<std::string, std::string> options;
  std::map<std::string, Digest> inputs;  ///< port -> key
  bool random = false;
  std::uint64_t seed = 0;             ///< counts only where random
  double seconds = 0;                 ///< that the call took
  std::vector<std::string> warnings;  ///< that the node gave; repeated when the result is read back

  static constexpr auto fields() {
    return std::make_tuple(&Provenance::node, &Provenance::build_id, &Provenance::options, &Provenance::inputs,
                           &Provenance::random, &Provenance::seed, &Provenance::seconds, &Provenance::warnings);
  }
};

/// A result read back from the store. The outputs know their keys; their data are read when they are first needed.
struct StoredResult {
  Provenance provenance;
  std::vector<Value> outputs;
};

/// Thrown by the source of a stored value whose bytes are gone or are not those that were written.
class DamagedEntry : public Error {
 public:
  using Error::Error;
};

/// Results of nodes on disk, by key: one file a result. Several processes of one user may use one folder at once. A
/// file is written under a temporary name and then renamed, so an entry is whole or absent, whenever the process is
/// killed and however full the disk is. What it was written for and the content hash of each value are checked when it
/// is read; so nothing waits until it is on the disk itself: after a power failure, an entry that is not whole counts
/// as absent. Safe to use from several threads.
///
/// A store is a folder of this user that marrow made, or found empty, and marked with a file `marrow-store`. Any other
/// folder is never written to, nor removed from. Only its owner can look into it: results are patients' data.
class Store {
 public:
  explicit Store(std::filesystem::path folder = default_folder());
  /// MARROW_CACHE, or marrow/store in XDG_CACHE_HOME, ~/.cache or .cache in the home that the system knows of the user.
  /// Empty where there is none of these: then nothing is kept.
  static std::filesystem::path default_folder();
  const std::filesystem::path& folder() const { return folder_; }

  /// Why the folder is not used: it holds other things, belongs to another user, cannot be written to. Empty for a
  /// store, and where one can be made. The members below then find nothing and keep nothing.
  std::string fault() const;
  /// Makes the store where there is none yet, as save() and all others that write do. Returns why it cannot be used.
  std::string prepare() const;

  /// Nothing where there is no entry, or none that is whole and was written for this key; such a one is removed.
  std::optional<StoredResult> find(const Digest& key) const;
  /// Keeps what can be kept: data, absent items and lists of them. Returns why it was not kept, or an empty text: a
  /// full disk must not end a run.
  std::string save(const Digest& key, const std::vector<Value>& outputs, const Provenance& provenance) const;
  /// The right to make one result. Others that want the same one wait until the holder has kept it, or is gone.
  class Claim {
   public:
    explicit Claim(int descriptor = -1) : descriptor_(descriptor) {}
    Claim(Claim&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
    /// Gives it back, also where a process that was forked meanwhile still has the file open.
    ~Claim();

   private:
    int descriptor_;
  };
  /// Waits for it; look the result up again then. Comes back empty-handed where the folder cannot be written or when
  /// `cancelled` says so. Held by the thread's process: a process that is killed gives it back. `on_wait(true)`
  /// is called when waiting begins and again after five seconds of it, `on_wait(false)` when it has ended, however it
  /// did.
  Claim claim(const Digest& key, const std::atomic<bool>* cancelled,
              const std::function<void(bool waits)>& on_wait = {}) const;
  /// Removes an entry that turned out to be damaged.
  void drop(const Digest& key) const;
  /// Folders of simulated cases, named by their keys; made by whoever needs one, as KEY.tmp-PROCESS-NUMBER and then
  /// renamed, and collected like entries.
  std::filesystem::path cases() const { return folder_ / "cases"; }

  /// What a node of a pipeline last came to, for saying why it runs again. `place` names pipeline, node and item.
  struct Last {
    Digest key;
    Provenance provenance;
    static constexpr auto fields() { return std::make_tuple(&Last::key, &Last::provenance); }
  };
  void remember(const std::string& place, const Last& last) const;
  std::optional<Last> last(const std::string& place) const;

  struct Entry {
    Digest key;
    std::uint64_t bytes = 0;
    std::filesystem::file_time_type used;
    Provenance provenance;        ///< empty for an entry that is not whole
    std::vector<Digest> outputs;  ///< content hashes
  };
  /// All entries, the least recently used first. Throws Error where a folder of the store cannot be read.
  std::vector<Entry> entries() const;
  struct Freed {
    std::size_t entries = 0;
    std::uint64_t bytes = 0;
    std::string fault;  ///< of the first that could not be removed
  };
  /// Removes the least recently used entries, and simulated cases that no comparison is using, until the rest is at
  /// most `keep_bytes`, and what killed processes left behind. Touches only what bears a name that the store itself
  /// gives, and follows no link.
  Freed collect(std::uint64_t keep_bytes) const;
  /// The same with MARROW_CACHE_GB (20 where it is not set), once a day at most: after a run, so that the store does
  /// not fill the disk. Returns what is wrong with MARROW_CACHE_GB, in which case nothing is removed, or what could not
  /// be removed.
  std::string tidy() const;

 private:
  bool is_there() const;
  std::filesystem::path file_of(const Digest& key) const;

  std::filesystem::path folder_;
  mutable std::atomic<bool> is_checked_{false};
};

/// The key that a text of 32 hexadecimal digits names; nothing for any other text.
std::optional<Digest> digest_of_hex(const std::string& text);

/// The size that a number of gigabytes from 0 to 1000000 means; nothing for any other text.
std::optional<std::uint64_t> bytes_of_gigabytes(std::string_view text);

}  // namespace marrow
