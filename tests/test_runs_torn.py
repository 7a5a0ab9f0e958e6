"""Files of runs that were torn, altered or made up: refused in one line, and nothing is touched."""

import json
import shutil

import pytest

from revolver_lab import cli
from revolver_lab.errors import PolicyFileError, SettingsError
from revolver_lab.experts import load_expert
from revolver_lab.files import asset_folder
from revolver_lab.policies import Policy
from revolver_lab.runs import Run, store
from revolver_lab.runs.sweep_file import read_sweep
from revolver_lab.runs.tables import read_results
from revolver_lab.weights import save_weights

DEEP, LONG = "[" * 100_000, "1" * 6000
TABLES = (store.LEARNERS, store.PHASES, store.EVALUATIONS)


@pytest.fixture
def run(tmp_path):
    """A copy of a recorded run of the cheetah, two levels below what might be a victim."""
    (shipped,) = asset_folder("results").glob("cheetah-front-leg-7eae12930680")
    return shutil.copytree(shipped, tmp_path / "runs" / shipped.name)


def change_card(run, **changes):
    """Alters a card; where a table has no digest in it, nobody notices that it was altered."""
    path = run / store.CARD
    path.write_text(json.dumps(json.loads(path.read_text()) | {"digests": {}} | changes))


def renamed(run, new):
    """Lets a learner's table speak of another method."""
    change_card(run)
    name = store.read_plan(run).methods[0].name
    for table in (run / name for name in TABLES):
        table.write_text(table.read_text().replace(f"\n{name},", f"\n{new},"))


@pytest.mark.parametrize("name", ["../../victim", "/etc", "another", ""])
def test_a_learner_that_nobody_planned_is_refused_and_its_name_is_no_path(run, name, capsys):
    precious = run.parent / "victim" / "0" / "precious.txt"
    precious.parent.mkdir(parents=True)
    precious.write_text("kept")
    renamed(run, name)
    with pytest.raises(SettingsError, match="each learner of the plan, once"):
        read_results(run)
    for words in (["tensorboard", str(run), "-o", str(run / "a" / "b")], ["report", str(run)],
                  ["keep", str(run), "-o", str(run / "kept")]):  # fmt: skip
        assert cli.main(words) == 2
        assert len(capsys.readouterr().err.splitlines()) == 1
    assert precious.read_text() == "kept"
    assert not (run / "a").exists()
    assert not (run / "kept").exists()


def test_a_learner_twice_in_the_tables_is_refused_and_one_that_lacks_as_well(run):
    change_card(run)
    table = run / store.LEARNERS
    lines = table.read_text().splitlines(keepends=True)
    for wrong in ([*lines, lines[-1]], lines[:-1], [*lines[:-1], lines[-2]]):
        table.write_text("".join(wrong))
        with pytest.raises(SettingsError, match="each learner of the plan, once"):
            read_results(run)


def test_event_files_are_written_anew_and_what_lies_beside_them_stays(run, tmp_path):
    name = store.read_plan(run).methods[0].name
    elsewhere, out = tmp_path / "elsewhere", tmp_path / "out"
    (elsewhere / "0").mkdir(parents=True)
    (elsewhere / "0" / "precious.txt").write_text("kept")
    out.mkdir()
    (out / name).symlink_to(elsewhere)  # as an archive may bring it
    for _ in range(2):
        assert cli.main(["tensorboard", str(run), "-o", str(out)]) == 0
    assert (elsewhere / "0" / "precious.txt").read_text() == "kept"
    assert len(list((elsewhere / "0").glob("events.*"))) == 1


def test_a_natural_run_without_its_iterations_is_torn(tmp_path, capsys):
    shipped = asset_folder("results") / "adroit-door-fingers-87c20ef7e340"
    run = shutil.copytree(shipped, tmp_path / shipped.name)
    (run / store.ITERATIONS).unlink()
    for altered in (False, True):
        if altered:
            change_card(run)  # nothing says what there was
        assert cli.main(["report", str(run)]) == 2
        assert "iterations.csv, which cannot be read" in capsys.readouterr().err


def one_line(words, capsys):
    """What a command says that cannot go on."""
    assert cli.main([str(word) for word in words]) == 2
    said = capsys.readouterr().err
    assert len(said.splitlines()) == 1
    return said


def all_refuse(run, file, capsys):
    for words in (["report", run, "--markdown"], ["keep", run, "-o", run / "kept"],
                  ["tensorboard", run, "-o", run / "tb"]):  # fmt: skip
        said = one_line(words, capsys)
        assert file in said
        assert "Allowed: " in said
        assert "Restore it, or delete the folder" in said


