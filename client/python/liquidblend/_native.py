"""The C API of libliquidblend.so.1: its structs, its functions, and where it is found.

A struct here has the members of liquidblend/liquidblend.h in the same order; a test compares sizes
and offsets with the header.
"""

from __future__ import annotations

import ctypes
import os
import pathlib
import re
import threading
from ctypes import CFUNCTYPE, POINTER, c_char_p, c_double, c_float, c_int32, c_int64
from ctypes import c_size_t, c_uint32, c_void_p
from typing import Any, Callable, List, Optional, Tuple

FILE_NAME = "libliquidblend.so.1"
PATH_VARIABLE = "LIQUIDBLEND_LIBRARY"

NORMALS, VELOCITIES, REST_POSITIONS = 1, 2, 4


class SizedStructure(ctypes.Structure):
    """A struct whose first member is struct_size."""

    def __init__(self, **members: Any) -> None:
        super().__init__(struct_size=ctypes.sizeof(type(self)), **members)


class ConnectOptions(SizedStructure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("target", c_char_p),
        ("token", c_char_p),
        ("tls", c_int32),
        ("tls_ca", c_char_p),
        ("tls_cert", c_char_p),
        ("tls_key", c_char_p),
        ("tls_server_name", c_char_p),
        ("connect_timeout_s", c_double),
        ("call_timeout_s", c_double),
        ("patience_s", c_double),
        ("allocator", c_void_p),
        ("traceparent", c_char_p),
    ]


class FamilyInfo(SizedStructure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("name", c_char_p),
        ("version", c_int64),
        ("source", c_char_p),
        ("num_targets", c_size_t),
        ("targets", POINTER(c_char_p)),
        ("duration_s", c_double),
        ("frames_per_second", c_double),
        ("up", c_int32),
        ("bounds_min", c_double * 3),
        ("bounds_max", c_double * 3),
        ("num_levels", c_int32),
        ("num_parameters", c_size_t),
        ("parameters", POINTER(c_char_p)),
        ("points", POINTER(c_double)),
        ("json", c_char_p),
    ]


class OperationInfo(SizedStructure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("name", c_char_p),
        ("subject", c_char_p),
        ("stage", c_char_p),
        ("fraction", c_double),
        ("seconds_elapsed", c_double),
        ("seconds_left", c_double),
        ("done", c_int32),
        ("status", c_int32),
        ("error", c_char_p),
        ("reason", c_char_p),
        ("waiting_for", c_char_p),
        ("version", c_int64),
        ("grade", c_int32),
    ]


class ImportRequest(SizedStructure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("animation", c_char_p),
        ("directory", c_char_p),
        ("pattern", c_char_p),
        ("frames_per_second", c_double),
        ("vertex_scale", c_double),
        ("velocity_scale", c_double),
        ("voxel_size_m", c_double),
        ("up", c_int32),
        ("allow_gaps", c_int32),
        ("priority", c_int32),
        ("reserved", c_int32),
    ]


class Correspondence(SizedStructure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("target", c_int32),
        ("kind", c_int32),
        ("hard", c_int32),
        ("source_position", c_double * 3),
        ("source_time_s", c_double),
        ("target_position", c_double * 3),
        ("target_time_s", c_double),
        ("length_s", c_double),
    ]


class Option(ctypes.Structure):
    _fields_ = [("name", c_char_p), ("value", c_char_p)]


class RegisterRequest(SizedStructure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("family", c_char_p),
        ("source", c_char_p),
        ("num_targets", c_size_t),
        ("targets", POINTER(c_char_p)),
        ("num_correspondences", c_size_t),
        ("correspondences", POINTER(Correspondence)),
        ("num_parameters", c_size_t),
        ("parameters", POINTER(c_char_p)),
        ("points", POINTER(c_double)),
        ("refine", c_int32),
        ("replace", c_int32),
        ("required_grade", c_int32),
        ("priority", c_int32),
        ("num_options", c_size_t),
        ("options", POINTER(Option)),
    ]


class Parameter(ctypes.Structure):
    _fields_ = [("name", c_char_p), ("value", c_double)]


class Surface(SizedStructure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("attributes", c_uint32),
        ("level_of_detail", c_int32),
        ("smoothing_passes", c_int32),
        ("temporal_smoothing", c_double),
        ("position_bits", c_int32),
        ("reserved", c_int32),
        ("smoothing_strength", c_double),
        ("laplacian", c_int32),
        ("reserved_2", c_int32),
    ]


class FrameRequest(SizedStructure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("family", c_char_p),
        ("version", c_int64),
        ("num_weights", c_size_t),
        ("weights", POINTER(c_double)),
        ("num_parameters", c_size_t),
        ("parameters", POINTER(Parameter)),
        ("extrapolate", c_int32),
        ("time_s", c_double),
        ("surface", POINTER(Surface)),
    ]


