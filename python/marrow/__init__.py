# SPDX-License-Identifier: Apache-2.0
"""marrow finds the 3D pose of bones in X-ray images, by pipelines of plugins described in YAML.

p = marrow.Pipeline("pipelines/femur/femur.yaml", case="cases/7")
r = p.run(progress=True)
r["pose"]["distal"].matrix

Each node of a plugin is also a function: marrow.edges.canny(view, noise_high=5).
"""
from . import display as _display
from . import nodes as _nodes
from . import plots as _plots
from ._core import Camera, Case, Cost, EdgeMap, Image, Landmarks, Landscape, Mesh, Metrics, Minimum, Optimizer
from ._core import OtherValue, OutlineProjector, Picture, Pose, Profile, RadiographProjector, Scene, Seeds, ShaftLines
from ._core import SignedField, Stop, Transform, Truth, Verdict, View, Volume
from ._core import _version as __version__
from ._core import forget_catalogue as find_plugins_again
from .annotations import as_many_or_none, at_least, at_least_one, at_most, below, beside, distinct, exactly_one, figures
from .annotations import length, named, not_above, over, replaces, same_length, unit
from .comparison import Comparison, compare
from .context import Context
from .declaration import cost, projector
from .errors import Error, Fault, PipelineError, RunError
from .files import load, save
from .items import Items
from .nodes import Kind, Node, node
from .pages import show
from .pipeline import Pipeline
from .problem import BudgetSpent, Problem
from .result import NodeReport, Result
from .tables import Table

__all__ = [name for name in dir() if not name.startswith("_")]


def __getattr__(name):
    return getattr(_nodes, name)


def __dir__():
    return sorted(set(__all__) | set(dir(_nodes)))
