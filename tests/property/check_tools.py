#!/usr/bin/env python3
"""Tests of the property test itself, check_tools.py [NUMBER OF SEEDS]: spectra against the assembled matrices, a judge
that sees what is wrong, shrinking."""
import sys
import unittest
from dataclasses import replace
from fractions import Fraction
from functools import cache
from unittest import mock

import mpmath
import numpy as np
import scipy.linalg

import generate as generator
import polynomials
from assemble import Problem
from blocks import block, doubles, number
from edges import EDGES
from judge import DECLINED, FLAGGED, OK, SILENT, Verdict, assign, distance, judge, judge_folder, what_was_asked
from shrink import shrink

SEEDS = range(int(sys.argv.pop()) if sys.argv[-1].isdigit() else 60)
generate = cache(generator.generate)


@cache
def generate_edge(seed):
    """Each kind of problem at the edges in turn."""
    return generator.generate(seed, [EDGES[seed % len(EDGES)]])


def problems():
    """Of all kinds: name, recipe and problem."""
    for seed in SEEDS:
        yield f"seed {seed}", *generate(seed)
        recipe, problem = generate_edge(seed)
        yield f"{recipe.kind} {seed}", recipe, problem


def small_problems(largest):
    for seed in SEEDS:
        recipe, problem = generate(seed)
        if recipe.size + len(recipe.combinations) <= largest:
            yield seed, recipe, problem


def whole(matrix):
    """The entries as Fractions."""
    return [[Fraction(entry) for entry in row] for row in matrix.tolist()]


def independent_rows(rows):
    kept = []
    for row in rows:
        if polynomials.rank(kept + [row]) > len(kept):
            kept.append(row)
    return kept


def bordered(matrix, rows):
    size, count = len(matrix), len(rows)
    return [matrix[i] + [rows[k][i] for k in range(count)] for i in range(size)] + [
        rows[k] + [Fraction(0)] * count for k in range(count)]


