// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/plugins/catalogue.hpp"

#include <cstdlib>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "marrow/base/diagnostics.hpp"
#include "marrow/base/framework_file.hpp"
#include "marrow/base/regular_file.hpp"
#include "marrow/base/text_file.hpp"
#include "marrow/runtime/plugins/library_index.hpp"
#include "marrow/runtime/plugins/python_file.hpp"

namespace marrow {

namespace fs = std::filesystem;

std::vector<fs::path> Catalogue::default_folders() {
  std::vector<fs::path> folders;
  if (const char* path = std::getenv("MARROW_PLUGIN_PATH")) {
    std::istringstream stream(path);
    for (std::string folder; std::getline(stream, folder, ':');)
      if (!folder.empty()) folders.emplace_back(folder);
  }
  folders.push_back(framework_file().parent_path() / "marrow");
  return folders;
}

Catalogue::Catalogue(std::vector<fs::path> folders) : folders_(std::move(folders)) {
  find_libraries();
  do {
    enter_names();
  } while (refuse_broken_contracts());
  enter_not_built();
}

void Catalogue::find_libraries() {
  std::optional<Digest> framework;
  const auto refuse = [&](const fs::path& file, const std::string& reason) {
    libraries_.push_back({});
    libraries_.back().file = file;
    libraries_.back().refused = reason;
  };
  for (const fs::path& folder : folders_) {
    std::vector<fs::path> files;
    std::error_code error;
    for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error))
      if (at->path().extension() == ".so" || is_python_plugin(at->path())) files.push_back(at->path());
    if (error && error != std::errc::no_such_file_or_directory)
      refuse(folder, "cannot be searched for libraries: " + error.message());
    std::sort(files.begin(), files.end());
    LibraryIndex index(folder);
    const std::size_t first = libraries_.size();
    for (const fs::path& file : files) {
      try {
        std::optional<LibraryInfo> known = index.find(file);
        if (!known && !framework) framework = file_digest(framework_file());
        libraries_.push_back(known ? std::move(*known) : library_info(file, *framework));
      } catch (const Error& error) {
        refuse(file, error.what());
      }
    }
    index.keep(std::span(libraries_).subspan(first));
  }
}

void Catalogue::enter_names() {
  kinds_.clear();
  suites_.clear();
  with_suite_.clear();
  nodes_.clear();
  writers_.clear();
  for (std::size_t l = 0; l < libraries_.size(); ++l) {
    const LibraryInfo& library = libraries_[l];
    for (std::size_t i = 0; i < library.kinds.size(); ++i)
      (library.kinds[i].is_suite ? suites_ : kinds_).try_emplace(library.kinds[i].name, Entry{l, i});
    for (std::size_t i = 0; i < library.nodes.size(); ++i) nodes_.try_emplace(library.nodes[i].name, Entry{l, i});
    for (std::size_t i = 0; i < library.writers.size(); ++i)
      writers_.try_emplace(library.writers[i].type.id, Entry{l, i});
  }
  for (const auto& [name, entry] : suites_)
    if (const KindInfo* kind = find_kind(name); kind && kind->checks.empty()) {
      KindInfo whole = *kind;
      whole.checks = libraries_[entry.library].kinds[entry.index].checks;
      with_suite_.emplace(name, std::move(whole));
    }
}

void Catalogue::enter_not_built() {
  constexpr std::uintmax_t most_bytes = 1 << 20;
  for (const fs::path& folder : folders_) {
    const fs::path file = folder / "not_built.json";
    if (std::error_code none; !fs::exists(file, none)) continue;
    try {
      const auto nodes = nlohmann::json::parse(read_text_file(file, most_bytes), nullptr, false);
      for (const auto& [node, option] : nodes.items())
        if (nodes.is_object() && option.is_string() && !find(node)) not_built_.emplace(node, option.get<std::string>());
    } catch (const Error&) {  // it only helps with hints
    }
  }
}

