"""Surfaces that were made, and threads that make them ahead. Needs no Blender: nothing here may
touch its data, which belongs to the main thread."""

import collections
import threading


class SurfaceCache:
    """Surfaces by request. The ones used last are kept, within `max_bytes`.

    make  makes the surface of a request; called from any thread, also at the same time, with
          whether it shall wait for a server that is gone
    """

    def __init__(self, make, max_bytes=512 << 20, num_threads=2):
        self._make = make
        self.max_bytes = max_bytes
        self._changed = threading.Condition()
        self._surfaces = collections.OrderedDict()
        self._errors = {}
        self._wanted = []  # the most urgent one first
        self._running = set()
        self._is_open = True
        self._generation = 0
        self._threads = [threading.Thread(target=self._work, daemon=True, name="liquidblend")
                         for _ in range(num_threads)]
        for thread in self._threads:
            thread.start()

    def get(self, request, is_patient=True):
        """The surface, made now if need be. Raises what making it raises."""
        with self._changed:
            while request in self._running:
                self._changed.wait()
            surface = self._find(request)
            if surface is not None:
                return surface
            self._running.add(request)
            generation = self._generation
        return self._make_and_keep(request, generation, is_patient)

    def peek(self, request):
        """The surface, if it is there; None otherwise. Raises what making it has raised since it
        was wanted."""
        with self._changed:
            error = self._errors.get(request)
            if error is not None:
                raise error
            return self._find(request)

    def want(self, requests):
        """Surfaces to make ahead, the most urgent one first, instead of those wanted before."""
        with self._changed:
            self._wanted = [r for r in requests if r not in self._surfaces]
            self._errors.clear()
            self._changed.notify_all()

    def clear(self):
        """Forgets all surfaces: what they were made of has changed."""
        with self._changed:
            self._generation += 1
            self._surfaces.clear()
            self._errors.clear()
            self._wanted = []

    def close(self):
        with self._changed:
            self._is_open = False
            self._wanted = []
            self._changed.notify_all()

    def _find(self, request):
        surface = self._surfaces.get(request)
        if surface is not None:
            self._surfaces.move_to_end(request)
        return surface

    def _keep(self, request, surface):
        self._surfaces[request] = surface
        num_bytes = sum(kept.num_bytes for kept in self._surfaces.values())
        while num_bytes > self.max_bytes and len(self._surfaces) > 1:
            num_bytes -= self._surfaces.popitem(last=False)[1].num_bytes

    def _make_and_keep(self, request, generation, is_patient):
        surface = failure = None
        try:
            surface = self._make(request, is_patient)
            return surface
        except Exception as error:
            failure = error
            raise
        finally:
            with self._changed:
                self._running.discard(request)
                if generation == self._generation:
                    self._note(request, surface, failure)
                self._changed.notify_all()

    def _note(self, request, surface, failure):
        if surface is not None:
            self._keep(request, surface)
        elif failure is not None:
            self._errors[request] = failure

    def _next(self):
        """The next request to make; None once the cache is closed."""
        with self._changed:
            while self._is_open:
                for request in self._wanted:
                    if request not in self._running:
                        self._wanted.remove(request)
                        self._running.add(request)
                        return request, self._generation
                self._changed.wait()
        return None, 0

    def _work(self):
        while True:
            request, generation = self._next()
            if request is None:
                return
            try:
                self._make_and_keep(request, generation, False)
            except Exception:
                pass  # peek() raises it where the frame is asked for
