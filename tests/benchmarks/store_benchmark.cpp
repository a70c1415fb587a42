// SPDX-License-Identifier: Apache-2.0
// What the store of results costs: looking a small value up, and reading a large one; and the same through a shared
// store that is on the same disk.
#include <benchmark/benchmark.h>

#include "marrow/runtime/node/types.hpp"
#include "marrow/runtime/store/shared_folder.hpp"
#include "marrow/runtime/store/shared_store.hpp"
#include "tests/benchmarks/timing.hpp"

namespace {

namespace fs = std::filesystem;
using namespace marrow;

/// A value with the key of its content.
template <class T>
Value kept(T item) {
  Value value = Value::of<T>(std::make_shared<const T>(std::move(item)));
  value.key = value.type.content->hash(value.data.get());
  return value;
}

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
    const std::string fault = store.save(hash_of(name), {kept(std::move(item))},
                                         Provenance{.node = "evaluate.pose_error", .options = {{"points", "1000"}}});
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

/// What the end of a run takes where earlier runs left that many records, of which none is removed.
void TidyUpRecords(benchmark::State& state) {
  const fs::path folder = fs::temp_directory_path() / "marrow-tidying-benchmark";
  const Store store(folder);
  const auto run = [](std::int64_t number) { return "run " + std::to_string(number); };
  for (std::int64_t i = 0; i < state.range(0); ++i) store.remember(run(i), {{"node", {hash_of(i), {}}}});
  for (auto _ : state) benchmark::DoNotOptimize(store.collect(std::uint64_t(1) << 40).entries);
  fs::remove_all(folder);
}
BENCHMARK(TidyUpRecords)->Arg(4000)->Arg(20000)->Unit(benchmark::kMillisecond);

/// A host that has a shared store behind its own, which is empty at first.
class SharedFixture : public benchmark::Fixture {
 public:
  void SetUp(benchmark::State&) override {
    fs::create_directories(folder / "shared");
    fs::permissions(folder / "shared", fs::perms::owner_all);
    for (int i = 0; i < kResults; ++i)
      shared->offer(hash_of(i), {kept(Metrics{{{"mtre_mm", double(i), "mm"}}})},
                    Provenance{.node = "evaluate.pose_error", .seconds = 2});
  }
  void TearDown(benchmark::State&) override { fs::remove_all(folder); }

  static constexpr int kResults = 500;
  fs::path folder = fs::temp_directory_path() / "marrow-shared-store-benchmark";
  std::shared_ptr<SharedStore> shared = std::make_shared<SharedStore>(folder / "shared");
  Store store{folder / "host", shared};
};

BENCHMARK_F(SharedFixture, TakeASmallValueFromTheSharedStore)(benchmark::State& state) {
  int name = 0;
  for (auto _ : state) {
    const Digest key = hash_of(name++ % kResults);
    benchmark::DoNotOptimize(store.find(key)->outputs[0].as<Metrics>().items[0].value);
    state.PauseTiming();
    store.drop(key);
    state.ResumeTiming();
  }
}

BENCHMARK_F(SharedFixture, LookUpASmallValueThatWasTaken)(benchmark::State& state) {
  int name = 0;
  for (auto _ : state)
    benchmark::DoNotOptimize(store.find(hash_of(name++ % kResults))->outputs[0].as<Metrics>().items[0].value);
}

BENCHMARK_F(SharedFixture, LookUpWhatIsInNeither)(benchmark::State& state) {
  int name = kResults;
  for (auto _ : state) benchmark::DoNotOptimize(store.find(hash_of(name++)).has_value());
}

BENCHMARK_F(SharedFixture, ClaimWhatIsInNeither)(benchmark::State& state) {
  int name = kResults;
  for (auto _ : state) {
    const Digest key = hash_of(name++);
    const SharedClaim claim = shared->claim(key, nullptr);
    benchmark::DoNotOptimize(store.find(key, Store::Where::anew).has_value());
  }
}

Volume large_volume() {
  Volume volume;
  volume.grid.size = {512, 512, timing::is_short() ? 7 : 763};  // 800 MB
  volume.values.assign(volume.grid.count(), 1.5f);
  return volume;
}

BENCHMARK_F(Fixture, KeepALargeVolume)(benchmark::State& state) {
  const Value value = kept(large_volume());
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