@pytest.mark.parametrize(
    ("field", "values"),
    [("processes", (0, -1, 1.5, "x", None, True, [1], 10**400)),
     ("expert_steps", (-1, 1.5, "x", None, {})),
     ("expert_return", ("x", [1], {}, True)),
     ("wall_time", ("x", None, [], float("inf"), 10**400)),
     ("command", (None, 5, ["x"], {})),
     ("digests", (None, "x", [1], {"learners.csv": 1}))],
)  # fmt: skip
def test_a_card_with_a_field_of_another_kind_is_refused_by_its_name(run, field, values, capsys):
    for value in values:
        change_card(run, **{field: value})
        all_refuse(run, store.CARD, capsys)
        with pytest.raises(SettingsError, match=rf"card\.json, whose {field} is "):
            Run.open(run).status()
    card = json.loads((run / store.CARD).read_text())
    del card[field]
    (run / store.CARD).write_text(json.dumps(card))
    if field in ("expert_return", "digests"):  # as older ones have it
        assert cli.main(["report", str(run)]) == 0
    else:
        all_refuse(run, f"{field} is missing", capsys)


@pytest.mark.parametrize("name", [store.CARD, store.CONFIG])
@pytest.mark.parametrize("text", [DEEP, '{"a":' * 100_000, LONG, "[]", "null", '"x"'])
def test_json_that_python_cannot_read_is_torn(run, name, text, capsys):
    (run / name).write_text(text)
    assert name in one_line(["report", run], capsys)


@pytest.mark.parametrize(
    ("table", "column", "value"),
    [(store.PHASES, "steps", ""), (store.PHASES, "alpha", "nan"), (store.PHASES, "alpha", "x"),
     (store.EVALUATIONS, "returns", ""), (store.EVALUATIONS, "returns", "1 nan"),
     (store.EVALUATIONS, "steps", "-1"), (store.LEARNERS, "steps", LONG),
     (store.LEARNERS, "steps", "9" * 400), (store.LEARNERS, "wall_time", "inf"),
     (store.LEARNERS, "evaluation_steps", "\x00")],
)  # fmt: skip
def test_a_cell_that_is_no_number_is_refused(run, table, column, value, capsys):
    change_card(run)
    lines = (run / table).read_text().splitlines()
    cells, at = lines[1].split(","), lines[0].split(",").index(column)
    cells[at] = value
    (run / table).write_text("\n".join([lines[0], ",".join(cells), *lines[2:]]) + "\n")
    one_line(["report", run], capsys)
    one_line(["tensorboard", run, "-o", run / "tb"], capsys)


def test_a_column_that_is_gone_is_missed(run):
    change_card(run)
    for column in ("episode_return", "alpha", "steps"):
        whole = (run / store.PHASES).read_text()
        (run / store.PHASES).write_text(whole.replace(column, "other", 1))
        with pytest.raises(SettingsError, match="which are torn"):
            Run.open(run).status()
        (run / store.PHASES).write_text(whole)


@pytest.mark.parametrize("table", [store.PHASES, store.EVALUATIONS])
def test_a_learner_without_a_row_in_a_table_is_refused(run, table):
    change_card(run)
    name = f"\n{store.read_plan(run).methods[0].name},0,"
    text = (run / table).read_text()
    while name in text:
        at = text.index(name)
        text = text[:at] + text[text.index("\n", at + 1) :]
    (run / table).write_text(text)
    for read in (read_results, lambda run: Run.open(run).status()):
        with pytest.raises(SettingsError, match="which are torn"):
            read(run)


def test_a_policys_card_and_a_sweep_that_python_cannot_read_are_refused(tmp_path):
    policy = load_expert("cheetah-front-leg")
    for card in (DEEP, LONG):
        save_weights(tmp_path / "x.safetensors", policy.weights, {
            "format": "revolver_lab.policy/1", "head": policy.head,
            "activation": policy.activation, "card": card})  # fmt: skip
        with pytest.raises(PolicyFileError):
            Policy.load(tmp_path / "x.safetensors")
    for text in (f"robots = {DEEP}", f"steps = {LONG}"):
        (tmp_path / "x.toml").write_text(text)
        with pytest.raises(SettingsError, match=r"x\.toml, which cannot be read"):
            read_sweep(tmp_path / "x.toml")