class FrameInfo(SizedStructure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("num_vertices", c_uint32),
        ("num_triangles", c_uint32),
        ("positions", c_void_p),
        ("normals", c_void_p),
        ("velocities", c_void_p),
        ("rest_positions", c_void_p),
        ("triangles", c_void_p),
        ("bounds_min", c_float * 3),
        ("bounds_max", c_float * 3),
        ("time_s", c_double),
        ("num_weights", c_size_t),
        ("weights", POINTER(c_double)),
        ("version", c_int64),
        ("level_of_detail", c_int32),
        ("extrapolated", c_int32),
        ("clamped", c_int32),
        ("velocity_scale", c_double),
    ]


class StreamRequest(SizedStructure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("family", c_char_p),
        ("version", c_int64),
        ("num_weights", c_size_t),
        ("weights", POINTER(c_double)),
        ("num_parameters", c_size_t),
        ("parameters", POINTER(Parameter)),
        ("extrapolate", c_int32),
        ("surface", POINTER(Surface)),
        ("time_s", c_double),
        ("rate", c_double),
        ("frames_per_second", c_double),
        ("loop", c_int32),
        ("live", c_int32),
        ("adapts_detail", c_int32),
        ("reserved", c_int32),
    ]


LogFunction = CFUNCTYPE(None, c_void_p, c_char_p)


class PlayerOptions(SizedStructure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("file", c_char_p),
        ("connect", POINTER(ConnectOptions)),
        ("family", c_char_p),
        ("version", c_int64),
        ("surface", POINTER(Surface)),
        ("frames_per_second", c_double),
        ("look_ahead_s", c_double),
        ("num_threads", c_int32),
        ("fixed_detail", c_int32),
        ("transport", c_int32),
        ("allocator", c_void_p),
        ("log", LogFunction),
        ("log_user", c_void_p),
    ]


class PlayerInfo(SizedStructure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("num_shown", c_int64),
        ("num_missed", c_int64),
        ("num_stale", c_int64),
        ("num_received", c_int64),
        ("num_bytes", c_int64),
        ("wait_ms", c_double),
        ("decode_ms", c_double),
        ("latency_ms", c_double),
        ("level_of_detail", c_int32),
        ("transport", c_int32),
        ("status", c_int32),
    ]


# The names of the structs in the header.
STRUCTS = {
    "lb_connect_options": ConnectOptions,
    "lb_family_info": FamilyInfo,
    "lb_operation_info": OperationInfo,
    "lb_import_request": ImportRequest,
    "lb_correspondence": Correspondence,
    "lb_option": Option,
    "lb_register_request": RegisterRequest,
    "lb_parameter": Parameter,
    "lb_surface": Surface,
    "lb_frame_request": FrameRequest,
    "lb_frame_info": FrameInfo,
    "lb_stream_request": StreamRequest,
    "lb_player_options": PlayerOptions,
    "lb_player_info": PlayerInfo,
}

_OUT = POINTER(c_void_p)

