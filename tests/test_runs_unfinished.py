"""Files of unfinished runs that no worker wrote: refused by their names, or passed over."""

import json

import pytest
from small_runs import tiny_plan
from test_runs_torn import DEEP, LONG, one_line

from revolver_lab.errors import SettingsError
from revolver_lab.experts import load_expert
from revolver_lab.runs import Run, checkpoint, store
from revolver_lab.runs.so_far import so_far
from revolver_lab.weights import save_weights

PHASE = {"phase": 0, "alpha": 1.0, "episodes": 8, "steps": 1600, "episode_return": 1.0,
         "mean_beta": 1.0, "kept": 0, "wall_time": 1.0}  # fmt: skip
ROW = {"method": "tiny", "seed": 0, "phases": [PHASE], "steps": 1600, "evaluation_steps": 0,
       "evaluations": [{"steps": 1600, "alpha": 1.0, "returns": [1.0, 2.0]}], "wall_time": 1.0,
       "reached_target": True, "failure": ""}  # fmt: skip
TOLD = {"method": "tiny", "seed": 0, "alpha": 1.0, "phase": 0, "phases": 1, "steps": 5,
        "episode_return": None, "evaluations": [[5, 1.0]], "over": False,
        "failure": ""}  # fmt: skip


@pytest.fixture
def begun(tmp_path):
    """A run that nobody is at, with one shard."""
    run = Run(tiny_plan(seeds=[0]), root=tmp_path / "begun")
    run.prepare(1)
    return run


def done(**changes):
    return json.dumps({"learners": [ROW | changes], "versions": {}, "commit": ""})


@pytest.mark.parametrize(
    ("name", "text"),
    [(store.SHARDS, text) for text in (
        "{}", "[]", '"x"', '{"shards": "x"}', '{"shards": 0}', '{"shards": 1e9}',
        '{"shards": 1000000000}', DEEP)]
    + [(store.FAILED, text) for text in ("{}", "[]", "null", '{"message": 5}', "", DEEP)]
    + [(store.DONE, text) for text in (
        "{}", "", DEEP, '{"learners": [], "versions": {}, "commit": ""}', done(seed=1),
        done(method="../../x"), done(phases=[]), done(phases=[{}]), done(evaluations=[]),
        done(steps=None), done(wall_time="x"), done(failure=1),
        done(evaluations=[{"steps": 1, "alpha": 1.0, "returns": []}]),
        done(phases=[PHASE | {"steps": 10**400}]))],
)  # fmt: skip
def test_what_a_worker_never_writes_is_refused_by_the_files_name(begun, name, text, capsys):
    path = begun.folder / name if "/" in name else store.shard_folder(begun.folder, 0) / name
    path.write_text(text)
    assert path.name in one_line(["report", begun.folder], capsys)
    if name != store.FAILED:  # which curves do not ask for
        words = ["tensorboard", begun.folder, "-o", begun.folder / "tb"]
        assert path.name in one_line(words, capsys)
    assert not (begun.folder / store.CARD).exists()


@pytest.mark.parametrize(
    "learner",
    [{"method": "zz"}, {"method": "../../x"}, {"seed": "q"}, {"seed": 7}, {"steps": "a"},
     {"steps": None}, {"evaluations": [[1]]}, {"evaluations": 3}, {"alpha": "x"}, {"more": 1}],
)  # fmt: skip
def test_what_a_worker_says_of_itself_is_passed_over_where_it_makes_no_sense(begun, learner):
    path = store.shard_folder(begun.folder, 0) / store.PROGRESS
    path.write_text(json.dumps({"learners": [TOLD], "seconds": 1, "message": ""}))
    assert begun.status().steps == 5
    for said in ({"learners": [TOLD | learner]}, {"seconds": "x"}, {"seconds": None},
                 {"message": 5}, {"learners": [5]}):  # fmt: skip
        usual = {"learners": [TOLD], "seconds": 1, "message": ""}
        path.write_text(json.dumps(usual | said))
        now = begun.status()
        assert (now.state, now.learners, now.steps, now.message) == ("stopped", (), 0, "")
    for text in (DEEP, "[]", "5", LONG):
        path.write_text(text)
        assert begun.status().learners == ()


@pytest.mark.parametrize("plain", [DEEP, "null", "[]", "{}", '{"logs": [{}]}', LONG])
def test_a_checkpoint_without_logs_is_refused(begun, plain):
    path = store.shard_folder(begun.folder, 0) / checkpoint._LATEST
    save_weights(path, load_expert("cheetah-front-leg").weights, {"plain": plain})
    with pytest.raises(SettingsError, match=path.name):
        so_far(begun.folder)
