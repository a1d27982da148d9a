"""All that the add-on asks of the Python package `liquidblend`: frames, facts, jobs. It is imported
by the first call that needs it, since a baked folder plays without it."""

import contextlib
import dataclasses
import importlib
import os
import queue
import sys
import threading
import time
from typing import List, Tuple

from . import bake_files, preferences, surface, trust
from .request import Request
from .tasks import Cancelled

_VENDOR = os.path.join(os.path.dirname(os.path.abspath(__file__)), "vendor")
_WEIGHT_RANGE = (-1.0, 2.0)  # a server takes no others
_SHORT_CONNECT_S = 2.0
_ANSWER_S = 10.0  # that Blender's window waits for an answer at Connect
_LOOK_S = 0.5  # how often a task looks whether the user has stopped it
_CANCEL_S = 2.0  # that a task which is stopped waits for the server to end the job
_SERVED_S = 30.0  # that servers have at least to load what a job has made
_RETRY_S = 0.5
_MAX_PLAYERS = 4  # each holds a file's index

_lock = threading.Lock()
_generation = 0  # of disconnect()
_clients = {}
_players = {}
_indices = {}


def package():
    """The package: the one in the add-on's zip, or else one that Python finds.

    Raises ImportError if there is none; the library is looked for by the first call.
    """
    library = preferences.get("library")
    if library:
        os.environ.setdefault("LIQUIDBLEND_LIBRARY", library)
    if os.path.isdir(_VENDOR) and _VENDOR not in sys.path:
        sys.path.insert(0, _VENDOR)
    return importlib.import_module("liquidblend")


@dataclasses.dataclass(frozen=True)
class Facts:
    """Of a family."""

    up: str
    duration_s: float
    frames_per_second: float
    version: int  # 0: of a file
    controls: List[Tuple]  # as settings.set_controls() takes them


@dataclasses.dataclass(frozen=True)
class Registration:
    family: str
    source: str
    targets: List[str]
    correspondences: List[dict]
    mode: str  # 'NEW', 'REPLACE' or 'REFINE'


def disconnect():
    """Forgets clients, players and indices. Those in use live until their call is done."""
    global _generation
    with _lock:
        _generation += 1
        for kept in (_clients, _players, _indices):
            kept.clear()


# ---- clients and players, one for each server or file


def _patience():
    return max(float(preferences.get("patience_s")), 0.001)


def _kept(kept, key, make):
    """What is kept under a key, made by the first who needs it. Making it may wait for a server,
    and nobody waits for that here; of two that are made at once, one is dropped."""
    with _lock:
        if key in kept:
            kept[key] = kept.pop(key)  # the last used comes last
            return kept[key]
        generation = _generation
    made = make()
    with _lock:
        return kept.setdefault(key, made) if generation == _generation else made


@contextlib.contextmanager
def _client_of(origin, is_patient=True):
    """A client of the origin's servers, which get the token if they are trusted (trust.py). What
    they refuse is told with why they do not get it. A patient one waits for servers that are gone.
    """
    servers = trust.servers_of(origin.place)

    def connect():
        return package().Client(
            servers, token=trust.token_for(servers) or None, tls=origin.tls,
            tls_ca=origin.tls_ca or None, patience=_patience() if is_patient else 0.0,
            connect_timeout=None if is_patient else _SHORT_CONNECT_S)

    try:
        yield _kept(_clients, (servers, origin.tls, origin.tls_ca, is_patient), connect)
    except (package().Unauthenticated, package().PermissionDenied) as error:
        why = trust.why_kept_back(servers)
        if not why:
            raise
        raise type(error)(error.code, f"{error.message}; {why}", error.reason) from error


class _FilePlayer:
    """A family's file. Its weights belong to the player, so one thread at a time asks it."""

    def __init__(self, path, attributes):
        if not os.path.isfile(path):
            raise FileNotFoundError(f"there is no family's file {path!r}")
        self._lock = threading.Lock()
        self._player = package().Player.open(
            file=path, surface=package().SurfaceOptions(**attributes), look_ahead=0.0)
        self.family = self._player.family

    def frame(self, request):
        with self._lock:
            if request.parameters:
                self._player.set_parameters(dict(request.parameters))
            elif request.weights:
                self._player.set_weights(request.weights)
            return self._player.wait_exact(request.time_s, _patience())


