// SPDX-License-Identifier: Apache-2.0
// VTK 9.1's header of its thread pool is not C++20, so this file is compiled as C++17.
#include "vtk_threads.hpp"

#include <vtkSMPTools.h>

std::string use_vtk_threads(int count) {
  vtkSMPTools::Initialize(count);
  return vtkSMPTools::GetBackend();
}
