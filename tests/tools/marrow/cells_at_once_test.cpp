// SPDX-License-Identifier: Apache-2.0
// How many cells of a comparison run at once: their threads are no more than the cores, unless a person says how many.
#include <gtest/gtest.h>

#include <compare/cell_jobs.hpp>
#include <thread>

namespace cells_at_once_test {

using marrow::cli::CompareRequest;
using marrow::cli::pool_of;

int workers(int jobs, int threads) {
  CompareRequest request;
  request.file = "experiment.yaml";
  request.jobs = jobs;
  return pool_of(request, "folder", threads).workers;
}

TEST(CellsAtOnce, HaveAsManyThreadsAsThereAreCores) {
  const int cores = int(std::thread::hardware_concurrency());
  EXPECT_EQ(workers(0, 1), cores);
  EXPECT_EQ(workers(0, cores), 1);
  EXPECT_EQ(workers(0, 2 * cores), 1) << "one cell runs in any case";
  for (int threads = 1; threads <= cores; ++threads) {
    EXPECT_LE(workers(0, threads) * threads, cores);
    EXPECT_GT((workers(0, threads) + 1) * threads, cores) << "no core is left over for another cell";
  }
}

TEST(CellsAtOnce, AreAsManyAsAPersonWants) { EXPECT_EQ(workers(7, 3), 7); }

}  // namespace cells_at_once_test
