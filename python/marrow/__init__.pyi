# SPDX-License-Identifier: Apache-2.0
from ._core import Camera as Camera, Case as Case, Cost as Cost, EdgeMap as EdgeMap, Image as Image
from ._core import Landmarks as Landmarks, Landscape as Landscape, Mesh as Mesh, Metrics as Metrics, Minimum as Minimum
from ._core import Optimizer as Optimizer, OtherValue as OtherValue, OutlineProjector as OutlineProjector
from ._core import Picture as Picture, Pose as Pose, Profile as Profile, RadiographProjector as RadiographProjector
from ._core import Scene as Scene, Seeds as Seeds, ShaftLines as ShaftLines, SignedField as SignedField, Stop as Stop
from ._core import Transform as Transform, Truth as Truth, Verdict as Verdict, View as View, Volume as Volume
from ._core import _version as __version__, forget_catalogue as find_plugins_again
from .annotations import as_many_or_none as as_many_or_none, at_least as at_least, at_least_one as at_least_one
from .annotations import at_most as at_most, below as below, beside as beside, distinct as distinct
from .annotations import exactly_one as exactly_one, figures as figures, length as length, named as named
from .annotations import not_above as not_above, over as over, replaces as replaces, same_length as same_length
from .annotations import unit as unit
from .comparison import Comparison as Comparison, compare as compare
from .context import Context as Context
from .declaration import cost as cost, projector as projector
from .errors import Error as Error, Fault as Fault, PipelineError as PipelineError, RunError as RunError
from .files import load as load, save as save
from .items import Items as Items
from .nodes import *
from .pages import show as show
from .pipeline import Pipeline as Pipeline
from .problem import BudgetSpent as BudgetSpent, Problem as Problem
from .result import NodeReport as NodeReport, Result as Result
from .tables import Table as Table
