"""The slider over morphology: a thin view of an Explorer, in Jupyter widgets."""

import html
import traceback
from collections.abc import Callable
from itertools import groupby
from typing import TYPE_CHECKING, Any

from revolver_lab.evolution.evolution import Evolution, checked_alpha
from revolver_lab.lab.explorer import FULL, Explorer
from revolver_lab.lab.facts import Fact
from revolver_lab.lab.frames import FIT
from revolver_lab.lab.pacing import Pacer
from revolver_lab.lab.rollouts import Acting

if TYPE_CHECKING:
    from ipywidgets import Image

    from revolver_lab.tasks.base import Task

Change = dict[str, Any]
"""What ipywidgets hands to an observer; only its "new" is used."""

_SWEEP = 100
"""Steps of the play button from alpha 0 to 1, where there is no policy to play."""
_TICK = 50
"""Milliseconds between them."""


def explore(
    evolve: Evolution | str,
    policy: Acting | None = None,
    *,
    alpha: float = 0.0,
    task: "str | Task | None" = None,
    seed: int = 0,
) -> "App":
    """A slider that drags one robot into another, with its picture and what changes.

    The play button shows the policy on the robot of this alpha; without a policy, it sweeps alpha.
    The slider has the focus of the keyboard: arrows step by 0.01, Page Up and Down by 0.05.

    Args:
        evolve: The evolution, or the name of a registered one.
        policy: Observation (O,) -> action (A,) in [-1, 1].
        alpha: Where the slider stands at first.
        task: What the policy is judged by: a reward of the registered robot, by default its first,
            or a task for an evolution of your own.
        seed: Seed of the policy's episodes.

    Returns:
        What a notebook shows as the last line of a cell.

    Raises:
        AlphaError: If alpha is outside [0, 1].
        SettingsError: If the robot or the policy is something else.
        UnknownNameError: If there is no robot of that name.
    """
    return App(Explorer(evolve, policy, task=task, seed=seed), alpha)


class App:
    """The widgets of an explorer.

    Args:
        explorer: What is shown.
        alpha: Where the slider stands at first.

    Attributes:
        widget: The widget that holds all others, to put into one of your own.
        error: The last error, which is also shown; None once something worked again.
    """

    def __init__(self, explorer: Explorer, alpha: float = 0.0):
        self.explorer, self.step, self.error = explorer, None, None
        self._build(checked_alpha(alpha))
        self.pacer = Pacer(self.draw)
        self.slider.observe(self.on_alpha, "value")
        self.camera.observe(self.on_camera, "value")
        self.play.observe(self.on_play, "value")
        self._show(True)  # here an error is the cell's own

    @property
    def alpha(self) -> float:
        """Where the slider stands, as its label says: one of 101 robots, which are cached."""
        return round(self.slider.value, 2)

    def on_alpha(self, change: Change) -> None:
        """The slider moved: another robot, standing."""
        if self.explorer.policy is not None:
            self.play.playing, self.step = False, None
        self.pacer.ask()

    def on_camera(self, change: Change) -> None:
        """Another camera was chosen."""
        self.pacer.ask()

    def on_play(self, change: Change) -> None:
        """The play button ticked: the policy's next step, or the next alpha."""
        if self.explorer.policy is None:
            self.slider.value = 1.0 - abs(1.0 - change["new"] / _SWEEP)  # there and back
            return
        self.step = change["new"]
        self.pacer.ask()

    def draw(self, full: bool) -> None:
        """Bring picture and facts up to date; an error is shown instead of them.

        Args:
            full: In full resolution.
        """
        self._guarded(lambda: self._show(full))

    def close(self) -> None:
        """Stop drawing and remove the widgets from the page."""
        self.pacer.stop()
        for widget in (self.slider, self.play, self.camera, self.image, self.words, self.trouble,
                       self.facts, self.widget):  # fmt: skip
            widget.close()

    def _show(self, full: bool) -> None:
        """Picture, words and facts of what is asked for now."""
        alpha = self.alpha
        shown = self.explorer.picture(alpha, str(self.camera.value), step=self.step, full=full)
        if self.step is not None:
            self.play.max = len(self.explorer.rollout(alpha).rewards) - 1
        with self.image.hold_sync():  # one message
            self.image.value, self.image.tooltip = shown.jpeg, shown.alt
        self.words.value = f'<div role="status">{html.escape(shown.words)}</div>'
        self.facts.value = facts_table(self.explorer.facts(alpha))

    def _guarded(self, work: Callable[[], None]) -> None:
        """Do some work; what goes wrong is shown, and nothing of it is lost."""
        try:
            work()
        except Exception as problem:
            self.error = problem
            self.trouble.value = error_text(problem)
        else:
            self.error = None
            self.trouble.value = ""

    def _build(self, alpha: float) -> None:
        """Make the widgets and lay them out."""
        import ipywidgets as w

        wide = w.Layout(width="100%")
        self.slider = w.FloatSlider(
            alpha, min=0.0, max=1.0, step=0.01, description="alpha", readout_format=".2f",
            continuous_update=True, layout=wide,
        )  # fmt: skip
        run = self.explorer.policy is not None
        self.play = w.Play(
            value=0, min=0, max=2 * _SWEEP, interval=_TICK, show_repeat=False,
            tooltip="Watch the policy on this robot" if run else "Sweep alpha",
        )  # fmt: skip
        self.camera = w.Dropdown(options=self.explorer.cameras, value=FIT, description="camera",
                                 layout=w.Layout(width="auto"))  # fmt: skip
        self.image = _image_class()(format="jpeg", width=FULL[0], height=FULL[1],
                             layout=w.Layout(max_width="100%", object_fit="contain"))  # fmt: skip
        self.words, self.trouble, self.facts = w.HTML(), w.HTML(), w.HTML()
        controls = w.HBox([self.play, self.camera], layout=w.Layout(flex_flow="row wrap"))
        left = w.VBox([self.slider, controls, self.image, self.words, self.trouble],
                      layout=w.Layout(flex="1 1 420px", max_width=f"{FULL[0] + 8}px"))  # fmt: skip
        right = w.Box([self.facts], layout=w.Layout(
            flex="1 1 320px", max_width="460px", max_height="600px", overflow="auto"))  # fmt: skip
        self.widget = w.HBox([left, right], layout=w.Layout(flex_flow="row wrap", width="100%"))

    def _repr_mimebundle_(self, **kwargs: Any) -> Any:
        """Show the widgets; Jupyter asks for it."""
        return self.widget._repr_mimebundle_(**kwargs)


