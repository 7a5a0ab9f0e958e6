"""One update as a CUDA graph: recorded once, replayed from fixed buffers."""

from collections.abc import Callable

import torch

from revolver_lab.learners.stacked.algorithm import Algorithm, Batch


class CapturedUpdate:
    """Calls `Algorithm.update` through buffers that never move, so that a graph can replay it.

    A replayed update costs one launch in place of hundreds. Without a CUDA device the same
    buffers are used and the update is simply called: every path but the recording is the same.

    Args:
        algorithm: The learners.
    """

    _WARM_UP = 3  # updates before the recording, as CUDA graphs ask for; their effect is undone

    def __init__(self, algorithm: Algorithm):
        self.algorithm = algorithm
        self._buffers: tuple[Batch, torch.Tensor, torch.Tensor] | None = None
        self._replays: dict[bool, Callable[[], torch.Tensor]] = {}

    def __call__(
        self, batch: Batch, mask: torch.Tensor, actor_mask: torch.Tensor, with_actor: bool
    ) -> torch.Tensor:
        """Takes one gradient step; see `Algorithm.update`."""
        if self._buffers is None:
            copies = Batch(*(torch.empty_like(array).copy_(array) for array in batch))
            self._buffers = copies, mask.clone(), actor_mask.clone()
        held, held_mask, held_actor_mask = self._buffers
        for buffer, array in zip((*held, held_mask, held_actor_mask), (*batch, mask, actor_mask)):
            buffer.copy_(array)
        if with_actor not in self._replays:
            self._replays[with_actor] = self._record(with_actor)
        return self._replays[with_actor]()

    def _record(self, with_actor: bool) -> Callable[[], torch.Tensor]:
        """Returns what runs the update on the buffers."""
        held, mask, actor_mask = self._buffers  # type: ignore[misc]

        def update() -> torch.Tensor:
            return self.algorithm.update(held, mask, actor_mask, with_actor)

        if mask.device.type != "cuda":
            return update
        return self._graph(update)

    def _graph(self, update: Callable[[], torch.Tensor]) -> Callable[[], torch.Tensor]:
        """Records the update; what the warm-up changed is put back."""
        live = [array for networks in self.algorithm.parts().values()
                for array in networks.state().values()]  # fmt: skip
        live += list(self.algorithm.extras().values())
        before = [array.clone() for array in live]
        stream = torch.cuda.Stream()
        stream.wait_stream(torch.cuda.current_stream())
        with torch.cuda.stream(stream):
            for _ in range(self._WARM_UP):
                update()
        torch.cuda.current_stream().wait_stream(stream)
        graph = torch.cuda.CUDAGraph()
        with torch.cuda.graph(graph):
            finite = update()
        for array, old in zip(live, before, strict=True):
            array.copy_(old)

        def replay() -> torch.Tensor:
            graph.replay()
            return finite

        return replay