bool Catalogue::refuse_broken_contracts() {
  std::vector<std::string> reasons;
  bool any = false;
  for (const LibraryInfo& library : libraries_) {
    std::string faults;
    for (const NodeInfo& node : library.nodes)
      for (const std::string& fault : contract_faults(node, find_kind(node.kind())))
        faults += (faults.empty() ? "" : "; ") + node.name + ": " + fault;
    any = any || !faults.empty();
    reasons.push_back(std::move(faults));
  }
  for (std::size_t l = 0; l < libraries_.size(); ++l) {
    if (reasons[l].empty()) continue;
    LibraryInfo& library = libraries_[l];
    library.refused = "declares its nodes wrongly: " + reasons[l];
    library.kinds.clear();
    library.nodes.clear();
    library.writers.clear();
  }
  return any;
}

Catalogue::~Catalogue() = default;

std::vector<std::string> Catalogue::node_names() const {
  std::vector<std::string> names;
  for (const auto& [name, entry] : nodes_) names.push_back(name);
  return names;
}

const NodeInfo* Catalogue::find(const std::string& name) const {
  const auto found = nodes_.find(name);
  return found == nodes_.end() ? nullptr : &libraries_[found->second.library].nodes[found->second.index];
}

std::string Catalogue::remedy_for(const std::string& missing_node) const {
  if (const auto found = not_built_.find(missing_node); found != not_built_.end())
    return "this build of marrow leaves it out; configure it with -D" + found->second + "=ON";
  const std::size_t dot = missing_node.find('.');
  if (dot == std::string::npos) return "";
  const std::string method = missing_node.substr(dot + 1);
  for (const auto& [name, entry] : nodes_) {
    const NodeInfo& node = *find(name);
    if (node.kind() != missing_node.substr(0, dot)) continue;
    for (const OptionInfo& option : node.options)
      if (std::find(option.choices.begin(), option.choices.end(), method) != option.choices.end())
        return "use " + name + " with " + option.name + ": " + method;
  }
  return "";
}

std::string Catalogue::hint_for(const std::string& missing_node, const std::vector<std::string>& known) const {
  const std::string remedy = remedy_for(missing_node);
  return remedy.empty() ? suggestion(missing_node, known) : remedy;
}

const LibraryInfo* Catalogue::library_of(const std::string& name) const {
  const auto found = nodes_.find(name);
  return found == nodes_.end() ? nullptr : &libraries_[found->second.library];
}

std::vector<std::string> Catalogue::kind_names() const {
  std::set<std::string> names;
  for (const auto& [name, entry] : kinds_) names.insert(name);
  for (const auto& [name, entry] : nodes_) names.insert(name.substr(0, name.find('.')));
  return {names.begin(), names.end()};
}

const KindInfo* Catalogue::find_kind(const std::string& name) const {
  if (const auto whole = with_suite_.find(name); whole != with_suite_.end()) return &whole->second;
  const auto found = kinds_.find(name);
  return found == kinds_.end() ? nullptr : &libraries_[found->second.library].kinds[found->second.index];
}

const LibraryInfo* Catalogue::library_of_kind(const std::string& name) const {
  const auto found = kinds_.find(name);
  return found == kinds_.end() ? nullptr : &libraries_[found->second.library];
}

std::vector<KindPort> Catalogue::ports_of_kind(const std::string& kind) const {
  std::vector<KindPort> ports;
  if (const KindInfo* contract = find_kind(kind)) ports = contract->inputs;
  for (const auto& [name, entry] : nodes_) {
    const NodeInfo& node = libraries_[entry.library].nodes[entry.index];
    if (node.kind() != kind) continue;
    for (const PortInfo& port : node.inputs) {
      const auto known =
          std::find_if(ports.begin(), ports.end(), [&](const KindPort& one) { return one.name == port.name; });
      if (known == ports.end())
        ports.push_back({port.name, port.help, {port.type}, port.axis});
      else if (std::find(known->types.begin(), known->types.end(), port.type) == known->types.end())
        known->types.push_back(port.type);
    }
  }
  return ports;
}

std::map<std::string, TypeInfo> Catalogue::types() const {
  std::map<std::string, TypeInfo> types;
  for (const auto& [name, entry] : nodes_) {
    const NodeInfo& node = *find(name);
    for (const auto* ports : {&node.inputs, &node.outputs})
      for (const PortInfo& port : *ports) types.emplace(port.type.id, port.type);
  }
  return types;
}

