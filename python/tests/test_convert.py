"""Matrices of other codes: each format there and back, halves, names, and what a damaged file says."""
import io
import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
import scipy.io
import scipy.sparse as sparse

import kschur
from kschur import convert
from kschur.errors import Error, FileError, InputError

DATA = Path(__file__).parent / "data"
K = sparse.csr_matrix([[300.0, -100.0, 0.0], [-100.0, 200.0, -100.0], [0.0, -100.0, 100.25]])
M = sparse.csr_matrix(np.diag([2.0, 1.0, 0.5]))
# Not symmetric, as whirling parts are: rows and columns mixed up would be seen.
R = sparse.csr_matrix([[0.5, 3.0, 0.0], [-3.0, 0.0, 0.0], [0.0, 0.0, 0.25]])
CQ = sparse.csr_matrix([[1.0, 0.0, -2.0]])


def same(problem, mass=M, stiffness=K, damping=None, constraints=None):
    for found, wanted in zip(problem, (mass, stiffness, damping, constraints)):
        assert (found is None) == (wanted is None)
        if wanted is not None:
            assert found.shape == wanted.shape and np.array_equal(found.toarray(), wanted.toarray())


def write_mat(folder):
    scipy.io.savemat(folder / "p.mat", {"M": M, "K": K, "R": R.toarray(), "Cq": CQ, "title": "chain"})
    return [folder / "p.mat"]


def write_mat73(folder):
    with h5py.File(folder / "p.mat", "w", userblock_size=512) as file:
        for name, matrix in {"M": M, "K": K, "Cq": CQ}.items():
            columns, group = sparse.csc_matrix(matrix), file.create_group(name)
            group.attrs["MATLAB_sparse"], group.attrs["MATLAB_class"] = np.uint64(matrix.shape[0]), np.bytes_("double")
            for key, array in {"jc": columns.indptr, "ir": columns.indices}.items():
                group[key] = array.astype(np.uint64)
            group["data"] = columns.data
        file["R"] = R.toarray().T
        file["R"].attrs["MATLAB_class"] = np.bytes_("double")
    with (folder / "p.mat").open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")
    return [folder / "p.mat"]


def write_npz(folder):
    np.savez(folder / "p.npz", M=M.toarray(), K=K.toarray(), R=R.toarray(), Cq=CQ.toarray())
    return [folder / "p.npz"]


def write_npz_each(folder):
    for name, matrix in {"M": M, "K": K, "R": R, "Cq": CQ}.items():
        sparse.save_npz(folder / f"{name}.npz", matrix)
    return [folder / f"{name}.npz" for name in ("M", "K", "R", "Cq")]


def write_petsc(folder):
    with (folder / "p.petsc").open("wb") as file:
        for matrix in (M, K, R, CQ):
            np.array([1211216, *matrix.shape, matrix.nnz, *np.diff(matrix.indptr), *matrix.indices], ">i4").tofile(file)
            matrix.data.astype(">f8").tofile(file)
    return [folder / "p.petsc"]


@pytest.mark.parametrize("writer", [write_mat, write_mat73, write_npz, write_npz_each, write_petsc])
def test_all_four_matrices_there_and_back(tmp_path, writer):
    same(kschur.read(*writer(tmp_path)), damping=R, constraints=CQ)


def write_hb(folder):
    """Whole, and as a half, which is what ANSYS writes."""
    for name, matrix in {"M": sparse.tril(M), "K": sparse.tril(K), "R": R}.items():
        text = io.StringIO()
        scipy.io.hb_write(text, sparse.csc_matrix(matrix))
        lines = text.getvalue().splitlines(keepends=True)
        if name != "R":
            assert lines[2].startswith("RUA")
            lines[2] = "RSA" + lines[2][3:]
        (folder / f"{name}.hb").write_text("".join(lines))
    return [folder / f"{name}.hb" for name in ("M", "K", "R")]


def test_harwell_boeing(tmp_path):
    same(kschur.read(*write_hb(tmp_path)), damping=R)


