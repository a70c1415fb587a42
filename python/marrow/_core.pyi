# SPDX-License-Identifier: Apache-2.0
from typing import Any, Callable, Dict, Final, Iterable, Iterator, List, Mapping, Optional, Sequence, Tuple, Union
from typing import overload

import numpy
import numpy.typing

from .items import Items

Array = numpy.ndarray[Any, Any]
ArrayLike = numpy.typing.ArrayLike
_Ends = Tuple[Tuple[float, float], Tuple[float, float]]
Texts = Sequence[Tuple[str, str]]
Faults = List[Dict[str, Any]]

_version: str

class Buffer: ...

class Transform:
    def __init__(self, matrix: ArrayLike, *, target: str = "world", source: str = "ct") -> None: ...
    matrix: Final[Array]
    target: Final[str]
    source: Final[str]
    def inverse(self) -> Transform: ...
    @overload
    def __matmul__(self, other: Transform) -> Transform: ...
    @overload
    def __matmul__(self, other: ArrayLike) -> Array: ...

class Image:
    type: str
    def __init__(self, array: ArrayLike) -> None: ...
    array: Final[Array]
    width: Final[int]
    height: Final[int]

class Picture:
    type: str
    array: Final[Array]

class _Samples:
    type: str
    array: Final[Array]
    size: Final[Tuple[int, int, int]]
    spacing_mm: Final[Tuple[float, float, float]]
    origin_mm: Final[Tuple[float, float, float]]
    direction: Final[Array]
    frame: Final[str]
    def __init__(
        self,
        array: ArrayLike,
        *,
        spacing_mm: ArrayLike,
        origin_mm: Optional[ArrayLike] = None,
        direction: Optional[ArrayLike] = None,
        frame: str = "ct",
    ) -> None: ...

class Volume(_Samples): ...
class SignedField(_Samples): ...

class Mesh:
    type: str
    def __init__(self, vertices_mm: ArrayLike, triangles: ArrayLike, *, frame: str = "ct") -> None: ...
    vertices_mm: Final[Array]
    triangles: Final[Array]
    frame: Final[str]

class Camera:
    type: str
    def __init__(self, width_px: int, height_px: int, intrinsics: ArrayLike, camera_from_world: ArrayLike) -> None: ...
    width_px: Final[int]
    height_px: Final[int]
    intrinsics: Final[Array]
    camera_from_world: Final[Array]

class View:
    type: str
    def __init__(
        self, image: Union[Image, ArrayLike], camera: Camera, *, mask: Optional[ArrayLike] = None, name: str = "view"
    ) -> None: ...
    name: Final[str]
    image: Final[Image]
    camera: Final[Camera]
    mask: Final[Optional[Array]]

class Pose:
    type: str
    def __init__(
        self, matrix: ArrayLike, *, target: str = "world", source: str = "ct", axes_of: Optional["Pose"] = None
    ) -> None: ...
    matrix: Final[Array]
    transform: Final[Transform]
    target: Final[str]
    source: Final[str]
    covariance: Final[Optional[Array]]
    axes: Final[Array]
    origin_mm: Final[Array]
    warnings: Final[List[str]]
    cost: Final[float]
    evaluations: Final[int]
    convergence: Final[List[Tuple[int, float]]]

class Truth:
    type: str
    matrix: Final[Array]
    transform: Final[Transform]

class Seeds:
    type: str
    def __init__(self, fragment: str, points_mm: ArrayLike, *, wanted: bool = True) -> None: ...
    fragment: Final[str]
    wanted: Final[bool]
    points_mm: Final[Array]

class Landmarks:
    type: str
    def __init__(self, points_mm: Dict[str, Any], seen_px: Dict[str, Dict[str, Any]] = {}) -> None: ...
    points_mm: Final[Dict[str, Array]]
    seen_px: Final[Dict[str, Dict[str, Array]]]

class Scene:
    type: str
    models: Final[Dict[str, Mesh]]
    placements: Final[List[Tuple[str, str, Array]]]

class EdgeMap:
    type: str
    def __init__(self, pixels: ArrayLike, *, width_px: int, height_px: int) -> None: ...
    width_px: Final[int]
    height_px: Final[int]
    pixels: Final[Array]
    def __len__(self) -> int: ...

class ShaftLines:
    type: str
    def __init__(
        self,
        left: ArrayLike,
        right: ArrayLike,
        *,
        width_mm: float,
        width_deviation_mm: float,
        log_likelihood: float = 0.0,
        rejected: Iterable[Tuple[ArrayLike, ArrayLike, str]] = ...,
    ) -> None: ...
    log_likelihood: Final[float]
    rejected: Final[List[Tuple[_Ends, _Ends, str]]]
    left: Final[_Ends]
    right: Final[_Ends]
    width_mm: Final[float]
    width_deviation_mm: Final[float]

class Metrics:
    type: str
    def __init__(self, values: Dict[str, float], units: Dict[str, str] = ...) -> None: ...
    values: Final[Dict[str, float]]
    units: Final[Dict[str, str]]
    def __getitem__(self, name: str) -> float: ...
    def __len__(self) -> int: ...
    def __iter__(self) -> Iterator[str]: ...

