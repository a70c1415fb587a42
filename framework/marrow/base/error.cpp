// SPDX-License-Identifier: Apache-2.0
#include "marrow/base/error.hpp"

#include <cxxabi.h>

#include <atomic>
#include <cstdlib>
#include <exception>
#include <memory>
#include <typeinfo>

namespace marrow {

std::string reason_of_exception() {
  try {
    throw;
  } catch (const std::exception& error) {
    return error.what();
  } catch (...) {
    const std::type_info* type = abi::__cxa_current_exception_type();
    if (!type) return "threw something that is not a std::exception; throw marrow::Error";
    const std::unique_ptr<char, void (*)(void*)> name(abi::__cxa_demangle(type->name(), nullptr, nullptr, nullptr),
                                                      std::free);
    return std::string("threw something that is not a std::exception (") + (name ? name.get() : type->name()) +
           "); throw marrow::Error";
  }
}

namespace {

std::atomic<long> calls{0};

}  // namespace

long calls_without_process() { return calls; }
void note_call_without_process() { ++calls; }

}  // namespace marrow
