// SPDX-License-Identifier: Apache-2.0
// What the store of results costs: looking a small value up, and reading a large one.
#include <benchmark/benchmark.h>

#include <filesystem>

#include "marrow/runtime/store.hpp"
#include "marrow/runtime/types.hpp"

namespace {

namespace fs = std::filesystem;
using namespace marrow;

/// A store in a folder of its own with 2000 small results.
class Fixture : public benchmark::Fixture {
 public:
  void SetUp(benchmark::State&) override {
    if (!fs::exists(folder))
      for (int i = 0; i < 2000; ++i) save(i, Metrics{{{"mtre_mm", double(i), "mm"}}});
  }
  void TearDown(benchmark::State&) override { fs::remove_all(folder); }

  template <class T>
  void save(int name, T item) {
    Value value = Value::of<T>(std::make_shared<const T>(std::move(item)));
    value.key = value.type.content->hash(value.data.get());
    const std::string fault =
        store.save(hash_of(name), {value}, Provenance{.node = "evaluate.pose_error", .options = {{"points", "1000"}}});
    if (!fault.empty()) throw Error(fault);
  }

  fs::path folder = fs::temp_directory_path() / "marrow-store-benchmark";
  Store store{folder};
};

BENCHMARK_F(Fixture, LookUpASmallValue)(benchmark::State& state) {
  int name = 0;
  for (auto _ : state)
    benchmark::DoNotOptimize(store.find(hash_of(name++ % 2000))->outputs[0].as<Metrics>().items[0].value);
}

BENCHMARK_F(Fixture, LookUpWhatIsNotThere)(benchmark::State& state) {
  int name = 2000;
  for (auto _ : state) benchmark::DoNotOptimize(store.find(hash_of(name++)).has_value());
}

Volume large_volume() {
  Volume volume;
  volume.grid.size = {512, 512, 763};  // 800 MB
  volume.values.assign(volume.grid.count(), 1.5f);
  return volume;
}

BENCHMARK_F(Fixture, KeepALargeVolume)(benchmark::State& state) {
  Value value = Value::of<Volume>(std::make_shared<const Volume>(large_volume()));
  value.key = value.type.content->hash(value.data.get());
  for (auto _ : state)
    if (!store.save(hash_of(-1), {value}, {}).empty()) state.SkipWithError("not kept");
  state.SetBytesProcessed(std::int64_t(state.iterations()) *
                          std::int64_t(value.as<Volume>().values.size() * sizeof(float)));
}

BENCHMARK_F(Fixture, ReadALargeVolume)(benchmark::State& state) {
  save(-1, large_volume());
  for (auto _ : state) benchmark::DoNotOptimize(store.find(hash_of(-1))->outputs[0].as<Volume>().values.back());
  state.SetBytesProcessed(std::int64_t(state.iterations()) * std::int64_t(large_volume().grid.count() * sizeof(float)));
}

}  // namespace

BENCHMARK_MAIN();
