// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/run/keys.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "marrow/base/machine.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/base/temporary_folder.hpp"
#include "marrow/runtime/pipeline/named_files.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"
#include "marrow/runtime/process/program.hpp"
#include "marrow/runtime/run/node_calls.hpp"
#include "marrow/runtime/store/digest_memory.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;

/// Flushes what was written through memory maps to the file, so that the next such write changes the file's time.
void write_back(const fs::path& file) {
  struct stat status {};
  if (stat(file.c_str(), &status) != 0 || !S_ISREG(status.st_mode)) return;
  const Descriptor descriptor(open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY));
  if (!descriptor.is_open()) return;  // whoever reads the file says why
  sync_file_range(descriptor, 0, 0, SYNC_FILE_RANGE_WAIT_BEFORE | SYNC_FILE_RANGE_WRITE | SYNC_FILE_RANGE_WAIT_AFTER);
}

Digest digest_once(const fs::path& file) {
  struct Known {
    FileState state;
    Digest digest;
  };
  static std::mutex mutex;
  static std::map<fs::path, Known> known;
  const std::optional<FileState> state = state_of(file);
  if (state) {
    const std::scoped_lock lock(mutex);
    const auto found = known.find(file);
    if (found != known.end() && found->second.state == *state) return found->second.digest;
  }
  write_back(file);
  const bool settled = state && is_settled(file, *state);
  const auto read = [&] { return file_digest(file); };
  const Digest digest = settled ? digest_in_state(file, *state, read) : read();
  if (settled && state_of(file) == state) {
    const std::scoped_lock lock(mutex);
    known[file] = {*state, digest};
  }
  return digest;
}

constexpr double kVersionLimit_s = 120;  // a program in Python may load large libraries first

std::string asked(const std::vector<std::string>& command) {
  const TemporaryFolder folder(new_temporary_folder("version"));
  const ProgramCall call{command, folder.path(), kVersionLimit_s, 0, {}};
  const ProgramEnd end = run_program(call);
  if (const std::string fault = failure_of_program(call, end); !fault.empty()) throw Error("version_command: " + fault);
  const std::size_t last = end.printed.find_last_not_of(" \t\r\n");
  if (last == end.printed.npos)
    throw Error("version_command: the program " + in_quotes(command[0]) +
                " printed nothing; name a command that prints the program's version");
  return end.printed.substr(0, last + 1);
}

}  // namespace

PathContent content_of(const std::string& path) {
  PathContent content;
  Hasher hasher;
  const std::vector<NamedFile> files = files_named_by(path);
  const bool is_itself = files.size() == 1 && files[0].name == ".";
  std::error_code error;
  const bool is_folder = !is_itself && fs::is_directory(path, error);
  content.is_there = is_itself || is_folder;
  // The kind distinguishes a file from a folder that holds only this file. The number of files separates what one path
  // names from what the next one names.
  hasher.add(std::string(is_itself ? "file" : is_folder ? "folder" : "absent"));
  hasher.add(std::uint64_t(files.size()));
  for (const NamedFile& file : files) {
    // The name may decide what is made of the content: how it is read, or how an item is called.
    hasher.add(is_itself ? fs::path(path).filename().string() : file.name);
    const Digest digest = file.is_there ? digest_once(file.file) : Digest{};
    hasher.add(digest);
    content.files[fs::weakly_canonical(file.file, error)] = digest;
  }
  content.digest = hasher.digest();
  return content;
}

Digest recipe_of(const PipelineNode& node, const std::vector<Value>& inputs, Contents* contents) {
  Hasher hasher;
  hasher.add(node.info.name);
  for (std::size_t i = 0; i < node.options.size(); ++i) {
    const OptionInfo& info = node.info.options[i];
    hasher.add(info.name);
    if (info.type == OptionType::path || info.type == OptionType::paths) {
      const std::vector<std::string> paths = paths_of(node, i);
      hasher.add(std::uint64_t(paths.size()));
      for (const std::string& path : paths) {
        PathContent content = content_of(path);
        hasher.add(content.digest);
        if (contents && !path.empty()) contents->insert_or_assign(path, std::move(content));
      }
    } else {
      std::visit([&](const auto& value) { hasher.add(value); }, node.options[i]);
      if (asks_for_version(info)) hasher.add(version_printed(std::get<std::vector<std::string>>(node.options[i])));
    }
  }
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    hasher.add(node.info.inputs[i].name);
    hasher.add(key_of(inputs[i]));
  }
  return hasher.digest();
}

void write_back_files(const PipelineNode& node) {
  for (const std::string& path : paths_of(node))
    for (const NamedFile& file : files_named_by(path))
      if (file.is_there) write_back(file.file);
}

Digest states_of_files(const PipelineNode& node) {
  Hasher hasher;
  for (const std::string& path : paths_of(node))
    for (const NamedFile& file : files_named_by(path)) {
      hasher.add(file.name);
      state_of(file.file).value_or(FileState{}).add_to(hasher);
    }
  return hasher.digest();
}

Digest result_key(const Digest& recipe, const Digest& build_id, bool random, std::uint64_t seed) {
  Hasher hasher;
  hasher.add(recipe);
  hasher.add(build_id);
  hasher.add(machine_digest());
  if (random) hasher.add(seed);
  return hasher.digest();
}

Digest path_digest(const fs::path& path) { return content_of(path.string()).digest; }

Digest function_key(const Digest& result, std::size_t output) {
  Hasher hasher;
  hasher.add(result);
  hasher.add(std::uint64_t(output));
  return hasher.digest();
}