def _attributes_of(request):
    return {"velocities": request.velocities, "normals": request.normals,
            "rest_positions": request.rest_positions,
            "level_of_detail": request.level_of_detail,
            "smoothing_passes": request.smoothing_passes}


def _player_of(path, attributes):
    key = (path, tuple(sorted(attributes.items())))
    player = _kept(_players, key, lambda: _FilePlayer(path, attributes))
    with _lock:
        for old in list(_players)[:-_MAX_PLAYERS]:
            del _players[old]
    return player


def _index_of(folder):
    return _kept(_indices, folder, lambda: bake_files.read_index(folder))


# ---- frames


def _frame_of(request, is_patient):
    """Asks until the patience is over. The clients do not wait themselves: the deadline here holds
    for a connection that is lost midway, too."""
    deadline = time.monotonic() + (_patience() if is_patient else 0.0)
    while True:
        try:
            return _frame_now(request)
        except (package().Unavailable, package().ResourceExhausted, package().Aborted,
                package().DeadlineExceeded):  # away, busy, or too slow this time
            if time.monotonic() >= deadline:
                raise
            time.sleep(_RETRY_S)


def _frame_now(request):
    attributes = _attributes_of(request)
    if request.origin.kind == 'FILE':
        return _player_of(request.origin.place, attributes).frame(request)
    blend = ({"parameters": dict(request.parameters)} if request.parameters
             else {"weights": request.weights})
    with _client_of(request.origin, False) as client:
        return client.frame(request.origin.family, version=request.origin.version,
                            time=request.time_s, **blend, **attributes)


def _baked(request):
    folder = request.origin.place
    index = _index_of(folder)
    arrays = bake_files.read_frame(folder, index, request.time_s)
    wanted = {"positions", "triangles"}
    wanted |= {name for name in ("velocities", "normals", "rest_positions")
               if getattr(request, name)}
    arrays = {name: values for name, values in arrays.items() if name in wanted}
    # A frame may be longer or shorter now than where it was baked.
    return surface.make_surface(arrays, velocity_scale=(request.fps or index["fps"]) / index["fps"])


def make_surface(request, is_patient):
    """The surface that a request asks for. Any thread; raises what is wrong, in words.

    is_patient  waits for a server that is gone, as a render does
    """
    if request.origin.kind == 'BAKE':
        return _baked(request)
    if request.origin.kind == 'SERVER' and not request.origin.family:
        raise ValueError("no family is chosen")
    frame = _frame_of(request, is_patient)
    arrays = {"positions": frame.positions, "triangles": frame.triangles,
              "velocities": frame.velocities, "normals": frame.normals,
              "rest_positions": frame.rest_positions}
    return surface.make_surface(arrays, request.up, request.velocity_scale)


# ---- facts


def _start(ask):
    """Calls ask() on a thread of its own, which nobody has to wait for: a server may answer late or
    never. Returns a queue that gets what it returns, and what it raises."""
    answers = queue.SimpleQueue()

    def work():
        try:
            answers.put((ask(), None))
        except BaseException as error:
            answers.put((None, error))

    threading.Thread(target=work, daemon=True, name="liquidblend").start()
    return answers


def _answered(ask, origin):
    """What ask() returns. Connect holds up Blender's window, so nobody waits after _ANSWER_S."""
    try:
        answer, error = _start(ask).get(timeout=_ANSWER_S)
    except queue.Empty:
        raise TimeoutError(f"no answer of {trust.servers_of(origin.place)} within {_ANSWER_S:g} s"
                           ) from None
    if error is not None:
        raise error
    return answer


def family_names(origin):
    def ask():
        with _client_of(origin, False) as client:
            return client.families()

    return _answered(ask, origin)


def _family_of(origin):
    if origin.kind == 'FILE':
        attributes = _attributes_of(Request(origin, 0.0))
        return _player_of(origin.place, attributes).family
    if not origin.family:
        raise ValueError("no family is chosen")

    def ask():
        with _client_of(origin, False) as client:
            return client.family(origin.family, origin.version)

    return _answered(ask, origin)


def _up_of(family):
    name = family.up.name  # "MINUS_X"
    return "z" if name == "UNKNOWN" else name.lower().replace("minus_", "-")


def _controls_of(family):
    """Parameters of a family that has them, or else the weights of its targets."""
    if not family.parameters:
        return [(name, False, 0.0, *_WEIGHT_RANGE, 0.0, 1.0) for name in family.targets]
    controls = []
    for i, name in enumerate(family.parameters):
        values = [point[i] for point in family.points]
        span = (min(values), max(values))
        controls.append((name, True, values[0], *span, *span))
    return controls


