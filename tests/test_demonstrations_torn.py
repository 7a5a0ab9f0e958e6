"""Files of demonstrations that somebody made to do harm: refused, and never executed."""

import pickle
import struct
import zipfile

import numpy as np
import pytest
from test_demonstrations import some

from revolver_lab.demonstrations import Demonstrations
from revolver_lab.errors import DemonstrationsError


def with_header(path, header):
    """An npz whose arrays all have a header of one's own, and no numbers."""
    with zipfile.ZipFile(path, "w") as file:
        for name in ("lengths", "observations", "actions"):
            text = header.encode() + b"\n"
            file.writestr(f"{name}.npy", b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text)


HEADERS = [
    "{'descr': '<f8', 'fortran_order': False, 'shape': (99999999999999,)}",
    "{'descr': '<f8', 'fortran_order': False, 'shape': (99999999999999999999,)}",
    "{'descr': '<f8', 'fortran_order': False, 'shape': (-1,)}",
    "{'descr': '|O', 'fortran_order': False, 'shape': (1,)}",
    "{'descr': '<f8' 'x", "(" * 60_000, "[" * 3000, '"""', "'", "{'a", "",
]  # fmt: skip


@pytest.mark.parametrize("header", HEADERS, ids=range(len(HEADERS)))
def test_arrays_with_a_header_that_is_none_are_refused(header, tmp_path):
    with_header(tmp_path / "x.npz", header)
    with pytest.raises(DemonstrationsError, match="cannot be read"):
        Demonstrations.load(tmp_path / "x.npz")


@pytest.mark.parametrize("flags", [b"\x01\x00", b"\x20\x00", b"\x40\x00", b"\xff\xff"])
@pytest.mark.parametrize("packed", [None, 1, 9, 12, 14, 93, 99])
def test_a_zip_that_is_encrypted_or_packed_in_another_way_is_refused(flags, packed, tmp_path):
    path = some().save(tmp_path / "x.npz")
    content = bytearray(path.read_bytes())
    for mark, at in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):
        found = content.find(mark)
        while found >= 0:
            content[found + at : found + at + 2] = flags
            if packed is not None:
                content[found + at + 2 : found + at + 4] = struct.pack("<H", packed)
            found = content.find(mark, found + 4)
    path.write_bytes(content)
    with pytest.raises(DemonstrationsError):
        Demonstrations.load(path)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("following", [False, True])
@pytest.mark.parametrize(
    "changes",
    [{"observations": np.float32(3)}, {"actions": np.float64(0)}, {"lengths": np.int64(5)},
     {"rewards": np.float64(0)}, {"actions": np.full((5, 2), 1e300)},
     {"lengths": np.array([2**62, 2**62, 2**62, 2**62 + 5])},
     {"lengths": np.array([2**63, 2**63 + 5], np.uint64)}, {"lengths": np.array([7, -2])},
     {"lengths": np.array([2**61] * 8 + [5])}],
)  # fmt: skip
def test_arrays_without_rows_and_lengths_that_come_round_are_refused(changes, following, tmp_path):
    arrays = {"lengths": np.array([2, 3]), "observations": np.zeros((5, 3)),
              "actions": np.zeros((5, 2))} | changes  # fmt: skip
    if following:
        arrays["next_observations"] = np.zeros((5, 3))
    np.savez(tmp_path / "x.npz", **arrays)
    with pytest.raises(DemonstrationsError):
        Demonstrations.load(tmp_path / "x.npz")


def test_a_single_array_and_a_pickle_are_no_demonstrations(tmp_path):
    np.save(tmp_path / "one.npy", np.zeros(3))
    (tmp_path / "pickle.npz").write_bytes(pickle.dumps({"lengths": [2]}))
    with zipfile.ZipFile(tmp_path / "text.npz", "w") as file:
        for name in ("lengths", "observations", "actions"):
            file.writestr(name, "no array")
    for name in ("one.npy", "pickle.npz", "text.npz"):
        with pytest.raises(DemonstrationsError, match="cannot be read"):
            Demonstrations.load(tmp_path / name)
