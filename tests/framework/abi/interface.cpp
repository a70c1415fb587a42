// SPDX-License-Identifier: Apache-2.0
// Names the types by which plugins and the framework talk. The debugging information of this file is the interface that
// abi_test.py compares: layouts, virtual functions, members.
#include <marrow/conformance.hpp>
#include <marrow/plugin.hpp>

namespace marrow::interface {

// What plugins register, and what they are called with.
void plugin(Plugin&, PluginEntry&, NodeDefinition&, KindDefinition&, WriterDefinition&, Context&, conformance::Suite&,
            conformance::Subject&) {}

// The values that travel between plugins.
void values(Value&, Image&, Picture&, Volume&, SignedField&, Seeds&, Mesh&, Camera&, View&, EdgeMap&, ShaftLines&,
            Landmarks&, Pose&, Truth&, Metrics&, Verdict&, Scene&, Landscape&, Case&, Calibration&) {}

// The functions that do.
void functions(OutlineProjector&, RadiographProjector&, Cost&, CostLevel&, Optimizer&, MinimisationProblem&,
               MinimisationResult&) {}

}  // namespace marrow::interface
