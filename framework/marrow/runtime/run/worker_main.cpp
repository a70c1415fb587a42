// SPDX-License-Identifier: Apache-2.0
// marrow-worker: the process in which the framework reads files and loads libraries that it does not know.
#include <cstdio>
#include <exception>

#include "marrow/runtime/plugins/descriptions.hpp"
#include "marrow/runtime/run/apart.hpp"

int main() {
  try {
    return marrow::serve_worker(
        {{"call", marrow::answer_call}, {"share", marrow::answer_share}, {"describe", marrow::answer_describe}});
  } catch (const std::exception& error) {
    std::fprintf(stderr, "marrow-worker: error: %s\n", error.what());
    return 2;
  }
}