std::string text_of(const OptionValue& value, OptionType type, const Contents& contents) {
  const auto text_of_file = [&](const std::string& path) {
    const auto known = contents.find(path);
    const Digest digest = known == contents.end() ? path_digest(path) : known->second.digest;
    return formatted("{} (content {})", path, digest.hex().substr(0, 8));
  };
  const auto text_of_one = [&](const auto& one) {
    using T = std::decay_t<decltype(one)>;
    if constexpr (std::is_same_v<T, double>)
      return short_number(one, 17);
    else if constexpr (std::is_same_v<T, std::string>)
      return type == OptionType::path || type == OptionType::paths ? text_of_file(one) : one;
    else
      return formatted("{}", one);
  };
  return std::visit(
      [&](const auto& all) {
        if constexpr (requires { all.front(); } && !std::is_same_v<std::decay_t<decltype(all)>, std::string>) {
          std::vector<std::string> texts;
          for (const auto& one : all) texts.push_back(text_of_one(one));
          return "[" + joined(texts, ", ") + "]";
        } else {
          return text_of_one(all);
        }
      },
      value);
}

std::vector<std::string> differences(const Provenance& before, const Provenance& now) {
  std::vector<std::string> changes;
  if (before.node != now.node)
    changes.push_back("it uses " + now.node + ", used " + before.node);
  else if (before.build_id != now.build_id)
    changes.push_back("the plugin of " + now.node + " was rebuilt");
  for (const auto& [name, value] : now.options) {
    const auto old = before.options.find(name);
    if (before.node == now.node && (old == before.options.end() || old->second != value))
      changes.push_back("option '" + name + "' is " + value +
                        (old == before.options.end() ? ", was not there" : ", was " + old->second));
  }
  for (const auto& [name, key] : now.inputs) {
    const auto old = before.inputs.find(name);
    if (old == before.inputs.end() || old->second != key) changes.push_back("input '" + name + "' changed");
  }
  if (now.random && before.seed != now.seed)
    changes.push_back(formatted("the seed is {}, was {}", now.seed, before.seed));
  return changes;
}

std::string difference(const Provenance& before, const Provenance& now) {
  std::string text;
  for (const std::string& change : differences(before, now)) text += (text.empty() ? "" : "; ") + change;
  return text;
}

std::string warning_now(std::string warning, const PipelineNode& node, const Provenance& kept) {
  for (std::size_t i = 0; i < node.options.size(); ++i) {
    const auto option = kept.options.find(node.info.options[i].name);
    if (node.info.options[i].type != OptionType::path || option == kept.options.end()) continue;
    const std::string before = option->second.substr(0, option->second.rfind(" (content "));
    const std::string& now = std::get<std::string>(node.options[i]);
    if (!before.starts_with('/') || before == now) continue;
    for (std::size_t at = 0; (at = warning.find(before, at)) != std::string::npos; at += now.size())
      warning.replace(at, before.size(), now);
  }
  return warning;
}

std::uint64_t seed_of(const Digest& recipe, std::uint64_t run_seed) {
  Hasher hasher;
  hasher.add(recipe);
  hasher.add(run_seed);
  return hasher.digest().low;
}

namespace fs = std::filesystem;

void FilesRead::note(const Contents& contents) {
  const std::scoped_lock lock(mutex_);
  for (const auto& [path, content] : contents) {
    std::error_code error;
    const fs::path real = fs::weakly_canonical(fs::absolute(path, error), error);
    for (const auto& [file, digest] : content.files) note(file, digest, path);
    // A file may have been added to a folder, or removed from it.
    if (!content.is_there)
      note(real, Digest{}, path);
    else if (fs::is_directory(real, error))
      note(real, content.digest, path);
    contents_.try_emplace(path, content);
  }
}

Contents FilesRead::of(const PipelineNode& node) const {
  const std::scoped_lock lock(mutex_);
  Contents result;
  for (const std::string& path : paths_of(node))
    if (const auto found = contents_.find(path); found != contents_.end()) result.insert(*found);
  return result;
}

void FilesRead::note(const fs::path& real, const Digest& content, const std::string& said) {
  const auto [known, is_new] = known_.try_emplace(real, content);
  if (is_new || known->second == content) return;
  throw Error(said +
              " was changed while the run went on: another node read something else there; run it again when nothing "
              "writes to it");
}

std::map<std::string, Digest> contents_of_options(const PipelineNode& node, const Contents& contents) {
  std::map<std::string, Digest> result;
  for (std::size_t i = 0; i < node.options.size(); ++i) {
    std::vector<std::string> paths = paths_of(node, i);
    std::erase(paths, "");
    if (paths.empty()) continue;
    Hasher hasher;
    bool all_there = true;
    for (const std::string& path : paths) {
      const auto found = contents.find(path);
      all_there = all_there && found != contents.end() && found->second.is_there;
      if (all_there) hasher.add(found->second.digest);
    }
    result[node.info.options[i].name] = all_there ? hasher.digest() : Digest{};
  }
  return result;
}

bool asks_for_version(const OptionInfo& option) {
  return option.name == "version_command" && option.type == OptionType::texts;
}

std::string version_printed(const std::vector<std::string>& command) {
  struct Known {
    std::optional<FileState> state;
    std::string printed;
  };
  static std::mutex mutex;
  static std::map<std::vector<std::string>, Known> known;
  if (command.empty()) return "";
  const std::optional<FileState> state = state_of(program_file(command[0]));
  const std::scoped_lock lock(mutex);
  Known& one = known[command];
  if (one.printed.empty() || !(one.state == state)) one = {state, asked(command)};
  return one.printed;
}

std::string version_of_program(const PipelineNode& node) {
  for (std::size_t i = 0; i < node.options.size(); ++i) try {
      if (asks_for_version(node.info.options[i]))
        return version_printed(std::get<std::vector<std::string>>(node.options[i]));
    } catch (const Error&) {  // its calls have failed, and said why
    }
  return "";
}

}  // namespace marrow