def abaqus(matrix, half, nodes):
    lines = ["**", f"*MATRIX INPUT, NAME=X, TYPE={'SYMMETRIC' if half else 'UNSYMMETRIC'}"]
    entries = sparse.coo_matrix(sparse.tril(matrix) if half else matrix)
    for i, j, value in zip(entries.row, entries.col, entries.data):
        lines.append(f"{nodes[i]},{nodes[j]}, {value:.15e}")
    return "\n".join(lines) + "\n"


def write_abaqus(folder):
    for name, matrix in {"job_MASS1": M, "job_STIF1": K, "job_DMPV1": R}.items():
        (folder / f"{name}.mtx").write_text(abaqus(matrix, matrix is not R, ["7,1", "7,2", "12,1"]))
    return sorted(folder.glob("*.mtx"))


def test_abaqus_matrix_input_keeps_names(tmp_path):
    problem = kschur.read(*write_abaqus(tmp_path))
    same(problem, damping=R)
    assert problem.labels == ["7.1", "7.2", "12.1"]


def test_abaqus_coordinate(tmp_path):
    for name, matrix in {"a_MASS2": M, "a_STIF2": K}.items():
        entries = sparse.coo_matrix(matrix)
        (tmp_path / f"{name}.mtx").write_text("".join(f"{i + 1} {j + 1} {v:.15e}\n" for i, j, v in
                                                     zip(entries.row, entries.col, entries.data)))
    same(kschur.read(*tmp_path.glob("*.mtx")))


@pytest.mark.parametrize("with_held", [False, True])
def test_abaqus_held_unknowns_are_constraints(tmp_path, with_held):
    """Two masses on springs, the first to a held node, which the mass may leave out."""
    (tmp_path/"job_STIF2.mtx").write_text("1,1, 1,1, 1e36\n2,1, 1,1, -100\n2,1, 2,1, 200\n3,1, 2,1, -100\n3,1, 3,1, 100\n")
    (tmp_path/"job_MASS2.mtx").write_text("1,1, 1,1, 1\n"*with_held + "2,1, 2,1, 1\n3,1, 3,1, 1\n")
    problem = kschur.read(tmp_path/"job_MASS2.mtx", tmp_path/"job_STIF2.mtx")
    assert problem.labels == ["1.1", "2.1", "3.1"] and problem.constraints.toarray().tolist() == [[1, 0, 0]]
    assert abs(problem.stiffness).max() == 200 and problem.mass.diagonal().tolist() == [with_held, 1, 1]
    found = kschur.solve(problem.mass, problem.stiffness, None, problem.constraints, modes=2)
    assert (2*np.pi*found.frequency_hz)**2 == pytest.approx([50*(3 - 5**0.5), 50*(3 + 5**0.5)])
    done = run(*tmp_path.glob("*.mtx"), tmp_path/"out.h5")
    assert done.returncode == 0 and done.stdout == (f"{tmp_path}/out.h5: 3 unknowns, 1 constraints\n{tmp_path}/job_STIF2.mtx: 1 unknowns with 1e36 "
                                                    "on the diagonal are held: rows of Cq say so in its place\n")
    (tmp_path/"job_MASS2.mtx").write_text("2,1, 2,1, 1\n4,1, 4,1, 1\n")
    with pytest.raises(InputError, match="other unknowns"):
        kschur.read(tmp_path/"job_MASS2.mtx", tmp_path/"job_STIF2.mtx")


def ccx(folder):
    """What CalculiX wrote of beam.inp."""
    for ending in ("sti", "mas", "dof"):
        shutil.copy(DATA / f"beam.{ending}", folder)
    return [folder / "beam.sti", folder / "beam.mas"]


def test_calculix_has_whole_matrices_with_names(tmp_path):
    problem = kschur.read(*ccx(tmp_path))
    assert problem.stiffness.shape == (24, 24) and abs(problem.stiffness - problem.stiffness.T).max() == 0
    assert problem.labels[:4] == ["5.1", "5.2", "5.3", "6.1"]
    # Displaced by s <= 1 over the height s from the clamped end, then by 1: the integral of its square is 1/3 + 1.
    along = np.array([label.endswith(".1") for label in problem.labels], float)
    assert along @ problem.mass @ along == pytest.approx(7.8e-9*4/3, rel=1e-10)


