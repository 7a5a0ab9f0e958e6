"""The demonstrations: equal steps, side by side, and a picture that is redrawn now and then."""

import dataclasses
import threading
import time
from functools import partial

import numpy as np
import pytest
from demo_jobs import fail, slowly_double
from natural_puck import EXPERT, LENGTH, Reach, puck
from PIL import Image

from revolver_lab import _gl
from revolver_lab.demos import hand, now, parts
from revolver_lab.errors import SettingsError
from revolver_lab.experts import load_expert
from revolver_lab.gates import SampledGate
from revolver_lab.learners.natural.settings import NaturalSettings
from revolver_lab.natural_log import Iteration
from revolver_lab.natural_loop import NaturalTransfer
from revolver_lab.policies import Policy
from revolver_lab.progress import describe_iteration

needs_gl = pytest.mark.skipif(not _gl.choose().works, reason="no OpenGL on this machine")
TINY = NaturalSettings(trajectories=4, length=LENGTH, value_hidden=(8,), warm_batches=1)


def iteration(number, **changes):
    settings = {"alpha": 0.1 * number, "success": 0.5, "average": 0.5, "episode_return": 1.0,
                "mean_beta": 0.5, "kl": 0.0, "log_std": -1.0, "explained": 0.0,
                "steps": 100 * number, "wall_time": 2.0 * number}  # fmt: skip
    return Iteration(iteration=number, **(settings | changes))


def test_jobs_run_in_processes_of_their_own_and_are_looked_at():
    seen, jobs = [], {name: partial(slowly_double, number=n) for name, n in (("a", 3), ("b", 5))}
    assert parts.side_by_side(jobs, seen.append) == {"a": 6, "b": 10}
    assert {3: 3, 5: 5} in seen
    with pytest.raises(ValueError, match="this one fails"):
        parts.side_by_side({"a": fail}, seen.append)


@pytest.fixture
def pucks(monkeypatch):
    """Loops on the puck in place of the hand's; the leader is slow."""
    made, evolve = {}, puck()

    def loop(gate, steps, seed, board, name):
        def report(done):
            board[name] = now.Moment(iteration=done, policy=EXPERT)
            time.sleep(0.02 * (name == hand.LEAD))

        made[name] = NaturalTransfer(EXPERT, evolve, gate, settings=TINY, task=Reach(), seed=seed,
                                     steps=steps, nthread=1, report=report)  # fmt: skip
        return made[name]

    monkeypatch.setattr(hand, "_loop", loop)
    monkeypatch.setattr(hand, "PILOT_GATE", SampledGate(alpha_step=0.25, low=0.0, high=0.01,
                                                        finish=0.0, every=1))  # fmt: skip
    monkeypatch.setattr(hand, "EPISODES", 5)
    return made


def in_threads(jobs, look):
    """As `side_by_side`, in this process."""
    board, found = {}, {}
    threads = [threading.Thread(target=lambda n=n, j=j: found.update({n: j(board)}))
               for n, j in jobs.items()]  # fmt: skip
    for thread in threads:
        thread.start()
    while any(thread.is_alive() for thread in threads):
        if board:
            look(dict(board))
        time.sleep(0.005)
    return found


@pytest.mark.parametrize("limit", [300, 100_000])
def test_direct_fine_tuning_gets_as_many_steps_as_the_one_beside_it(pucks, tmp_path, limit):
    ahead = []

    def look(board):
        if hand.LEAD in board and hand.FOLLOW in board:
            first, second = (board[name].iteration.steps for name in (hand.LEAD, hand.FOLLOW))
            ahead.append(second - first)

    jobs = {name: lambda board, n=name, j=job: j(board, limit, 0, tmp_path / n)
            for name, job in ((hand.LEAD, hand._lead), (hand.FOLLOW, hand._follow))}  # fmt: skip
    trials = in_threads(jobs, look)
    assert trials[hand.LEAD].steps == trials[hand.FOLLOW].steps == pucks[hand.LEAD].steps
    assert pucks[hand.LEAD].position.done == (limit > 1000)
    assert {i.alpha for i in pucks[hand.FOLLOW].iterations} == {1.0}
    assert max(ahead) <= 0
    for name in jobs:
        assert len(trials[name].returns) == 5
        assert (tmp_path / name / "log.json").is_file()
        assert Policy.load(tmp_path / name / "policy.safetensors").action_size == 2


