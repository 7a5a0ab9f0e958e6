"""The command line: thin, and errors in one line with exit code 2."""

import csv
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from small_runs import tiny_plan

import revolver_lab as rvl
from revolver_lab import _gl, cli, evaluation
from revolver_lab.commands import looking
from revolver_lab.commands import training as commands
from revolver_lab.commands.parts import training
from revolver_lab.demonstration_sources import record
from revolver_lab.demonstrations import Demonstrations
from revolver_lab.errors import SettingsError
from revolver_lab.policies import Policy
from revolver_lab.robots import registry
from revolver_lab.runs import Plan, Run
from revolver_lab.runs.worker import main as work
from revolver_lab.trajectories import Success
from revolver_lab.weights import digest

needs_gl = pytest.mark.skipif(not _gl.choose().works, reason="no OpenGL on this machine")
NAME = "cheetah-front-leg"
SMALL = ["--width", "48", "--height", "32"]


def test_list_names_every_robot(capsys):
    assert cli.main(["list"]) == 0
    shown = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in shown] == rvl.names()


def test_doctor_names_the_renderer_and_mends_in_one_line(capsys):
    cli.main(["doctor"])
    shown = capsys.readouterr().out
    assert _gl.choose().title in shown or "nothing that draws" in shown
    assert "mujoco 3.17" in shown
    for line in shown.splitlines():
        if line.startswith("--"):
            following = shown.split(line + "\n")[1].splitlines()[0]
            assert following.strip()


@needs_gl
def test_a_strip_and_films_from_the_shell(tmp_path, capsys):
    strip, film = str(tmp_path / "x.png"), str(tmp_path / "x.gif")
    assert cli.main(["strip", NAME, "--alpha", "0", "1", "-o", strip, *SMALL]) == 0
    assert Image.open(strip).width == 2 * 48 + 4
    assert cli.main(["gif", NAME, "--fps", "2", "-o", film, *SMALL]) == 0
    assert Image.open(film).n_frames > 2
    assert capsys.readouterr().out.split() == ["wrote", strip, "wrote", film]


@needs_gl
def test_a_film_of_the_shipped_policy(tmp_path):
    try:
        rvl.load_expert(NAME)
    except rvl.errors.PolicyFileError:
        pytest.skip("no expert is shipped yet")
    film = str(tmp_path / "x.gif")
    words = ["--policy", "expert", "--alpha", "0", "1", "--steps", "4", "-o", film, *SMALL]
    assert cli.main(["gif", NAME, *words]) == 0
    assert Image.open(film).width == 2 * 48 + 4


def test_policies_and_robots_pair_up_or_one_stays_for_all(monkeypatch, tmp_path):
    played = []

    def record(policy, evolve, alpha, *, title, **_):
        played.append((policy, alpha, title))

    monkeypatch.setattr(looking, "policy_of", lambda name, given: given.upper())
    monkeypatch.setattr(rvl.lab, "record", record)
    monkeypatch.setattr(rvl.lab, "film", lambda *_, **settings: None)
    film = ["gif", NAME, "-o", str(tmp_path / "x.gif"), "--policy"]
    assert cli.main([*film, "a", "a", "b", "--alpha", "0", "1", "1"]) == 0
    assert played == [("A", 0.0, "a"), ("A", 1.0, "a"), ("B", 1.0, "b")]
    played.clear()
    assert cli.main([*film, "a", "--alpha", "0", "1", "--title", "here", "there"]) == 0
    assert cli.main([*film, "a", "b"]) == 0
    assert played == [("A", 0.0, "here"), ("A", 1.0, "there"), ("A", 1.0, "a"), ("B", 1.0, "b")]