def describe(origin):
    """The Facts of a family."""
    family = _family_of(origin)
    return Facts(_up_of(family), family.duration, family.frames_per_second, family.version, _controls_of(family))


# ---- files


def ply_bytes(attributes, triangles):
    """As of the package's liquidblend.ply."""
    return importlib.import_module(f"{package().__name__}.ply").ply_bytes(attributes, triangles)


# ---- jobs


class _Errand:
    """A job that is begun and waited for on a thread of its own, as a server may hold up any call.
    The task's thread looks after it, and leaves it behind if the user stops the task."""

    def __init__(self, origin, begin, stage, unanswered):
        """
        begin       gives the job, of a client
        stage       what is done till then
        unanswered  what may happen then although the task is stopped
        """
        self._origin, self._begin, self._unanswered = origin, begin, unanswered
        self._shown = (stage, 0.0)
        self._job = None
        self._is_left = False

    def run(self, report):
        """The job's last state. Called by the task's thread."""
        answers = _start(self._work)
        try:
            while True:
                report(*self._shown)
                try:
                    state, error = answers.get(timeout=_LOOK_S)
                    break
                except queue.Empty:
                    pass
        except Cancelled:
            raise Cancelled(self._leave()) from None
        if error is not None:
            raise error
        return state

    def _leave(self):
        """Ends the job, if there is one; returns what the user has to know."""
        self._is_left = True  # first: _work() looks at it when it has the job
        job = self._job
        if job is None:
            return f"stopped; {self._unanswered}"
        if job.state.done:
            return f"stopped; {job.name} is done at the server"
        try:
            _, error = _start(job.cancel).get(timeout=_CANCEL_S)
        except queue.Empty:
            error = TimeoutError()
        return "stopped" if error is None else f"stopped; {job.name} may go on at the server"

    def _work(self):
        with _client_of(self._origin) as client:
            self._job = job = self._begin(client)
            if self._is_left:
                job.cancel()
                raise Cancelled("stopped")
            return self._wait(job)

    def _wait(self, job):
        while True:
            next_look = time.monotonic() + _LOOK_S
            try:
                return job.wait(self._tell, timeout=_LOOK_S)
            except package().DeadlineExceeded:
                if job.state.done:  # only its servers are waited for
                    return job.wait(self._tell, timeout=max(_patience(), _SERVED_S))
            # A server may say at once that its time is up, before wait() has told anything.
            time.sleep(max(next_look - time.monotonic(), 0.0))
            self._tell(job.state)

    def _tell(self, state):
        self._shown = (state.waiting_for or state.stage, state.fraction)
        if self._is_left:
            raise Cancelled("stopped")


def import_animation(origin, animation, folder, options, report):
    """Uploads and imports the frames of a folder; returns a line for the user.

    options  those of Client.import_animation(), with `up` as "z", or None where it is not known
    """
    options = dict(options)
    up = options.pop("up", None)
    name = (up or "unknown").upper().replace("-", "MINUS_")
    options["up"] = package().Up[name]
    _Errand(origin, lambda client: client.import_animation(animation, folder, **options), "upload",
            "the upload may go on for a while, and the server may import it").run(report)
    return f"animation {animation} is imported"


def _correspondence_of(pair):
    kinds = package().CorrespondenceKind
    return package().Correspondence(
        source_position=pair["source_position"], source_time=pair["source_time_s"],
        target_position=pair["target_position"], target_time=pair["target_time_s"],
        target=pair["target"], kind=kinds[pair["kind"].upper()], hard=pair["hard"],
        length=pair["length_s"])


def _begin_registration(client, registration):
    source, targets = registration.source, registration.targets
    if registration.mode == 'REFINE' and not (source or targets):
        family = client.family(registration.family)
        source, targets = family.source, family.targets
    return client.register(
        registration.family, source, targets,
        correspondences=[_correspondence_of(pair) for pair in registration.correspondences],
        replace=registration.mode == 'REPLACE', refine=registration.mode == 'REFINE')


def register(origin, registration, report):
    """Registers a family; returns a line for the user."""
    errand = _Errand(origin, lambda client: _begin_registration(client, registration), "request",
                     "the server may have got the request, and register it")
    state = errand.run(report)
    grade = state.grade.name.lower().replace("_", " ")
    return f"family {registration.family}, version {state.version}: {grade}"