def write_op4(folder):
    """Binary and sparse, text and dense."""
    op4 = pytest.importorskip("pyyeti.nastran.op4")
    op4.write(folder / "k.op4", {"KAA": K, "BAA": R})
    op4.write(folder / "m.op4", ["MAA"], [M.toarray()], binary=False, forms=[6])
    return [folder / "k.op4", folder / "m.op4"]


def test_op4(tmp_path):
    same(kschur.read(*write_op4(tmp_path)), damping=R)


def write_dmig(folder):
    """Halves of symmetric matrices, and a whole unsymmetric one."""
    bdf = pytest.importorskip("pyNastran.bdf.bdf")
    model = bdf.BDF(debug=None)
    unknowns = [(7, 1), (7, 2), (12, 1)]
    for name, matrix, form in (("KAA", sparse.tril(K), 6), ("MAA", sparse.tril(M), 6), ("BAA", R, 1)):
        entries = sparse.coo_matrix(matrix)
        model.add_dmig(name, form, 2, 0, 0, 3, [unknowns[k] for k in entries.col], [unknowns[k] for k in entries.row], entries.data)
    model.write_bdf(folder / "p.pch", size=16, is_double=True)
    return [folder / "p.pch"]


def test_dmig_keeps_names(tmp_path):
    problem = kschur.read(*write_dmig(tmp_path))
    same(problem, damping=R)
    assert problem.labels == ["7.1", "7.2", "12.1"]


WRITERS = [write_op4, write_dmig, write_mat, write_mat73, write_npz, write_npz_each, write_petsc, write_hb, write_abaqus, ccx]


def run(*words):
    return subprocess.run([sys.executable, "-c", "import sys; from kschur.convert import main; main(sys.argv[1:])",
                           *map(str, words)], capture_output=True, text=True)


@pytest.mark.parametrize("writer", WRITERS)
def test_a_damaged_file_gives_one_line_and_writes_nothing(tmp_path, writer):
    paths = writer(tmp_path)
    content = paths[0].read_bytes()
    for damaged in (content[:len(content)*2//3 - 1], b"", b"\x07nonsense\n"*40):
        paths[0].write_bytes(damaged)
        before = sorted(tmp_path.iterdir())
        done = run(*paths, tmp_path/"out.h5")
        assert done.returncode == 2 and done.stdout == ""
        assert done.stderr.startswith("kschur: ") and done.stderr.count("\n") == 1 and str(paths[0]) in done.stderr
        assert sorted(tmp_path.iterdir()) == before


def test_converted_file_is_a_problem_with_names(tmp_path):
    done = run(*ccx(tmp_path), tmp_path/"beam.h5")
    assert done.returncode == 0 and done.stdout == f"{tmp_path}/beam.h5: 24 unknowns, 0 constraints\n"
    with h5py.File(tmp_path/"beam.h5") as file:
        assert file["unknown_label"][0] == b"5.1" and file["stiffness"].attrs["shape"].tolist() == [24, 24]


def test_an_input_is_not_taken_for_the_output(tmp_path):
    paths = ccx(tmp_path)
    before = paths[1].read_bytes()
    assert run(*paths).returncode == 1 and paths[1].read_bytes() == before


def test_other_names(tmp_path):
    scipy.io.savemat(tmp_path/"p.mat", {"A": K, "B": M})
    with pytest.raises(InputError, match="which matrix is the mass. Say --mass NAME; there are A, B"):
        kschur.read(tmp_path/"p.mat")
    same(kschur.read(tmp_path/"p.mat", mass="B", stiffness="A"))
    with pytest.raises(InputError, match="there is no matrix X"):
        kschur.read(tmp_path/"p.mat", mass="X", stiffness="A")


def test_what_cannot_be(tmp_path):
    with pytest.raises(FileError, match="No such file"):
        kschur.read(tmp_path/"p.mat")
    with pytest.raises(InputError, match="no known format"):
        kschur.read(tmp_path/"p.docx")
    scipy.io.savemat(tmp_path/"p.mat", {"K": K, "M": M[:2, :2]})
    with pytest.raises(Error, match="the mass is 2 x 2, which does not fit 3 unknowns"):
        kschur.read(tmp_path/"p.mat")
