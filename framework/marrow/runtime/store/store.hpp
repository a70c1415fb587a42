// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <atomic>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "marrow/base/descriptor.hpp"
#include "marrow/runtime/node/value.hpp"

namespace MARROW_EXPORT marrow {

/// What a result was made from, in readable form, so that two keys can be compared. It has everything that the key
/// depends on, except the machine.
struct Provenance {
  std::string node;  ///< kind.name
  Digest build_id;   ///< build id of its library
  std::map<std::string, std::string> options;
  std::map<std::string, Digest> inputs;  ///< the key of each input, by port
  bool random = false;
  std::uint64_t seed = 0;             ///< part of the key only if random
  double seconds = 0;                 ///< time that the call took
  std::vector<std::string> warnings;  ///< warnings of the node; repeated when the result is read back

  using fields = Fields<&Provenance::node, &Provenance::build_id, &Provenance::options, &Provenance::inputs,
                        &Provenance::random, &Provenance::seed, &Provenance::seconds, &Provenance::warnings>;
};

/// A result read back from the store. The outputs know their keys; their data are read when they are first needed.
struct StoredResult {
  Provenance provenance;
  std::vector<Value> outputs;
};

/// Thrown by the source of a stored value if the bytes are gone or are not those that were written.
class DamagedEntry : public Error {
 public:
  using Error::Error;
};

class SharedStore;

/// Results of nodes on disk, one file per result, found by their keys. Several processes of one user may use one folder
/// at once. A file is written under a temporary name and then renamed, so an entry is whole or absent, even if the
/// process is killed or the disk is full. Reading checks that the entry belongs to the key, and checks the content hash
/// of each value. So writing does not wait for the disk: if a power failure leaves an incomplete entry, it counts as
/// absent. Safe to use from several threads.
///
/// A store is a folder of this user that marrow made, or found empty, and marked with a file `marrow-store`. marrow
/// never writes to any other folder and removes nothing from it. Only the owner can look into a store, because results
/// are patients' data.
///
/// Behind it there may be a shared store: a folder that several hosts and users see. What is not in the store is looked
/// up there and copied from there.
class Store {
 public:
  /// The store in default_folder(). If MARROW_SHARED_CACHE is set, the shared store in that folder is behind it.
  Store();
  explicit Store(const std::filesystem::path& folder);
  Store(const std::filesystem::path& folder, std::shared_ptr<SharedStore> shared);
  /// MARROW_CACHE if it is set. Else marrow/store in XDG_CACHE_HOME, in ~/.cache, or in .cache of the home folder that
  /// the system knows for the user. Empty if there is none of these: then nothing is kept.
  static std::filesystem::path default_folder();
  const std::filesystem::path& folder() const { return folder_; }
  SharedStore* shared() const { return shared_.get(); }  ///< nullptr if there is none

  /// Why the folder cannot be used: it holds other things, belongs to another user or cannot be written to. Empty if it
  /// is a store or can become one. If there is a fault, the functions below find nothing and keep nothing.
  std::string fault() const;
  /// Makes the store if it does not exist yet. save() and the other functions that write do this too. Returns why the
  /// store cannot be used, or an empty text.
  std::string prepare() const;

  /// Reads the result of a key. Returns nothing if there is no entry. An entry that is not whole, or was written for
  /// another key, is removed and counts as absent. If the shared store has the result, it is copied into this store, or
  /// read there if it is large.
  std::optional<StoredResult> find(const Digest& key) const;
  /// `here`: only in this store. `anywhere`: as find(key). `anew`: the same, but does not rely on what the file system
  /// remembers about the shared folder. It takes longer, and finds a result that another host has only just made.
  enum class Where { here, anywhere, anew };
  std::optional<StoredResult> find(const Digest& key, Where where) const;
  /// Keeps a result that consists of data, absent items and lists of them. Returns why it was not kept, or an empty
  /// text. It does not throw, because a full disk must not end a run.
  std::string save(const Digest& key, const std::vector<Value>& outputs, const Provenance& provenance) const;
  /// The right to make one result. Others that want the same result wait until the holder has kept it or has ended.
  class Claim {
   public:
    Claim() = default;
    explicit Claim(Descriptor descriptor) : descriptor_(std::move(descriptor)) {}
    Claim(Claim&&) noexcept = default;
    /// Gives the claim back, even if a process that was forked in the meantime still has the file open.
    ~Claim();

   private:
    Descriptor descriptor_;
  };
  /// Waits for the claim. Look the result up again afterwards: its holder may have made it. Returns an empty claim if
  /// the folder cannot be written to or `cancelled` becomes true. The claim belongs to this process: if the process is
  /// killed, it is given back. on_wait(true) is called after 0.1 s of waiting and again after 5 s. If it was called,
  /// on_wait(false) is called at the end of the wait, however it ends.
  Claim claim(const Digest& key, const std::atomic<bool>* cancelled,
              const std::function<void(bool waits)>& on_wait = {}) const;
  /// Removes an entry that turned out to be damaged.
  void drop(const Digest& key) const;
  /// The folder of the simulated cases. Each case is a folder named by its key. A process that needs a case makes it as
  /// KEY.tmp-PROCESS-NUMBER and then renames it. Cases are collected like entries.
  std::filesystem::path cases() const { return folder_ / "cases"; }

  /// The last result of a call. It is used to say why the node runs again.
  struct Last {
    Digest key;
    Provenance provenance;
    using fields = Fields<&Last::key, &Last::provenance>;
  };
  using LastResults = std::map<std::string, Last>;  ///< by the node and its item
  /// Notes the last results of a run, or of one pass of a body. `place` names the pipeline and the pass. What is known
  /// of other calls there stays.
  void remember(const std::string& place, const LastResults& results) const;
  LastResults last(const std::string& place) const;

  struct Entry {
    Digest key;
    std::uint64_t bytes = 0;
    std::filesystem::file_time_type used;
    Provenance provenance;        ///< empty for an entry that is not whole
    std::vector<Digest> outputs;  ///< content hashes
  };
  /// All entries, the least recently used first. Throws Error if a folder of the store cannot be read.
  std::vector<Entry> entries() const;
  struct Freed {
    std::size_t entries = 0;
    std::uint64_t bytes = 0;
    std::string fault;  ///< why something could not be removed
  };
  /// Removes the least recently used entries and simulated cases until the rest has at most `keep_bytes`. Cases that a
  /// comparison is using stay. Also removes what killed processes left behind. Touches only files and folders with
  /// names that the store itself gives, and follows no links.
  Freed collect(std::uint64_t keep_bytes) const;
  /// Calls collect() with the limit MARROW_CACHE_GB (20 if it is not set), but at most once a minute. It is called
  /// after a run and during a comparison, so that the store does not fill the disk. Stops when `cancelled` becomes
  /// true. Returns what could not be removed. If MARROW_CACHE_GB is wrong, returns why and removes nothing.
  std::string tidy(const std::atomic<bool>* cancelled = nullptr) const;

 private:
  bool is_there() const;
  std::optional<StoredResult> find_here(const Digest& key) const;

  std::filesystem::path folder_;
  std::shared_ptr<SharedStore> shared_;
  mutable std::atomic<bool> is_checked_{false};
};

/// The number of bytes for a text with a number of gigabytes from 0 to 1000000; nothing for any other text.
std::optional<std::uint64_t> bytes_of_gigabytes(std::string_view text);

}  // namespace marrow
