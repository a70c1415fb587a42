// SPDX-License-Identifier: Apache-2.0
// Measures the time of a cell, and tells what its nodes depend on.
#include <algorithm>

#include "cell_parts.hpp"
#include "marrow/runtime/node/types.hpp"

namespace marrow::compare {
namespace {

/// How times are measured. Raise the number when that changes, because times of two kinds cannot be compared.
const std::string kKindOfTime = "seconds, 2";

/// The time that a cell took, if the store has it.
std::optional<double> kept_seconds(const Store& store, const Digest& key) {
  try {
    const auto kept = store.find(key);
    if (!kept) return std::nullopt;
    const Value& value = kept->outputs.at(0);
    if (value.source && !value.is_list()) return value.as<Metrics>().items.at(0).value;
  } catch (const std::exception&) {  // the entry is not valid: the time is measured again
  }
  store.drop(key);
  return std::nullopt;
}

bool names_a_path(const NodeInfo& info) {
  for (const OptionInfo& option : info.options)
    if (option.type == OptionType::path || option.type == OptionType::paths) return true;
  return false;
}

/// Whether the node itself depends on the case, by a path or by chance, and not only through its inputs.
bool depends_on_case(const PipelineNode& node) {
  if (!node.repetition) return names_a_path(node.info) || node.info.random;
  const std::vector<const PipelineNode*> called = called_nodes(node.repetition->first);
  return std::any_of(called.begin(), called.end(), [](const PipelineNode* one) { return depends_on_case(*one); });
}

}  // namespace

const CellRunner::OfAllVariants& CellRunner::of_all_variants(const CellIndex& cell) {
  const std::pair place(cell.case_index, cell.start);
  if (of_all_variants_.place == place) return of_all_variants_;
  OfAllVariants made{place, {}, {}};
  Hasher keys;
  for (std::size_t v = 0; v < experiment_.variants.size(); ++v) {
    const CellIndex other{v, cell.case_index, cell.start};
    const Pipeline pipeline = pipeline_of(other, case_folder(cell.case_index), Depth::figures);
    const auto nodes = histories(pipeline, experiment_.cases[cell.case_index].name);
    for (const Digest& one : std::set<Digest>(nodes.begin(), nodes.end())) ++made.variants_with[one];
    keys.add(key_of(other, pipeline));
  }
  made.keys = keys.digest();
  return of_all_variants_ = std::move(made);
}

std::vector<std::size_t> CellRunner::variants_with_nodes(const CellIndex& cell, const Pipeline& pipeline) {
  const std::map<Digest, std::size_t>& variants_with = of_all_variants(cell).variants_with;
  std::vector<std::size_t> counts;
  for (const Digest& one : histories(pipeline, experiment_.cases[cell.case_index].name)) {
    const auto found = variants_with.find(one);  // none if the file of the pipeline was changed meanwhile
    counts.push_back(found == variants_with.end() ? 1 : found->second);
  }
  return counts;
}

std::set<std::string> CellRunner::own_nodes(const CellIndex& cell, const Pipeline& pipeline) {
  const std::vector<std::size_t> variants_with = variants_with_nodes(cell, pipeline);
  std::set<std::string> ids;
  for (std::size_t i = 0; i < variants_with.size(); ++i)
    if (experiment_.variants.size() == 1 || variants_with[i] < experiment_.variants.size())
      ids.insert(pipeline.nodes[i].id);
  return ids;
}

double CellRunner::time(const CellIndex& cell) {
  const Pipeline pipeline = pipeline_of(cell, case_folder(cell.case_index), Depth::figures);
  RunSettings settings = settings_of(cell);
  settings.made_anew = own_nodes(cell, pipeline);
  settings.wanted_by_others = wanted_by_others(cell, pipeline);
  Hasher hasher;
  const Watched before = watched(cell, pipeline);
  hasher.add(kKindOfTime);
  hasher.add(before.key);
  hasher.add(std::int64_t(threads_));
  // The variants decide which nodes count. If one of them changes, all are measured again, so that times of different
  // days are never compared.
  hasher.add(of_all_variants(cell).keys);
  const Digest key = hasher.digest();
  if (const auto known = store_ ? kept_seconds(*store_, key) : std::nullopt) return *known;

  const auto seconds_of_run = [&] {
    const RunResult result = run_pipeline(pipeline, catalogue_, settings);
    if (result.failed()) throw Error(reason_of(pipeline, result));
    return result.seconds;
  };
  seconds_of_run();  // loads libraries, starts threads and fills caches: the first cell must not pay for this
  const double taken = seconds_of_run();
  if (watched(cell, pipeline) != before) throw Error(kChanged);
  Value seconds = Value::of(std::make_shared<const Metrics>(Metrics{{{"seconds", taken, "s"}}}));
  seconds.key = seconds.type.content->hash(seconds.data.get());
  if (store_) store_->save(key, {seconds}, {"time of " + cell_id(experiment_, cell), {}, {}, {}, false, 0, taken, {}});
  return taken;
}

std::vector<Digest> histories(const Pipeline& pipeline, const std::string& case_name) {
  std::vector<Digest> result;
  for (const PipelineNode& node : pipeline.nodes) {
    Hasher hasher;
    hasher.add(node.info.name);
    for (const OptionValue& option : node.options) std::visit([&](const auto& value) { hasher.add(value); }, option);
    if (node.repetition) hasher.add(resolved_yaml(node.repetition->alone));
    if (depends_on_case(node)) hasher.add(case_name);
    for (const Wire& wire : node.wires)
      for (const Reference& source : wire.sources) {
        hasher.add(node.input_of(wire).name);
        hasher.add(result[std::size_t(source.node)]);
        hasher.add(std::int64_t(source.output));
        hasher.add(source.items);
      }
    result.push_back(hasher.digest());
  }
  return result;
}

std::vector<Dependence> dependences(const Pipeline& pipeline, const Experiment& experiment) {
  const StartProtocol* protocol = experiment.protocol ? &*experiment.protocol : nullptr;
  std::vector<Dependence> result;
  for (const PipelineNode& node : pipeline.nodes) {
    Dependence own{depends_on_case(node),
                   protocol && protocol->node == node.id &&
                       (protocol->rotation_deg > 0 || protocol->translation_mm > 0 || protocol->distance_mm > 0)};
    for (const Wire& wire : node.wires)
      for (const Reference& source : wire.sources) {
        own.on_case |= result[std::size_t(source.node)].on_case;
        own.on_start |= result[std::size_t(source.node)].on_start;
      }
    result.push_back(own);
  }
  return result;
}

}  // namespace marrow::compare