@pytest.mark.parametrize(
    "words",
    [
        ["strip", "cheetah-frontleg", "-o", "x.png"],
        ["strip", NAME, "-o", "x.txt"],
        ["strip", "a.xml", "b.xml", "-o", "x.png"],
        ["match", NAME, NAME, NAME],
        ["match", "no-such-robot"],
        ["gif", "a.xml", "b.xml", "-o", "x.gif", "--policy", "expert"],
        ["record", "adroit-door", "-o", "."],
        ["record", "adroit-door", "-o", "a.npz", "--alpha", "1.5"],
        ["transfer", NAME, "--method", "direct", "--task", "happy"],
        ["transfer", "adroit-door", "--method", "npg-direct", "--task", "happy"],
        ["transfer", NAME, "--methods", "direct", "--task", "happy"],
        ["transfer", "--plan", "config.json", "--task", "dense"],
        ["strip", NAME, "-o", "no/such/folder/x.png"],
        ["gif", NAME, "-o", "x.gif", "--alpha", "0"],
        ["gif", NAME, "-o", "x.gif", "--policy", "no-such-file"],
        ["gif", NAME, "-o", "x.gif", "--policy", "expert", "expert", "--alpha", "0", "0.5", "1"],
        ["gif", NAME, "-o", "x.gif", "--policy", "expert", "--title", "a", "b"],
        ["strip", NAME, "-o", "x.png", "--camera", "behind"],
        ["evaluate", NAME, "--policy", "no-such-file"],
        ["evaluate", NAME, "--episodes", "99999999999999999999"],
        ["evaluate", NAME, "--episodes", "9223372036854775807"],
        ["transfer", NAME, "--method", "magic"],
        ["transfer"],
        ["transfer", NAME, "--method", "direct", "--methods", "direct"],
        ["transfer", NAME, "--seeds", "0", "-o", "x"],
        ["transfer", NAME, "--plan", "config.json"],
        ["transfer", "--plan", "config.json"],
        ["transfer", NAME, "--methods", "magic"],
        ["transfer", NAME, "--methods", "direct", "--seeds", "-1"],
        ["transfer", NAME, "--methods", "revolver", "--steps", "100"],
        ["transfer", NAME, "--methods", "direct", "--processes", "0"],
        ["report", "no-such-folder"],
        ["report", "."],
        ["keep", "no-such-folder", "-o", "kept"],
        ["tensorboard", "no-such-folder"],
    ],
)
def test_errors_are_one_line_and_code_2(words, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert cli.main(words) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith("revolver-lab: ")
    assert len(said.err.splitlines()) == 1
    assert not list(tmp_path.iterdir())


def test_training_without_torch_says_what_to_install():
    with (
        pytest.raises(rvl.errors.MissingExtraError, match=r"revolver-lab\[train\]"),
        training(),
    ):
        raise ModuleNotFoundError("No module named 'torch'", name="torch")
    with pytest.raises(SettingsError), training():
        raise SettingsError("a", "b", "c")


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A finished run of two learners, and the arguments that find it again."""
    root = tmp_path_factory.mktemp("runs")
    run = Run(tiny_plan(), root=root)
    run.prepare(1)
    assert work([str(run.folder), "0"]) == 0
    run.results()
    return run.folder, ["transfer", "--plan", str(run.folder / "config.json"), "--root", str(root)]


def test_transfer_finds_a_run_again_and_prints_its_table(finished, capsys):
    folder, words = finished
    assert cli.main(words) == 0
    shown = capsys.readouterr().out.splitlines()
    assert shown[0] == str(folder)
    mean = Run.open(folder).results().scores()["tiny"].mean()
    assert shown[2].split()[:3] == ["tiny", "2", f"{mean:.4g}"]
    assert any(line.startswith("success: a mean return of 80") for line in shown)
    assert any(line.startswith("cost: 6.4 k steps of training") for line in shown)
    assert shown[-1].startswith("revolver-lab transfer --plan")


def test_report_writes_a_table_of_several_runs(finished, tmp_path, capsys):
    folder, _ = finished
    assert cli.main(["keep", str(folder), "-o", str(tmp_path / "kept")]) == 0
    kept = tmp_path / "kept" / folder.name
    assert capsys.readouterr().out.split() == ["wrote", str(kept)]
    out = tmp_path / "x.csv"
    words = ["report", str(folder), str(kept), "--csv", str(out), "--threshold", "-1"]
    assert cli.main(words) == 0
    shown = capsys.readouterr().out
    assert shown.count("100%  16% to 100%") == 2  # Clopper-Pearson of 2 of 2: 0.025^(1/2)
    with open(out, newline="") as file:
        first, second = csv.DictReader(file)
    assert first | {"run": ""} == second | {"run": ""}
    interval = rvl.stats.interval(Run.open(kept).results().scores()["tiny"])
    assert (float(first["mean"]), float(first["mean_low"])) == (interval.value, interval.low)
    assert (first["seeds"], first["success"], first["threshold"]) == ("2", "1.0", "-1.0")


def test_one_table_takes_runs_that_tell_other_numbers(tmp_path, capsys):
    # Of this robot returns are recorded, by off-policy learners, and successes, by natural ones.
    out = tmp_path / "x.csv"
    assert cli.main(["report", "cheetah-front-leg", "--csv", str(out)]) == 0
    with open(out, newline="") as file:
        rows = {row["method"]: row for row in csv.DictReader(file)}
    assert (bool(rows["soil"]["good"]), bool(rows["soil"]["iqm"])) == (True, False)
    assert (bool(rows["revolver"]["good"]), bool(rows["revolver"]["iqm"])) == (False, True)


def test_evaluate_reads_the_policies_of_runs(finished, capsys):
    folder, _ = finished
    words = ["evaluate", NAME, "--alpha", "1", "--episodes", "2", "--policy"]
    path = folder / "policies" / "tiny-1.safetensors"
    for given in (f"{folder}:tiny-1", path):
        assert cli.main([*words, str(given)]) == 0
    one, other = capsys.readouterr().out.split("alpha   ")[1:]
    assert one == other
    assert cli.main([*words, str(folder)]) == 2
    assert cli.main([*words, f"{folder}:tiny-9"]) == 2
    assert capsys.readouterr().err.count("Name one: FOLDER:tiny-0.") == 2


def test_evaluate_tells_success_where_a_task_has_a_goal(capsys, monkeypatch):
    play, played = evaluation.returns_of, []
    monkeypatch.setattr(evaluation, "returns_of", lambda *a: played.append(a) or play(*a))
    assert cli.main(["evaluate", "adroit-door", "--alpha", "0", "--episodes", "2"]) == 0
    assert len(played) == 1  # once, for returns and success
    head, row = capsys.readouterr().out.splitlines()
    assert head.split()[-1] == "success"
    assert float(row.split()[-1]) == 1.0


def test_two_files_are_matched_and_drawn_as_a_registered_robot_is(tmp_path, capsys):
    files = [str(tmp_path / name) for name in ("short.xml", "long.xml")]
    for path, length in zip(files, (1, 2), strict=True):
        Path(path).write_text(f"""<mujoco model="pole{length}"><worldbody><body name="pole">
            <joint name="hinge"/><geom name="rod" type="capsule" fromto="0 0 0 0 0 {length}"
            size=".05"/></body></worldbody></mujoco>""")
    assert cli.main(["match", *files]) == 0
    said = capsys.readouterr().out
    assert said.startswith("Evolution('pole1-to-pole2'")
    assert said.splitlines()[1:] == str(rvl.Evolution(*files).matching).splitlines()
    assert cli.main(["match", NAME]) == 0
    assert str(rvl.load(NAME).matching) in capsys.readouterr().out


@needs_gl
def test_two_files_are_drawn_by_command(tmp_path):
    for name in ("a", "b"):
        (tmp_path / f"{name}.xml").write_text(
            "<mujoco><worldbody><geom size='.1'/></worldbody></mujoco>"
        )
    files, strip = [str(tmp_path / f"{name}.xml") for name in "ab"], str(tmp_path / "x.png")
    assert cli.main(["strip", *files, "--alpha", "0", "1", "-o", strip, *SMALL]) == 0
    assert Image.open(strip).width == 2 * 48 + 4


def test_demonstrations_recorded_by_command_are_those_of_the_function(tmp_path, capsys):
    out = tmp_path / "door.npz"
    words = ["--episodes", "3", "--seed", "5", "--successes", "-o", str(out)]
    assert cli.main(["record", "adroit-door", *words]) == 0
    assert "3 of 3 episodes" in capsys.readouterr().out
    ours = record(rvl.load_expert("adroit-door"), "adroit-door", 3, seed=5, success=Success())
    read = Demonstrations.load(out)
    assert read.origin == ours.origin
    for name in ("lengths", "observations", "actions", "next_observations", "rewards"):
        assert np.array_equal(getattr(read, name), getattr(ours, name))


def test_a_sweep_by_command_names_what_it_cannot_read(tmp_path, capsys):
    assert cli.main(["sweep", str(tmp_path / "none.toml")]) == 2
    assert "none.toml" in capsys.readouterr().err


def test_event_files_hold_what_the_tables_hold(finished, tmp_path, capsys):
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    folder, _ = finished
    for _ in range(2):  # written anew, not twice
        assert cli.main(["tensorboard", str(folder), "-o", str(tmp_path)]) == 0
    assert str(tmp_path) in capsys.readouterr().out
    for one in Run.open(folder).results().learners:
        events = EventAccumulator(str(tmp_path / one.method / str(one.seed)))
        events.Reload()
        target = [(e.step, e.value) for e in events.Scalars("target/mean_return")]
        assert target == list(zip(one.steps.tolist(), one.curve.tolist()))
        alphas = [(e.step, e.value) for e in events.Scalars("phase/alpha")]
        assert alphas == [(p["steps"], p["alpha"]) for p in one.phases]


def test_without_tensorboard_it_says_what_to_install(finished, tmp_path, capsys, monkeypatch):
    folder, _ = finished
    monkeypatch.setitem(sys.modules, "torch.utils.tensorboard", None)
    assert cli.main(["tensorboard", str(folder), "-o", str(tmp_path / "x")]) == 2
    assert "revolver-lab[tensorboard]" in capsys.readouterr().err
    assert not (tmp_path / "x").exists()


def test_an_interrupted_transfer_says_how_to_go_on(finished, tmp_path, capsys, monkeypatch):
    def interrupt(run, **_):
        raise KeyboardInterrupt

    monkeypatch.setattr(Run, "start", lambda run, **_: run)
    monkeypatch.setattr(Run, "wait", interrupt)
    words = ["transfer", "--plan", finished[1][2], "--root", str(tmp_path)]
    assert cli.main(words) == 2
    assert "the same command goes on" in capsys.readouterr().err


@pytest.mark.slow
def test_an_expert_without_a_recipe_is_trained_for_so_many_steps(tmp_path, monkeypatch):
    asked = []
    monkeypatch.setattr(rvl, "train_expert", lambda name, **given: asked.append((name, given)))
    words = ["train-expert", "ant-leg-emerge", "-o", str(tmp_path)]
    assert cli.main([*words, "--steps", "5000"]) == 0
    assert cli.main([*words, "--steps", "6000", "--task", "dense"]) == 0
    assert cli.main(words) == 0
    stages = [given["stages"] for _, given in asked]
    assert [(s[0].task, s[0].steps) for s in stages[:2]] == [
        (next(iter(registry.get("ant-leg-emerge").tasks)), 5000), ("dense", 6000)]  # fmt: skip
    assert stages[2] is None
    assert cli.main([*words, "--task", "dense"]) == 2


def test_transfer_trains_one_learner_into_a_folder(tmp_path, capsys):
    words = ["transfer", NAME, "--method", "scratch", "--steps", "1600", "-o", str(tmp_path)]
    assert cli.main(words) == 0
    assert "scratch on cheetah-front-leg: 1600 steps" in capsys.readouterr().out
    assert cli.main(["evaluate", NAME, "--policy", str(tmp_path), "--alpha", "1"]) == 0


@pytest.mark.slow
def test_transfer_learns_by_the_reward_that_is_asked_for(tmp_path, capsys):
    words = ["transfer", "adroit-door", "--steps", "1", "--task", "dense"]
    root = ["--root", str(tmp_path)]
    assert cli.main([*words, "--methods", "npg-direct", "--seeds", "0", *root]) == 0
    (folder,) = tmp_path.glob("adroit-door-*")
    card = json.loads((folder / "card.json").read_text())
    assert card["command"].endswith("--steps 1 --task dense")
    plan = Run.open(folder).plan
    assert plan.task == "dense"
    assert cli.main([*words, "--method", "npg-direct", "-o", str(tmp_path / "one")]) == 0
    single = Policy.load(tmp_path / "one" / "policy.safetensors")
    learner = Run.open(folder).results().learners[0].policy()
    assert digest(single.weights) == digest(learner.weights)


def test_transfer_trains_a_run_and_tells_how_it_is_doing(tmp_path, capsys):
    root = ["--root", str(tmp_path)]
    words = ["transfer", NAME, "--methods", "scratch", "--seeds", "0", "--steps", "4800", *root]
    assert cli.main(words) == 0
    first = capsys.readouterr()
    assert "1 learners into" in first.err
    assert cli.main(words) == 0
    again = capsys.readouterr()
    assert again.out == first.out
    assert "learners into" not in again.err
    assert first.out.splitlines()[-1] == "revolver-lab " + " ".join(words[: -len(root)])


@pytest.mark.parametrize(
    "words",
    [["transfer", NAME, "-o", ""], ["transfer", NAME, "--root", ""], ["transfer", "--plan", ""],
     ["transfer", NAME, "--policy", ""], ["transfer", NAME, "--policy="], ["sweep", ""],
     ["sweep", "x.toml", "--root", ""], ["evaluate", NAME, "--policy", ""],
     ["train-expert", NAME, "-o", ""], ["keep", "x", "-o", ""], ["keep", "", "-o", "x"],
     ["tensorboard", ""], ["tensorboard", "x", "-o", ""], ["report", "x", "--csv", ""],
     ["report", ""], ["record", NAME, "-o", ""], ["strip", NAME, "-o", ""],
     ["gif", NAME, "-o", "x.gif", "--policy", "expert", ""]],
    ids=" ".join,
)  # fmt: skip
def test_an_empty_name_is_not_the_folder_one_works_in(words, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    rvl.load_expert(NAME).save(tmp_path / "policy.safetensors")  # what "" as a policy would find
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(SystemExit) as caught:
        cli.main(words)
    assert caught.value.code == 2
    assert "an empty name" in capsys.readouterr().err
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize("flag", [["--root", "x"], ["--processes", "1"], ["--every", "5"]])
def test_what_belongs_to_a_run_asks_for_one(flag, monkeypatch, capsys):
    asked = []
    monkeypatch.setattr(commands, "_run", lambda arguments: asked.append(arguments) or 0)
    monkeypatch.setattr(commands, "_one", lambda _: pytest.fail("one learner was trained"))
    assert cli.main(["transfer", NAME, *flag]) == 0
    assert cli.main(["transfer", "--plan", "config.json", *flag]) == 0
    assert len(asked) == 2
    assert commands._plan(asked[0])[0] == Plan(robot=NAME, methods=["revolver"], seeds=[0])
    assert cli.main(["transfer", NAME, "--method", "direct", *flag]) == 2
    assert flag[0] in capsys.readouterr().err


def test_the_command_line_is_read_without_mujoco_or_torch():
    code = ("import sys; sys.modules['mujoco'] = sys.modules['torch'] = None\n"
            "from revolver_lab.commands.parser import make_parser\n"
            "print(make_parser('', '').parse_args(['report', 'x']).run)")  # fmt: skip
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout.strip() == "reporting:report", done.stderr


def test_a_broken_choice_of_opengl_breaks_pictures_only(tmp_path):
    env = os.environ | {"MUJOCO_GL": "osmesa-9", "XDG_CACHE_HOME": str(tmp_path)}
    command = [sys.executable, "-m", "revolver_lab.cli"]
    listed = subprocess.run([*command, "list"], env=env, capture_output=True, text=True)
    assert listed.returncode == 0, listed.stderr
    # A strip of a registered robot would be shown from its recording; a film has to be drawn.
    words = ["gif", NAME, "-o", str(tmp_path / "x.gif")]
    drawn = subprocess.run([*command, *words], env=env, capture_output=True, text=True)
    assert drawn.returncode == 2
    assert not (tmp_path / "x.gif").exists()
    assert "MUJOCO_GL=osmesa-9" in drawn.stderr
    assert len(drawn.stderr.splitlines()) == 1