def _image_class() -> "type[Image]":
    """Image, with the `description` without which ipywidgets 8.1 shows no tooltip but an error.

    The tooltip is the only alternative text that its image can have.
    """
    import ipywidgets
    from traitlets import Unicode

    class DescribedImage(ipywidgets.Image):
        description = Unicode("").tag(sync=True)

    return DescribedImage


def facts_table(facts: list[Fact]) -> str:
    """Facts as an HTML table: source, now and target of each, under headings.

    Example:
        >>> fact = Fact(kind="total mass", name="all", source=1, now=2, target=3, unit="kg")
        >>> "<td>2</td>" in facts_table([fact])
        True
    """
    rows = []
    for kind, group in groupby(facts, key=lambda fact: fact.kind):
        rows.append(f'<tr><th scope="rowgroup" colspan="5">{kind}</th></tr>')
        for fact in group:
            cells = "".join(f"<td>{x:.4g}</td>" for x in (fact.source, fact.now, fact.target))
            rows.append(f'<tr><th scope="row">{html.escape(fact.name)}</th>{cells}'
                        f"<td>{fact.unit}</td></tr>")  # fmt: skip
    return _TABLE.replace("ROWS", "".join(rows))


_TABLE = """<style>
.rvl-facts{border-collapse:collapse;font-size:12px;line-height:1.5;width:100%}
.rvl-facts th,.rvl-facts td{padding:0 6px;text-align:right;font-variant-numeric:tabular-nums}
.rvl-facts th{font-weight:normal;text-align:left}
.rvl-facts td:nth-child(3){font-weight:bold}
.rvl-facts td:last-child{text-align:left;opacity:.7}
.rvl-facts th[scope=rowgroup]{font-weight:bold;padding-top:8px}
.rvl-facts thead th{text-align:right;opacity:.7;border-bottom:1px solid}
</style><table class="rvl-facts"><thead><tr><th></th><th>source</th><th>now</th><th>target</th>
<th></th></tr></thead><tbody>ROWS</tbody></table>"""


def error_text(problem: Exception) -> str:
    """An error for people, with its traceback folded away."""
    lines = html.escape("".join(traceback.format_exception(problem)))
    name = html.escape(f"{type(problem).__name__}: {problem}")
    return (
        '<div role="alert" style="border-left:4px solid #c0392b;padding:4px 10px;line-height:1.4">'
        f"<b>{name}</b><details><summary>traceback</summary>"
        f'<pre style="overflow:auto;font-size:11px">{lines}</pre></details></div>'
    )