class Verdict:
    type: str
    def __init__(
        self,
        judgement: str,
        *,
        failure_probability: Optional[float] = None,
        reasons: List[str] = ...,
        remedies: List[str] = ...,
        figures: Metrics = ...,
    ) -> None: ...
    judgement: Final[str]
    failure_probability: Final[Optional[float]]
    reasons: Final[List[str]]
    remedies: Final[List[str]]
    figures: Final[Dict[str, float]]

class Stop:
    type: str
    stops: Final[bool]
    reason: Final[str]

class Profile:
    axis: Final[str]
    unit: Final[str]
    offsets: Final[Array]
    costs: Final[Array]
    truth: Final[Optional[float]]

class Landscape:
    type: str
    profiles: Final[List[Profile]]
    def plot(self, figure: Any = None) -> Any: ...

class Case:
    type: str
    ct: Final[Volume]
    views: Final[Items[Any]]
    seeds: Final[Items[Any]]
    start: Final[Optional[Items[Any]]]
    truth: Final[Optional[Items[Any]]]

class OtherValue:
    type: Final[str]

def digest_of(value: Any) -> Optional[str]:
    """A text that is the same for values of the same content, of types of plugins too. None for functions, lists and
    what is no value of marrow."""

def extension_of(value: Any) -> str: ...
def write_value(value: Any, file: str) -> None: ...
def unpickled(type: str, version: int, size: int, packed: bytes) -> Any: ...

_Pose = Union[Pose, ArrayLike]

class Cost(OtherValue):
    @overload
    def __call__(self, poses: Pose) -> float: ...
    @overload
    def __call__(self, poses: Union[ArrayLike, Sequence[_Pose], Mapping[str, _Pose]]) -> Any: ...

class RadiographProjector(OtherValue):
    def __call__(
        self, camera: Union[Camera, View], pose: _Pose, *, step_px: float = 1, pixels: Optional[ArrayLike] = None
    ) -> Array: ...

class OutlineProjector(OtherValue):
    def __call__(self, camera: Union[Camera, View], pose: _Pose, *, spacing_px: float = 1) -> Array: ...

class Minimum:
    x: Final[Array]
    value: Final[float]
    evaluations: Final[int]
    stopped_because: Final[str]

class Optimizer(OtherValue):
    def minimise(
        self,
        function: Callable[[Array], float],
        start: Optional[ArrayLike] = None,
        initial_step: Optional[ArrayLike] = None,
        *,
        lower: Optional[ArrayLike] = None,
        upper: Optional[ArrayLike] = None,
        max_evaluations: Optional[int] = None,
        step_tolerance: Optional[float] = None,
    ) -> Minimum: ...

class ReadPipeline:
    name: Final[str]
    help: Final[str]
    notes: Final[List[str]]
    nodes: Final[List[Tuple[str, str]]]
    outputs: Final[List[str]]
    def with_only(self, names: List[str]) -> ReadPipeline: ...
    def with_given(self, given: Dict[str, Any]) -> ReadPipeline: ...
    def resolved_yaml(self) -> str: ...

class Run:
    def output(self, name: str) -> Any: ...
    def write(self, folder: str) -> None: ...
    outputs: Final[List[str]]
    nodes: Final[List[Dict[str, Any]]]
    seconds: Final[float]
    failed: Final[bool]
    warnings: Final[List[Tuple[str, str]]]
    folder: Final[str]
    recipe: Final[Optional[str]]
    written: Final[List[Tuple[str, List[str], str, str]]]

def forget_catalogue() -> None:
    """Looks for plugins again when they are next needed."""

def node_names() -> List[str]: ...
def kind_names() -> List[str]: ...
def kind_summary(name: str) -> str: ...
def kind_info(name: str) -> Optional[Dict[str, Any]]: ...
def node_info(name: str) -> Optional[Dict[str, Any]]: ...
def type_description(id: str) -> Dict[str, Any]: ...
def end_with(parent: int) -> None: ...
def untrusted_among(files: List[bytes], owner_of_interpreter: int) -> str: ...

class ProcessState:
    def begin_call(self) -> None: ...
    def put_back(self) -> str: ...

def asked_function(type: str, function: int, key: str, ask: Callable[..., Any]) -> Any: ...
def mapped_input(file: str, type: str, samples_bytes: int) -> Tuple[Any, InputCheck]: ...
def loaded_libraries() -> List[bytes]: ...
def count_of_loaded_libraries() -> int: ...
def array_of_real(object: Any, type: str, what: str) -> Array: ...

class InputCheck:
    def holds(self) -> bool: ...

class Made:
    def __init__(self, outputs: List[Tuple[Any, str, str, str]]) -> None: ...
    def hand_over(self, descriptor: int, in_place: bool) -> int: ...

def remedy_for(missing_node: str) -> str: ...
def suggestion(wrong: str, known: List[str]) -> str: ...
def framework_file() -> str: ...
def read(file: str, inputs: Texts, changes: Texts, inputs_required: bool) -> Tuple[ReadPipeline, Faults, str]: ...
def read_node(name: str, inputs: Dict[str, Any], options: Texts) -> Tuple[ReadPipeline, Faults, str]: ...
def read_experiment(file: str) -> Tuple[str, Faults, str]: ...
def run(
    pipeline: ReadPipeline,
    observer: Optional[Callable[[Dict[str, Any]], None]],
    seed: int,
    threads: int,
    keep: bool,
    folder: Optional[str],
) -> Run: ...
