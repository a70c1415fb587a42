// SPDX-License-Identifier: Apache-2.0
// How long both stages take together, in one process, with the model and two 512 x 512 images in memory: edges, shaft
// borders, first stage, outline, cost and registration of pipelines/femur.yaml, on a simulated case.
#include <benchmark/benchmark.h>

#include <iostream>
#include <map>
#include <marrow/domain/error.hpp>
#include <marrow/runtime/executor.hpp>
#include <marrow/runtime/types.hpp>

namespace {

using marrow::Value;

marrow::Pipeline read(const marrow::Catalogue& catalogue, const std::string& file, const std::string& output,
                      const std::vector<marrow::InputValue>& inputs) {
  marrow::Diagnostics diagnostics;
  marrow::PipelineArguments arguments;
  arguments.inputs = inputs;
  marrow::Pipeline pipeline =
      marrow::read_pipeline(std::string(MARROW_SOURCE_DIR) + "/pipelines/" + file, arguments, catalogue, diagnostics);
  if (!diagnostics.empty()) throw marrow::Error(file + " cannot be used");
  std::erase_if(pipeline.outputs, [&](const auto& item) { return item.name != output; });
  return pipeline;
}

marrow::RunResult run(const marrow::Pipeline& pipeline, const marrow::Catalogue& catalogue,
                      const marrow::RunSettings& settings) {
  marrow::RunResult result = marrow::run_pipeline(pipeline, catalogue, settings);
  for (std::size_t i = 0; i < pipeline.nodes.size(); ++i)
    if (result.nodes[i].status == marrow::NodeRecord::Status::failed)
      throw marrow::Error(pipeline.nodes[i].id + ": " + result.nodes[i].reason);
  return result;
}

/// A simulated case and its segmented model, made once.
struct Scene {
  marrow::Catalogue catalogue;
  marrow::Pipeline registration = read(catalogue, "femur.yaml", "pose", {{"case", "in memory"}});
  marrow::RunSettings settings;

  Scene() {
    settings.threads = 2;
    const marrow::Pipeline simulation = read(catalogue, "simulate.yaml", "case", {});
    const marrow::RunResult simulated = run(simulation, catalogue, settings);
    const auto& data = marrow::value_of(simulated, simulation.outputs[0].source).as<marrow::Case>();
    settings.given["case"] = {Value::of(std::make_shared<const marrow::Volume>(data.ct)),
                              Value::of(data.seeds, "fragment"), Value::of(data.views, "view"),
                              Value::of(data.start, "fragment"), Value::of(data.truth, "fragment")};
    const marrow::RunResult first = run(registration, catalogue, settings);
    for (std::size_t i = 0; i < registration.nodes.size(); ++i) {
      const std::string& id = registration.nodes[i].id;
      if (id == "bone" || id == "model") settings.given[id] = first.nodes[i].outputs;
    }
  }
};

void both_stages(benchmark::State& state) {
  static const Scene scene;
  std::map<std::string, double> seconds;
  for (auto _ : state) {
    const marrow::RunResult result = run(scene.registration, scene.catalogue, scene.settings);
    for (std::size_t i = 0; i < result.nodes.size(); ++i)
      if (result.nodes[i].status == marrow::NodeRecord::Status::done &&
          !scene.settings.given.count(scene.registration.nodes[i].id))
        seconds[scene.registration.nodes[i].id] += result.nodes[i].seconds;
  }
  for (const auto& [id, sum] : seconds)
    state.counters[id + "_ms"] = benchmark::Counter(1000 * sum, benchmark::Counter::kAvgIterations);
}
BENCHMARK(both_stages)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime()
    ->MeasureProcessCPUTime()
    ->Iterations(1)
    ->Repetitions(15);

}  // namespace

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  try {
    benchmark::RunSpecifiedBenchmarks();
  } catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    return 1;
  }
}