const WriterInfo* Catalogue::find_writer(const TypeInfo& type) const {
  const auto found = writers_.find(type.id);
  if (found == writers_.end()) return nullptr;
  const WriterInfo& writer = libraries_[found->second.library].writers[found->second.index];
  return writer.type == type ? &writer : nullptr;
}

const Plugin& Catalogue::load_plugin(std::size_t library) const {
  const std::scoped_lock lock(mutex_);
  std::unique_ptr<Plugin>& plugin = loaded_[library];
  if (!plugin) plugin = load_library(libraries_[library]);
  return *plugin;
}

const NodeDefinition& Catalogue::load(const std::string& name) const {
  const Entry& entry = nodes_.at(name);
  return load_plugin(entry.library).nodes.at(entry.index);
}

const conformance::Suite& Catalogue::load_suite(const std::string& kind) const {
  const Entry& entry = (with_suite_.contains(kind) ? suites_ : kinds_).at(kind);
  return load_plugin(entry.library).kinds.at(entry.index).suite;
}

const WriterDefinition& Catalogue::load_writer(const TypeInfo& type) const {
  const Entry& entry = writers_.at(type.id);
  return load_plugin(entry.library).writers.at(entry.index);
}

namespace {

template <class Port>
const Port* find_port(const std::vector<Port>& ports, const std::string& name) {
  const auto found = std::find_if(ports.begin(), ports.end(), [&](const Port& port) { return port.name == name; });
  return found == ports.end() ? nullptr : &*found;
}

/// Checks that each port whose name the kind knows has the type and the axis of the contract.
void check_ports(const std::vector<PortInfo>& ports, const std::vector<KindPort>& contract, const std::string& what,
                 const std::string& kind, std::vector<std::string>& faults) {
  for (const PortInfo& port : ports) {
    const KindPort* known = find_port(contract, port.name);
    if (!known) continue;
    const bool is_one = std::find(known->types.begin(), known->types.end(), port.type) != known->types.end();
    if (is_one && known->axis == port.axis) continue;
    const bool is_old = !is_one && std::any_of(known->types.begin(), known->types.end(),
                                               [&](const TypeInfo& type) { return type.id == port.type.id; });
    faults.push_back(what + " '" + port.name + "': the kind '" + kind + "' has it as " +
                     types_text(known->types, known->axis) + ", not " +
                     (is_old ? "another version of that type; build both again" : types_text({port.type}, port.axis)));
  }
}

void check_traits(const NodeInfo& node, const KindInfo& kind, std::vector<std::string>& faults) {
  std::vector<std::string> known;
  for (const TraitInfo& trait : kind.traits) known.push_back(trait.name);
  for (const std::string& trait : node.traits)
    if (std::find(known.begin(), known.end(), trait) == known.end())
      faults.push_back("trait '" + trait + "': the kind '" + kind.name + "' has none of that name" +
                       (known.empty() ? "" : "; " + suggestion(trait, known)));
}

}  // namespace

std::string types_text(const std::vector<TypeInfo>& types, const std::string& axis) {
  std::string text;
  for (const TypeInfo& type : types) text += (text.empty() ? "" : " or ") + type.id;
  return axis.empty() ? text : "list of " + text + " over " + axis;
}

std::vector<std::string> contract_faults(const NodeInfo& node, const KindInfo* kind) {
  std::vector<std::string> faults;
  if (!kind || !kind->sees_truth)
    for (const PortInfo& port : node.inputs)
      if (port.type.id == TypeInfo::of<Truth>().id)
        faults.push_back("input '" + port.name + "': only nodes of a kind that may see the truth are given it");
  if (!kind) return faults;
  check_ports(node.inputs, kind->inputs, "input", kind->name, faults);
  check_ports(node.outputs, kind->outputs, "output", kind->name, faults);
  for (const KindPort& port : kind->outputs)
    if (!find_port(node.outputs, port.name))
      faults.push_back("output '" + port.name + "' is missing: every node of the kind '" + kind->name + "' has it");
  check_traits(node, *kind, faults);
  return faults;
}

}  // namespace marrow