class Spectra(unittest.TestCase):
    def test_determinant_of_the_assembled_matrices(self):
        """In rational arithmetic, it is that of the blocks but for a constant factor."""
        seen = 0
        for name, recipe, problem in problems():
            if recipe.size + len(recipe.combinations) > 9:
                continue
            seen += 1
            rows = independent_rows(whole(problem.matrices["Cq"])) if recipe.combinations else []
            zero = np.zeros_like(problem.matrices["M"])
            matrices = [whole(problem.matrices.get(name, zero)) for name in "KRM"]
            borders = [rows, [[Fraction(0)] * recipe.size] * len(rows), [[Fraction(0)] * recipe.size] * len(rows)]
            found = polynomials.determinant_polynomial([bordered(m, b) for m, b in zip(matrices, borders)])
            expected = [Fraction(1)]
            for block in recipe.blocks:
                expected = polynomials.multiply(expected, block.polynomial)
            unit = Fraction(2) ** recipe.time_exponent
            expected = [a / unit**k for k, a in enumerate(expected)]
            self.assertEqual(polynomials.monic(found), polynomials.monic(expected), name)
            zeros = recipe.size + len(rows) - polynomials.rank(bordered(matrices[0], rows))
            self.assertEqual((problem.spectrum[:, :2] == 0).all(axis=1).sum(), zeros, name)
            nonzero = len(expected) - 1 - next(k for k, a in enumerate(expected) if a)
            self.assertEqual(len(problem.spectrum), nonzero + zeros, name)
        self.assertGreater(seen, len(SEEDS) // 3)

    def test_rounding_of_entries_stays_within_the_tolerances(self):
        """Where they are told by single entries: each one, those of constraints too, is changed by its last digit."""
        seen, worst = 0, 0.0
        for seed, (recipe, problem) in [(seed, generate_edge(seed)) for seed in SEEDS] + [
                (seed, generator.generate(seed, EDGES[:1])) for seed in range(60)]:
            rows = independent_rows(whole(problem.matrices["Cq"])) if recipe.combinations else []
            if recipe.size + len(rows) > 6 or len(rows) < len(recipe.combinations):
                continue
            seen += 1
            random = np.random.default_rng(seed)
            zero = np.zeros_like(problem.matrices["M"])

            def rounded(numbers):
                numbers = whole(np.array(numbers, dtype=object))
                return [[a * (1 + Fraction(int(random.choice([-1, 1])), 2**52)) for a in row] for row in numbers]
            none = [[Fraction(0)] * recipe.size] * len(rows)
            borders = [rounded(rows) if rows else rows, none, none]
            matrices = [rounded(problem.matrices.get(name, zero)) for name in "KRM"]
            moved = polynomials.determinant_polynomial([bordered(m, b) for m, b in zip(matrices, borders)])
            found = np.array([complex(root) for root, count in polynomials.roots(moved)])
            for real, imaginary, tolerance in problem.spectrum:
                if real or imaginary:
                    off = min(abs(found - complex(real, imaginary)))
                    self.assertLess(off, tolerance, f"{recipe.kind} {seed}")
                    worst = max(worst, off / tolerance)
        self.assertGreater(seen, len(SEEDS) // 10)
        self.assertGreater(worst, 1e-3)

    def test_residues_where_the_slope_cancels(self):
        problem = block([[400, 200], [200, 100 + Fraction(2)**-45]], [[11, 4], [4, 2]], [[1, 0], [0, 100]])
        for found in problem.eigenvalues:
            with mpmath.workdps(60):
                at = problem.at(found.value)
                adjugate = doubles(mpmath.matrix([[at[1, 1], -at[0, 1]], [-at[1, 0], at[0, 0]]]))
                slope = mpmath.polyval([k * number(Fraction(a)) for k, a in enumerate(problem.polynomial)][:0:-1], found.value)
            self.assertLess(np.linalg.norm(found.coefficient * complex(slope) - adjugate), 1e-6 * np.linalg.norm(adjugate))

    def test_dense_eigenvalues(self):
        """Those of LAPACK's QZ on the companion pencil in a basis of the null space of the constraints."""
        seen = 0
        for seed, recipe, problem in small_problems(40):
            if recipe.units:
                continue
            seen += 1
            unit = 2.0**recipe.time_exponent
            none = np.zeros((recipe.size, recipe.size))
            m, r, k = (problem.matrices.get(name, none) * 2.0**-recipe.mass_exponent * unit**-power
                       for power, name in enumerate("MRK"))
            if recipe.combinations:
                rows = problem.matrices["Cq"]
                rows = rows / np.linalg.norm(rows, axis=1, keepdims=True)
                basis = scipy.linalg.null_space(rows, rcond=1e-9)
                self.assertEqual(basis.shape[1], recipe.kept, f"seed {seed}")
                m, r, k = (basis.T @ a @ basis for a in (m, r, k))
            size = len(m)
            one, none = np.eye(size), np.zeros((size, size))
            alpha, beta = scipy.linalg.eig(np.block([[none, one], [-k, -r]]), np.block([[one, none], [none, m]]),
                                           right=False, homogeneous_eigvals=True)
            finite = abs(beta) > 1e-7 * abs(alpha)
            found = alpha[finite] / beta[finite]
            real, imaginary, tolerance = problem.spectrum.T / unit
            values = real + 1j * imaginary
            # A double zero comes out as two small numbers, infinity as large ones.
            values, tolerance = values[values != 0], tolerance[values != 0]
            matched, wanted = assign(found, values, 10 * tolerance)
            self.assertEqual(len(wanted), len(values), f"seed {seed}: {np.delete(values, wanted)}")
            rest, sizes = abs(np.delete(found, matched)), abs(values) if len(values) else np.ones(1)
            self.assertTrue(((rest < 1e-3 * sizes.min()) | (rest > 1e2 * sizes.max())).all(), f"seed {seed}: {rest}")
        self.assertGreater(seen, len(SEEDS) // 3)


def asking(problem, modes):
    return replace(problem, command=["--modes", str(modes), *problem.command[2:3]])


def exist(problem):
    return int((problem.spectrum[:, 1] >= 0).sum())


def perfect(problem):
    """Exit status and answer of a solver that knows the spectrum."""
    asked, target = what_was_asked(problem.command)
    values = [complex(re, im) for re, im, _ in problem.spectrum if im >= 0]
    values.sort(key=lambda value: distance(value, target))
    fewer = asked > len(values)
    return 3 if fewer else 0, {"reason": "fewer_modes" if fewer else "converged", "certified": None,
                               "modes": [{"eigenvalue": [value.real, value.imag]} for value in values[:asked]]}


class Judgement(unittest.TestCase):
    """Of answers that are made from exact spectra, and of the same with something wrong."""

    def verdict(self, expected, name, problem, status, answer):
        self.assertEqual(judge(problem, status, answer).name, expected, name)

    def test_all_is_right(self):
        for name, _, problem in problems():
            self.verdict("ok", name, problem, *perfect(problem))
            self.verdict("ok", name, problem, 0 if what_was_asked(problem.command)[0] <= exist(problem) else 3,
                         {**perfect(problem)[1], "certified": True})

    def test_the_nearest_mode_is_missing(self):
        seen = 0
        for name, _, problem in problems():
            count, target = exist(problem), what_was_asked(problem.command)[1]
            status, answer = perfect(asking(problem, count))
            near, far = (distance(complex(*answer["modes"][k]["eigenvalue"]), target) for k in (0, -1))
            if far * (1 - 2e-6) <= near + 2 * max(problem.spectrum[:, 2]):
                continue
            seen += 1
            del answer["modes"][0]
            self.verdict("silent", name, asking(problem, count - 1), 0, answer)
            self.verdict("certificate", name, asking(problem, count - 1), 0, {**answer, "certified": True})
            self.verdict("flagged", name, asking(problem, count), 3, {**answer, "reason": "max_restarts"})
        self.assertGreater(seen, len(SEEDS) // 2)

    def test_there_are_more(self):
        for name, _, problem in problems():
            status, answer = perfect(asking(problem, exist(problem) + 1))
            self.verdict("ok", name, asking(problem, exist(problem) + 1), status, answer)
            self.verdict("silent", name, asking(problem, exist(problem) + 1), 0, answer)
            self.verdict("flagged", name, asking(problem, exist(problem)), 3, answer)
            del answer["modes"][-1]
            self.verdict("no more", name, asking(problem, exist(problem) + 1), 3, answer)

    def test_a_number_is_listed_that_is_no_eigenvalue(self):
        for name, _, problem in problems():
            status, answer = perfect(problem)
            last = answer["modes"][-1]["eigenvalue"]
            tolerance = max(problem.spectrum[:, 2])
            for wrong in ([last[0] + 1e3 * max(abs(last[0]), abs(last[1]), tolerance, 1), last[1]], [1e-300, 0]):
                problem_asking_more = asking(problem, len(answer["modes"]) + 1)
                more = {**answer, "modes": answer["modes"] + [{"eigenvalue": wrong}], "reason": "inaccurate"}
                self.verdict("silent", name, problem_asking_more, 0, more)
                self.verdict("spurious", name, problem_asking_more, 3, more)

    def test_a_mode_is_listed_once_too_often(self):
        for name, _, problem in problems():
            problem = asking(problem, 1000)
            status, answer = perfect(problem)
            self.verdict("spurious", name, problem, 3, {**answer, "modes": answer["modes"] + answer["modes"][-1:]})

    def test_a_bound_is_too_small(self):
        for name, _, problem in problems():
            status, answer = perfect(problem)
            if not any(answer["modes"][-1]["eigenvalue"]):
                continue
            tolerance = next(row[2] for row in problem.spectrum if list(row[:2]) == answer["modes"][-1]["eigenvalue"])
            answer["modes"][-1]["eigenvalue"][0] += tolerance / 2
            answer["modes"][-1]["error"] = tolerance
            self.verdict("ok", name, problem, status, answer)
            answer["modes"][-1]["error"] = tolerance / 100
            self.verdict("bound", name, problem, status, answer)

    def test_flags_of_iterations_count_where_the_dense_form_is_right(self):
        verdicts = {"": Verdict(OK), "symmetric": Verdict(DECLINED), "proportional": Verdict(FLAGGED, "8 of 9"),
                    "low-rank": Verdict(OK)}

        def answer(program, folder, problem, *more):
            return verdicts[more[-1] if more else ""], "dense"
        with mock.patch("judge.judge_answer", answer):
            self.assertEqual(str(judge_folder("", "", Problem({}, []))), "iterated: proportional: 8 of 9")
            verdicts["low-rank"] = Verdict(SILENT)
            self.assertEqual(judge_folder("", "", Problem({}, [])).name, SILENT)
            verdicts.update({"proportional": Verdict(OK), "low-rank": Verdict(DECLINED)})
            self.assertEqual(judge_folder("", "", Problem({}, [])).name, OK)


class Shrinking(unittest.TestCase):
    def test_what_does_not_matter_is_left_out(self):
        """A failure that one kind of block causes is reduced to that block."""
        for recipe in [generate(seed)[0] for seed in SEEDS[:20]] + [generate_edge(seed)[0] for seed in SEEDS[:len(EDGES)]]:
            cause = recipe.blocks[-1]
            small = shrink(recipe, lambda candidate: cause in candidate.blocks, trials=10000)
            self.assertEqual((small.blocks, small.removed, small.steps, small.units, small.row_units, small.modes, small.target),
                             ((cause,), (), (), (), (), 1, 0), recipe.kind)


if __name__ == "__main__":
    unittest.main()