# Each function: what it returns, and its arguments. Handles are void pointers.
FUNCTIONS = {
    "lb_status_name": (c_char_p, [c_int32]),
    "lb_last_error": (c_char_p, []),
    "lb_last_error_reason": (c_char_p, []),
    "lb_version": (c_int32, []),
    "lb_client_connect": (c_int32, [POINTER(ConnectOptions), _OUT]),
    "lb_client_free": (None, [c_void_p]),
    "lb_client_get_family": (c_int32, [c_void_p, c_char_p, c_int64, _OUT]),
    "lb_client_rollback_family": (c_int32, [c_void_p, c_char_p, c_int64, _OUT]),
    "lb_family_describe": (None, [c_void_p, POINTER(FamilyInfo)]),
    "lb_family_free": (None, [c_void_p]),
    "lb_text_get": (c_char_p, [c_void_p]),
    "lb_text_free": (None, [c_void_p]),
    "lb_client_list_families": (c_int32, [c_void_p, _OUT]),
    "lb_client_list_animations": (c_int32, [c_void_p, _OUT]),
    "lb_client_list_operations": (c_int32, [c_void_p, _OUT]),
    "lb_client_get_animation": (c_int32, [c_void_p, c_char_p, _OUT]),
    "lb_client_delete_animation": (c_int32, [c_void_p, c_char_p]),
    "lb_client_delete_family": (c_int32, [c_void_p, c_char_p]),
    "lb_client_download": (c_int32, [c_void_p, c_char_p, c_int64, c_char_p]),
    "lb_operation_describe": (None, [c_void_p, POINTER(OperationInfo)]),
    "lb_operation_free": (None, [c_void_p]),
    "lb_client_import": (c_int32, [c_void_p, POINTER(ImportRequest), _OUT]),
    "lb_client_register": (c_int32, [c_void_p, POINTER(RegisterRequest), _OUT]),
    "lb_client_get_operation": (c_int32, [c_void_p, c_char_p, _OUT]),
    "lb_client_cancel": (c_int32, [c_void_p, c_char_p]),
    "lb_client_watch_for": (
        c_int32,
        [c_void_p, c_char_p, c_double, c_void_p, c_void_p, _OUT],
    ),
    "lb_client_get_frame": (c_int32, [c_void_p, POINTER(FrameRequest), _OUT]),
    "lb_frame_describe": (None, [c_void_p, POINTER(FrameInfo)]),
    "lb_frame_free": (None, [c_void_p]),
    "lb_stream_open": (c_int32, [c_void_p, POINTER(StreamRequest), _OUT]),
    "lb_stream_next": (c_int32, [c_void_p, _OUT]),
    "lb_stream_cancel": (None, [c_void_p]),
    "lb_stream_free": (None, [c_void_p]),
    "lb_player_open": (c_int32, [POINTER(PlayerOptions), _OUT]),
    "lb_player_free": (None, [c_void_p]),
    "lb_player_describe": (None, [c_void_p, POINTER(FamilyInfo)]),
    "lb_player_set_weights": (c_int32, [c_void_p, c_size_t, POINTER(c_double), c_double]),
    "lb_player_set_parameters": (
        c_int32,
        [c_void_p, c_size_t, POINTER(Parameter), c_int32, c_double],
    ),
    "lb_player_play": (None, [c_void_p]),
    "lb_player_pause": (None, [c_void_p]),
    "lb_player_set_loop": (None, [c_void_p, c_int32]),
    "lb_player_set_rate": (c_int32, [c_void_p, c_double]),
    "lb_player_seek": (c_int32, [c_void_p, c_double]),
    "lb_player_poll": (c_void_p, [c_void_p, c_double]),
    "lb_player_wait_exact": (c_int32, [c_void_p, c_double, c_double, _OUT]),
    "lb_player_statistics": (None, [c_void_p, POINTER(PlayerInfo)]),
}


def candidates() -> List[str]:
    """Where the library is looked for, in this order. A bare name is looked for by the system."""
    given = os.environ.get(PATH_VARIABLE)
    if given:
        return [given]
    package = pathlib.Path(__file__).resolve().parent
    beside = [package / FILE_NAME, package.parent / FILE_NAME]
    # Layout that cmake installs: PREFIX/share/liquidblend/python/liquidblend and PREFIX/lib.
    if len(package.parents) > 3:
        beside.append(package.parents[3] / "lib" / FILE_NAME)
    return [str(path) for path in beside if path.exists()] + [FILE_NAME]


def _open(paths: List[str]) -> ctypes.CDLL:
    failures = []
    for path in paths:
        try:
            return ctypes.CDLL(path)
        except OSError as error:
            failures.append(str(error))
    raise FileNotFoundError(
        f"liquidblend's library cannot be loaded ({'; '.join(failures)}). Set {PATH_VARIABLE} to "
        f"the path of {FILE_NAME}, or put it into {pathlib.Path(__file__).parent}, or where the "
        "system looks for libraries"
    )


def _declare(library: ctypes.CDLL) -> None:
    for name, (result, arguments) in FUNCTIONS.items():
        try:
            function = getattr(library, name)
        except AttributeError:
            raise ImportError(
                f"{library._name} is older than this Python package: it has no {name}"
            ) from None
        function.restype = result
        function.argtypes = arguments


_lock = threading.Lock()
_library: Optional[ctypes.CDLL] = None


def library() -> ctypes.CDLL:
    """The library, loaded by the first call.

    Raises: FileNotFoundError if it is nowhere, ImportError if it is too old.
    """
    global _library
    with _lock:
        if _library is None:
            opened = _open(candidates())
            _declare(opened)
            _library = opened
        return _library


def function(name: str) -> Callable[..., Any]:
    found: Callable[..., Any] = getattr(library(), name)
    return found


# Control characters, of which some are commands to a terminal; ends of lines; half characters.
_UNFIT = re.compile("[\x00-\x1f\x7f-\x9f\u2028\u2029\ud800-\udfff]")


def printable(text: str) -> str:
    """The text on one line, with "?" for what no name or message of an honest server has."""
    return _UNFIT.sub("?", text)


def text_of(value: bytes) -> str:
    """A printable text of the library's. A server may have said it, in any bytes."""
    return printable(value.decode(errors="replace"))


def vector(values: Any) -> Tuple[float, float, float]:
    x, y, z = values
    return (x, y, z)


class Handle:
    """Owns a handle of the C API, and frees it when nothing refers to it any more."""

    def __init__(self, pointer: int, free: str) -> None:
        self.pointer = pointer
        self._free = function(free)

    def __del__(self) -> None:
        self._free(self.pointer)
