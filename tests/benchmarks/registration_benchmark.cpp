// SPDX-License-Identifier: Apache-2.0
// How long a registration takes, in one process, with the model and two 512 x 512 images in memory, on a simulated
// case. What is made of the CT alone, before any image is taken, counts as the model: the surface, and projectors of
// it. both_stages: edges, shaft borders, first stage, cost and registration of pipelines/femur/femur.yaml. Then 100
// starts of up to 5 degrees and 5 mm about the truth: by grey values alone, coarse to fine, and by contour and then
// grey values (pipelines/femur/femur-intensity.yaml), with how far from the truth they end.
#include <benchmark/benchmark.h>

#include <marrow/runtime/node/types.hpp>
#include <marrow/runtime/run/executor.hpp>
#include <random>

#include "tests/benchmarks/timing.hpp"

namespace {

using marrow::Value;

marrow::Pipeline read(const marrow::Catalogue& catalogue, const std::string& file, const std::string& output,
                      const std::vector<marrow::InputValue>& inputs,
                      const std::vector<marrow::Override>& overrides = {}) {
  marrow::Diagnostics diagnostics;
  marrow::PipelineArguments arguments;
  arguments.inputs = inputs;
  arguments.overrides = overrides;
  marrow::Pipeline pipeline =
      marrow::read_pipeline(std::string(MARROW_SOURCE_DIR) + "/pipelines/" + file, arguments, catalogue, diagnostics);
  for (const marrow::Diagnostic& one : diagnostics.sorted())
    if (one.message.starts_with("unknown node")) throw timing::NotBuilt(file + ": " + one.message);
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

/// A pipeline whose case, and what is made of the CT alone, lie in memory.
struct Prepared {
  const marrow::Catalogue& catalogue;
  marrow::Pipeline pipeline;
  marrow::RunSettings settings;

  Prepared(const marrow::Catalogue& all, const marrow::Case& data, const std::string& file,
           const std::set<std::string>& of_ct, const std::vector<marrow::Override>& overrides = {})
      : catalogue(all), pipeline(read(all, file, "pose", {{"case", "in memory"}}, overrides)) {
    settings.threads = 2;
    std::map<std::string, Value> of_case{{"ct", Value::of(std::make_shared<const marrow::Volume>(data.ct))},
                                         {"seeds", Value::of(data.seeds, "fragment")},
                                         {"views", Value::of(data.views, "view")},
                                         {"start", Value::of(data.start, "fragment")},
                                         {"truth", Value::of(data.truth, "fragment")}};
    for (const marrow::PortInfo& port : all.find("read.case")->outputs)
      settings.given["case"].push_back(of_case[port.name]);
    const marrow::RunResult first = run(pipeline, catalogue, settings);
    for (std::size_t i = 0; i < pipeline.nodes.size(); ++i)
      if (of_ct.count(pipeline.nodes[i].id)) settings.given[pipeline.nodes[i].id] = first.nodes[i].outputs;
  }
  marrow::RunResult result() const { return run(pipeline, catalogue, settings); }
  /// The first item of a value that was given.
  template <class T>
  const T& given(const std::string& id) const {
    return settings.given.at(id)[0].items.at(0).template as<T>();
  }
};

const marrow::Catalogue& catalogue() {
  static const marrow::Catalogue all;
  return all;
}

const marrow::Case& simulated() {
  static const marrow::Pipeline simulation = read(catalogue(), "simulate/simulate.yaml", "case", {});
  static const marrow::RunResult result = [] {
    marrow::RunSettings settings;
    settings.threads = 2;
    return run(simulation, catalogue(), settings);
  }();
  return marrow::value_of(result, simulation.outputs[0].source).as<marrow::Case>();
}

void both_stages(benchmark::State& state) {
  static const Prepared contour(catalogue(), simulated(), "femur/femur.yaml", {"bone", "model", "outline"});
  std::map<std::string, double> seconds;
  for (auto _ : state) {
    const marrow::RunResult result = contour.result();
    for (std::size_t i = 0; i < result.nodes.size(); ++i)
      if (result.nodes[i].status == marrow::NodeRecord::Status::done &&
          !contour.settings.given.count(contour.pipeline.nodes[i].id))
        seconds[contour.pipeline.nodes[i].id] += result.nodes[i].seconds;
  }
  for (const auto& [id, sum] : seconds)
    state.counters[id + "_ms"] = benchmark::Counter(1000 * sum, benchmark::Counter::kAvgIterations);
}
BENCHMARK(both_stages)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime()
    ->MeasureProcessCPUTime()
    ->Iterations(1)
    ->Repetitions(timing::rounds(15));

/// Direction uniform on the sphere, length uniform up to the limit.
Eigen::Vector3d vector_up_to(double limit, std::mt19937& random) {
  const auto uniform = [&] { return double(random()) / 4294967296.0; };
  const double height = 2 * uniform() - 1, turn = 2 * marrow::kPi * uniform(), across = std::sqrt(1 - height * height);
  return limit * uniform() * Eigen::Vector3d(across * std::cos(turn), across * std::sin(turn), height);
}

void print(const char* what, std::vector<double> values, const char* unit) {
  std::sort(values.begin(), values.end());
  const auto at = [&](double part) { return values[std::size_t(part * double(values.size() - 1))]; };
  std::printf("  %-14s median %.3f, 95 %% %.3f, worst %.3f %s\n", what, at(0.5), at(0.95), values.back(), unit);
}

void from_random_starts(const std::string& title, Prepared prepared) {
  const int kStarts = timing::rounds(100);
  const auto& truth = prepared.given<marrow::Mesh>("model");
  const marrow::RigidTransform exact = simulated().truth[0].world_from_model;
  const marrow::FragmentFrame frame = marrow::fragment_frame(truth);
  const std::vector<Eigen::Vector3d> targets = marrow::sample_surface(truth, 500);
  std::mt19937 random(1);
  std::vector<double> seconds, mtre_mm, axial_deg;
  for (int i = 0; i < kStarts; ++i) {
    marrow::Pose start;
    start.frame = frame;
    marrow::Vector6d away;
    away << vector_up_to(marrow::radians(5), random), vector_up_to(5, random);
    start.world_from_model = marrow::moved(exact, frame, away);
    marrow::List<marrow::Pose> starts;
    starts.add(simulated().truth.name(0), start);
    prepared.settings.given["start"] = {Value::of(starts, "fragment")};
    const timing::Stopwatch stopwatch;
    const marrow::RunResult result = prepared.result();
    seconds.push_back(stopwatch.seconds());
    const auto& found =
        marrow::value_of(result, prepared.pipeline.outputs[0].source).items.at(0).as<marrow::Pose>().world_from_model;
    double sum = 0;
    for (const Eigen::Vector3d& target : targets) sum += (found * target - exact * target).norm();
    mtre_mm.push_back(sum / double(targets.size()));
    axial_deg.push_back(std::abs(marrow::degrees(marrow::motion_between(exact, found, frame)[2])));
  }
  const auto good = std::count_if(mtre_mm.begin(), mtre_mm.end(), [](double error) { return error < 1; });
  std::printf("%s, %d starts of up to 5 degrees and 5 mm: %d end within 1 mm\n", title.c_str(), kStarts, int(good));
  print("mTRE", mtre_mm, "mm");
  print("axial rotation", axial_deg, "degrees");
  print("time", seconds, "s");
}

}  // namespace

int main(int argc, char** argv) {
  const bool is_filtered = std::any_of(
      argv, argv + argc, [](const char* argument) { return std::string(argument).starts_with("--benchmark_filter"); });
  benchmark::Initialize(&argc, argv);
  return timing::exit_code_of([&] {
    simulated();
    benchmark::RunSpecifiedBenchmarks();
    if (is_filtered) return 0;
    const std::set<std::string> of_ct{"bone", "model", "outline", "drr"};
    from_random_starts("contour, then grey values",
                       Prepared(catalogue(), simulated(), "femur/femur-intensity.yaml", of_ct));
    from_random_starts("grey values alone", Prepared(catalogue(), simulated(), "femur/femur-grey-values.yaml", of_ct));
    return 0;
  });
}
