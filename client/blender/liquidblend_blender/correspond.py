"""Pairs of empties, as correspondences of a registration."""

from . import ask, mapping


class PairError(Exception):
    """A pair that cannot be used; the text names it."""


def _place(object, empty, frame, scene, which):
    """(position, seconds) of an empty in the liquid's family."""
    if empty is None:
        raise PairError(f"{which} has no empty")
    local = object.matrix_world.inverted() @ empty.matrix_world.translation
    time_s = ask.time_mapping(object.liquidblend, scene).unclamped(frame)
    if time_s < 0.0:
        raise PairError(f"{which} is at frame {frame:g}, before the family begins")
    return mapping.to_family_axes(local, object.liquidblend.up), time_s


def correspondences_of(object, scene):
    """The pairs of a liquid as a list of dictionaries, as connection.register() takes them."""
    found = []
    for number, pair in enumerate(object.liquidblend.pairs):
        source, source_time = _place(object, pair.source, pair.source_frame, scene,
                                     f"the source of pair {number}")
        target, target_time = _place(object, pair.target, pair.target_frame, scene,
                                     f"the target of pair {number}")
        found.append({
            "target": pair.target_index, "kind": pair.kind, "hard": pair.hard,
            "source_position": source, "source_time_s": source_time,
            "target_position": target, "target_time_s": target_time,
            "length_s": 0.0 if pair.kind == 'point' else pair.length_s})
    return found


def add_pair(object, source, target, frame):
    """Adds a pair at a frame of the scene."""
    pair = object.liquidblend.pairs.add()
    pair.source, pair.target = source, target
    pair.source_frame = pair.target_frame = frame
    object.liquidblend.active_pair = len(object.liquidblend.pairs) - 1
    return pair