def test_nobody_waits_for_a_leader_that_failed(pucks, tmp_path):
    board = {}
    with pytest.raises(SettingsError, match="steps = 0"):
        hand._lead(board, 0, 0, tmp_path)
    assert hand._follow(board, 300, 0, tmp_path).steps == 0


def test_the_demonstration_tells_four_numbers_and_names_its_files(
    pucks, tmp_path, capsys, monkeypatch
):
    monkeypatch.setattr(hand, "side_by_side", in_threads)
    monkeypatch.setattr(hand, "draw", lambda make, out: [out / "hand.gif"])
    monkeypatch.setattr(hand, "Now", Blind)
    monkeypatch.setattr(hand, "NaturalTransfer", lambda *_, seed: pucks_home(seed))
    hand.main(["--steps", "300", "--out", str(tmp_path)])
    said = capsys.readouterr().out
    opened = [
        line.split("opened")[1].split()[:3] for line in said.splitlines() if "opened " in line
    ]
    assert len(opened) == 4
    assert all(line[1:] == ["of", "5"] for line in opened)
    assert [line[0] for line in opened[:3]] == ["5", "0", "0"]
    assert "Both after 320 and 320 steps" in said
    files = said.split("Files written:\n")[1].split()
    assert str(tmp_path / "hand.gif") == files[0]
    assert {str(tmp_path / name / "policy.safetensors") for name in ("direct", "revolver")} < {
        *files
    }


def pucks_home(seed):
    return NaturalTransfer(EXPERT, puck(), settings=TINY, task=Reach(), seed=seed, nthread=1)


class Blind:
    """In place of a picture."""

    def __init__(self, *_):
        pass

    def show(self, moment):
        return False

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass


def test_the_time_left_is_told_by_the_pace_where_there_is_one():
    history = [iteration(number) for number in range(4)]  # 0.1 in 2 s: 0.7 take 14 s
    assert hand._left(history) == pytest.approx(14)
    assert hand._left(history, window=1) is None
    assert hand._left([dataclasses.replace(one, alpha=0.3) for one in history]) is None
    assert hand._left([*history, iteration(10)]) is None  # there; how long until it is sure?
    line = describe_iteration("revolver", history[-1], 125.0)
    assert len(line[: line.index("left") + 4]) < 80  # on a narrow terminal, too
    assert "2:05 left" in line
    assert "left" not in describe_iteration("revolver", history[-1], None)


@needs_gl
def test_the_picture_is_redrawn_when_alpha_has_moved_and_it_is_time(tmp_path):
    path, policy = tmp_path / "new" / "now.png", load_expert("adroit-door")
    moments = [now.Moment(iteration=iteration(k, alpha=a), policy=policy)
               for k, a in enumerate((0.0, 0.0, 0.5, 0.6))]  # fmt: skip
    with now.Now("adroit-door", path, every=0.0) as picture:
        drawn = [picture.show(moment) for moment in moments[:3]]
        last = np.array(Image.open(path))
        picture._next = time.monotonic() + 60
        drawn.append(picture.show(moments[3]))
    assert drawn == [True, False, True, False]
    assert last.shape[1] == 3 * 480 + 2 * 4
    assert [p.name for p in path.parent.iterdir()] == ["now.png"]


def test_without_opengl_the_picture_is_left_out_and_that_is_said(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(_gl, "choose", lambda: _gl.Renderer(backend="disabled", trouble=("none",)))
    with now.Now("adroit-door", tmp_path / "now.png", every=0.0) as picture:
        assert not picture.show(now.Moment(iteration=iteration(1), policy=EXPERT))
    assert capsys.readouterr().out.startswith("No picture on the way: no OpenGL that works")
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_the_demonstration_of_the_hand_runs(tmp_path):
    hand.main(["--steps", "1", "--out", str(tmp_path)])
    assert {p.name for p in tmp_path.iterdir()} >= {"direct", "revolver"}
