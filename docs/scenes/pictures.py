"""Draws the pictures of this folder: pictures.py FOLDER_OF_THE_PROGRAMS, say build/release/bin.

They come from the output of the example programs and of kschur; needs NumPy, h5py and Matplotlib.
"""
import json
import pathlib
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree

if len(sys.argv) != 2 or sys.argv[1] in ("-h", "--help"):
    print(__doc__, end="", file=sys.stdout if len(sys.argv) == 2 else sys.stderr)
    sys.exit(len(sys.argv) != 2)

import h5py
import matplotlib
import numpy as np

matplotlib.use("Agg")
from matplotlib import pyplot as plt
from matplotlib.collections import LineCollection
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

PROGRAMS = pathlib.Path(sys.argv[1]).resolve()
HERE = pathlib.Path(__file__).resolve().parent
plt.rcParams.update({"figure.dpi": 130, "font.size": 9, "axes.grid": True, "grid.alpha": 0.3, "svg.hashsalt": "kschur"})


def example(name, *words):
    """The numbers that an example prints; its other lines start with #."""
    run = subprocess.run([PROGRAMS / f"example_{name}", *map(str, words)], capture_output=True, text=True, check=True)
    return np.loadtxt(run.stdout.splitlines(), ndmin=2)


def modes(folder, scene, *options):
    """The modes of a scene, as kschur solve prints them."""
    path = f"{folder}/scene.h5"
    subprocess.run([PROGRAMS / "kschur", "scene", *scene.split(), "--output", path], check=True, capture_output=True)
    run = subprocess.run([PROGRAMS / "kschur", "solve", path, "--format", "json", *map(str, options)],
                         check=True, capture_output=True, text=True)
    return json.loads(run.stdout)["modes"]


def read_vtu(path):
    """Points, cells and the real parts of the modes of a .vtu file in ASCII."""
    piece = ElementTree.parse(path).getroot().find("UnstructuredGrid").find("Piece")
    points = np.array(piece.find("Points")[0].text.split(), dtype=float).reshape(-1, 3)
    cells = {a.get("Name"): np.array(a.text.split(), dtype=int) for a in piece.find("Cells")}
    shapes = [np.array(a.text.split(), dtype=float).reshape(-1, 3) for a in piece.find("PointData")][::2]
    return points, np.split(cells["connectivity"], cells["offsets"][:-1]), shapes


def save(figure, name):
    figure.tight_layout()
    figure.savefig(HERE / f"{name}.png", bbox_inches="tight")
    plt.close(figure)
    print(f"{name}.png")


def draw_shape(axes, points, moved, cells, azimuth, elevation):
    """A structure at rest and moved, seen in parallel from a direction (degrees), with the directions of its axes."""
    a, e = np.radians([azimuth, elevation])
    view = np.array([[-np.sin(a), np.cos(a), 0], [-np.sin(e) * np.cos(a), -np.sin(e) * np.sin(a), np.cos(e)]])
    for place, color, width, label in ((points, "lightgray", 1.0, "at rest"), (moved, "tab:blue", 1.2, "moved")):
        flat = place @ view.T
        axes.add_collection(LineCollection([flat[list(cell)] for cell in cells], colors=color, linewidths=width, label=label))
    axes.autoscale()
    axes.set(aspect="equal")
    axes.set_axis_off()
    arrows = 0.12 * np.ptp(points @ view.T, axis=0).max() * view.T
    corner = (np.vstack([points, moved]) @ view.T).min(axis=0) - np.minimum(arrows.min(axis=0), 0)
    for name, arrow in zip("xyz", arrows):
        axes.annotate("", corner + arrow, corner, annotation_clip=False,
                      arrowprops={"arrowstyle": "->", "linewidth": 0.8, "shrinkA": 0, "shrinkB": 0})
        axes.text(*(corner + 1.4 * arrow), name, fontsize=8, ha="center", va="center")


def draw_grid(folder):
    example("grid", "8x6", f"{folder}/grid.vtu")
    points, cells, shapes = read_vtu(f"{folder}/grid.vtu")
    hertz = [mode["frequency_hz"] for mode in modes(folder, "grid --cells 8x6", "--modes", 17)]
    figure, axes = plt.subplots(2, 2, figsize=(9, 5.6))
    for ax, k in zip(axes.flat, (12, 13, 14, 16)):
        draw_shape(ax, points, points + 1.5 * shapes[k], cells, -60, 30)
        ax.set_title(f"mode {k + 1}, {hertz[k]:.3f} Hz")
    axes[0, 1].legend(loc="upper right", fontsize=8)
    save(figure, "grid")


def draw_crank(folder):
    meshes = example("crank", 4, f"{folder}/crank.vtu")
    points, cells, shapes = read_vtu(f"{folder}/crank.vtu")
    faces = {}
    for cell in cells:
        for face in ((0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3)):
            key = tuple(sorted(cell[list(face)]))
            faces[key] = faces.get(key, 0) + 1
    surface = np.array([face for face, count in faces.items() if count == 1])
    figure, axes = plt.subplots(1, 3, figsize=(11, 3.2), width_ratios=(1.2, 1.2, 0.8))
    for ax, k in zip(axes, (0, 1)):
        moved = points + 0.04 * shapes[k]
        ax.tripcolor(moved[:, 0], moved[:, 1], surface, np.linalg.norm(shapes[k], axis=1), shading="gouraud", cmap="viridis")
        ax.set(aspect="equal", title="the motion of the mechanism" if k == 0 else f"first flexible mode, {meshes[-1, 3]:.0f} Hz")
        ax.set_axis_off()
    lines = axes[2].loglog(meshes[:, 1], meshes[:, 3:], "o-")
    axes[2].legend(lines, [f"flexible mode {k + 1}" for k in range(len(lines))], fontsize=7, loc="lower left")
    axes[2].set(ylim=(250, None), xlabel="unknowns (-)", ylabel="frequency (Hz)", yticks=(300, 1000, 3000))
    axes[2].yaxis.set_major_formatter("{x:.0f}")
    axes[2].yaxis.set_minor_formatter("")
    save(figure, "crank")


def draw_faces(ax, points, faces, shape, scale):
    """Faces where they have moved, bright where they move most, in space."""
    size = np.linalg.norm(shape, axis=1)
    drawn = Poly3DCollection((points + scale * shape)[faces], edgecolors="black", linewidths=0.2)
    drawn.set_array(size[faces].mean(axis=1))
    ax.add_collection3d(drawn)
    middle, reach = points.mean(axis=0), np.ptp(points, axis=0).max() / 2
    ax.set(xlim=middle[0] + reach * np.array([-1, 1]), ylim=middle[1] + reach * np.array([-1, 1]),
           zlim=middle[2] + reach * np.array([-1, 1]))
    ax.set_box_aspect((1, 1, 1), zoom=1.4)
    ax.set_axis_off()


def draw_block(folder):
    table = example("block", 4, f"{folder}/block.vtu")
    points, cells, shapes = read_vtu(f"{folder}/block.vtu")
    faces = {}
    for cell in cells:
        for corners in ((0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (3, 2, 6, 7), (0, 3, 7, 4), (1, 2, 6, 5)):
            face = cell[list(corners)]
            faces.setdefault(tuple(sorted(face)), []).append(face)
    surface = np.array([found[0] for found in faces.values() if len(found) == 1])
    figure = plt.figure(figsize=(11, 3.2))
    for place, (k, name) in enumerate(((0, "bending"), (2, "twisting"), (5, "bending twice")), 1):
        ax = figure.add_subplot(1, 5, place, projection="3d")
        draw_faces(ax, points, surface, shapes[k], 0.25 / np.abs(shapes[k]).max())
        ax.set_title(f"mode {k + 1}: {name}")
    ax = figure.add_subplot(1, 5, 4)
    for nodes, name in ((10, "tetrahedra"), (8, "bricks")):
        still = table[(table[:, 0] == nodes) & (table[:, 2] == 0)]
        ax.semilogx(still[:, 3], still[:, 4], "o-", markersize=3, label=name)
    ax.legend(fontsize=7)
    ax.set(xlabel="unknowns (-)", ylabel="lowest frequency (Hz)")
    ax = figure.add_subplot(1, 5, 5)
    finest = table[table[:, 1] == table[:, 1].max()]
    ax.plot(finest[:, 2], finest[:, 4:6], "o-", color="tab:blue", markersize=3)
    ax.set(xlabel="speed (rpm)", ylabel="frequency of bending (Hz)")
    save(figure, "block")


def draw_shell(folder):
    table = example("shell", f"{folder}/shell.vtu")
    points, cells, shapes = read_vtu(f"{folder}/shell.vtu")
    figure = plt.figure(figsize=(9, 3))
    for place, k in enumerate((0, 1, 2), 1):
        ax = figure.add_subplot(1, 4, place, projection="3d")
        draw_faces(ax, points, np.array(cells), shapes[k], 0.12 / np.abs(shapes[k]).max())
        ax.view_init(elev=35, azim=-50)
        ax.set_title(f"mode {k + 1}")
    ax = figure.add_subplot(1, 4, 4)
    exact = 49.153593
    ax.loglog(table[:, 0], table[:, 2] / exact - 1, "o-", markersize=3, label="one mesh")
    ax.loglog(table[1:, 0], np.abs(table[1:, 3] / exact - 1), "s-", markersize=3, label="two meshes")
    ax.legend(fontsize=7)
    ax.set(xlabel="elements along an edge (-)", ylabel="relative error of the plate (-)", xticks=(5, 10, 20, 40))
    ax.xaxis.set_major_formatter("{x:.0f}")
    ax.xaxis.set_minor_formatter("")
    save(figure, "shell")


def draw_turbine(folder):
    table = example("turbine", 25, f"{folder}/turbine.vtu")
    figure, axes = plt.subplots(1, 2, figsize=(9, 3.6))
    count = (table.shape[1] - 2) // 2
    axes[0].plot(table[:, 0], table[:, 1:1 + count], ".", color="tab:blue", markersize=4)
    for harmonic in (1, 3, 6):
        axes[0].plot(table[:, 0], harmonic * table[:, 0] / 60, color="gray", linewidth=0.6)
        axes[0].annotate(f"{harmonic}P", (table[-1, 0], harmonic * table[-1, 0] / 60), xytext=(3, 0), textcoords="offset points",
                         color="gray")
    axes[0].set(xlabel="speed (rpm)", ylabel="damped frequency (Hz)", ylim=(0, 2.2), xlim=(-0.5, 13.5), title="Campbell diagram")
    axes[1].semilogy(table[:, 0], 100 * table[:, 1 + count:-1], ".", color="tab:blue", markersize=4)
    axes[1].set(xlabel="speed (rpm)", ylabel="damping ratio (%)", title="stability diagram")
    save(figure, "turbine")
    points, cells, shapes = read_vtu(f"{folder}/turbine.vtu")
    figure, axes = plt.subplots(1, 4, figsize=(9, 3.9))
    for ax, (k, name) in zip(axes, ((0, "tower side to side"), (1, "tower fore and aft"), (5, "collective flap"), (6, "edge"))):
        draw_shape(ax, points, points + 20 * shapes[k], cells, -150, 15)
        ax.set_title(f"{name}\n{table[0, 1 + k]:.2f} Hz")
    axes[0].legend(loc="lower left", bbox_to_anchor=(0.6, 0), fontsize=8)
    save(figure, "turbine-modes")


def draw_cantilever(_):
    table = example("cantilever")
    figure, axes = plt.subplots(1, 2, figsize=(8, 3))
    axes[0].loglog(table[:, 0], table[:, 1], "o", label="10 elements")
    axes[0].loglog(table[:, 0], table[:, 2], label="massless beam")
    axes[0].set(xlabel="mass of the body (kg)", ylabel="first frequency (Hz)")
    axes[0].legend()
    axes[1].loglog(table[:, 0], table[:, 3], "o-")
    axes[1].set(xlabel="mass of the body (kg)", ylabel="worst backward error (-)", ylim=(1e-17, 1e-8))
    save(figure, "cantilever")


def draw_rotor(_):
    table = example("rotor")
    figure, axes = plt.subplots(1, 2, figsize=(8, 3))
    lines = axes[0].plot(table[:, 0], table[:, 1:6], "o-", markersize=3)
    lines += axes[0].plot(table[:, 0], table[:, 0] / 60, color="gray", linewidth=0.6)
    axes[0].legend(lines, [*(f"mode {k}" for k in range(1, 6)), "speed of the shaft"], fontsize=7, ncols=2, loc="upper left")
    axes[0].set(xlabel="speed (rpm)", ylabel="damped frequency (Hz)", ylim=(-5, 230))
    axes[1].plot(table[:, 0], 100 * table[:, 6:11], "o-", markersize=3)
    axes[1].axhline(0, color="black", linewidth=0.8)
    axes[1].set(xlabel="speed (rpm)", ylabel="damping ratio (%)")
    save(figure, "rotor")


def draw_brake(_):
    table = example("brake")
    figure, axes = plt.subplots(figsize=(5, 3))
    for k in (1, 3):
        points = axes.scatter(table[:, k], table[:, k + 1], c=table[:, 0], s=14)
    axes.axvline(0, color="black", linewidth=0.8)
    axes.set(xlabel="real part (1/s)", ylabel="imaginary part (1/s)")
    figure.colorbar(points, label="coefficient of friction")
    save(figure, "brake")


def draw_spring_chain(folder):
    found = [mode["eigenvalue"][1] for mode in modes(folder, "spring-chain --damping none", "--modes", 60)]
    figure, axes = plt.subplots(figsize=(5, 3))
    axes.plot(found, "o", markersize=3, label="computed")
    axes.plot(2 * np.sin(np.arange(60) * np.pi / 120), label="2 sin(j pi/120)")
    axes.set(xlabel="j (-)", ylabel="frequency (rad/s)")
    axes.legend()
    save(figure, "spring-chain")


def draw_free_free(folder):
    found = modes(folder, "free-free", "--modes", 45)
    figure, axes = plt.subplots(figsize=(5, 3))
    for kind, marker in (("rigid", "o"), ("real", "^"), ("underdamped", "s")):
        places = [k + 1 for k, mode in enumerate(found) if mode["kind"] == kind]
        axes.semilogy(places, [found[k - 1]["backward_error"] for k in places], marker, markersize=4, label=kind)
    axes.set(xlabel="mode (-)", ylabel="backward error (-)", ylim=(1e-18, 1e-12))
    axes.legend()
    save(figure, "free-free")


def draw_beam_body(folder):
    reference = [0.03186203916787638, 1.147033410628716, 3.208029301486185, 4.20968757982959, 27.08121339975415,
                 96.16794832572644, 115.4890548367898, 189.1659286964141, 968.7479287601021, 974.923682385529,
                 1889.820391999078, 3286.961235434142, 3462.04613971705, 5605.163263529525, 6809.973433001152,
                 23980.35242401345, 29995.32551176242, 37085.90282988458, 50149.65262278832, 91311.70174230162,
                 152458.5830655474, 863292.6872645169, 1335092.501875816, 1805387.494420379]
    found = [mode["eigenvalue"][1]**2 for mode in modes(folder, "beam-body", "--modes", 24)]
    figure, axes = plt.subplots(figsize=(5, 3))
    axes.semilogy(range(1, 25), np.abs(np.array(found) / reference - 1), "o", markersize=4)
    axes.set(xlabel="mode (-)", ylabel="relative difference of omega^2 (-)", ylim=(1e-16, 1e-8))
    save(figure, "beam-body")


def draw_pendulum(folder):
    path = f"{folder}/pendulum.h5"
    bars = 4
    subprocess.run([PROGRAMS / "kschur", "scene", "pendulum", "--bars", str(bars), "--output", path], check=True, capture_output=True)
    subprocess.run([PROGRAMS / "kschur", "solve", path, "--modes", str(bars), "--output", f"{folder}/result.h5"],
                   check=True, capture_output=True)
    with h5py.File(f"{folder}/result.h5") as file:
        shapes, hertz = file["eigenvectors"][()].real[:, 0::6], file["frequency_hz"][()]
    figure, axes = plt.subplots(1, bars, figsize=(7, 3), sharey=True)
    for ax, shape, f in zip(axes, shapes, hertz):
        ax.plot(np.append(0, 3 * shape / np.abs(shape).max()), -4 * np.arange(bars + 1), "o-")
        ax.set(xlim=(-4, 4), title=f"{f:.3f} Hz", xticks=[])
    axes[0].set(ylabel="height (m)")
    figure.supxlabel("deflection, to scale", fontsize=9)
    save(figure, "pendulum")


def draw_linkage(folder):
    cells, path = 4, f"{folder}/linkage.h5"
    subprocess.run([PROGRAMS / "kschur", "scene", "linkage", "--loops", "4", "--cells-per-loop", str(cells), "--dimensions", "2",
                    "--output", path], check=True, capture_output=True)
    subprocess.run([PROGRAMS / "kschur", "solve", path, "--modes", "9", "--output", f"{folder}/result.h5"],
                   check=True, capture_output=True)
    with h5py.File(path) as file:
        centres = file["coordinates"][()][file["unknown_node"][::3], :2]
    with h5py.File(f"{folder}/result.h5") as file:
        shapes, hertz = file["eigenvectors"][()].real, file["frequency_hz"][()]
    arms = np.array([(0, 0.25) if body % (2 * cells + 1) == 0 else (0.5, 0) for body in range(len(centres))])
    figure = plt.figure(figsize=(9, 3.4))
    places = figure.add_gridspec(3, 2, width_ratios=(1.5, 1))
    for row, k in enumerate((0, 2, 8)):
        ax = figure.add_subplot(places[row, 0])
        x, y, turn = 0.8 / np.abs(shapes[k]).max() * shapes[k].reshape(-1, 3).T
        moved = centres + np.column_stack([x, y])
        swing = arms + turn[:, None] * np.column_stack([-arms[:, 1], arms[:, 0]])
        ax.add_collection(LineCollection(np.stack([centres - arms, centres + arms], axis=1), colors="lightgray"))
        ax.add_collection(LineCollection(np.stack([moved - swing, moved + swing], axis=1), colors="tab:blue"))
        ax.autoscale()
        ax.set(aspect="equal", title=f"mode {k + 1}, {hertz[k]:.3f} Hz")
        ax.set_axis_off()
    space, plane = (np.array([mode["frequency_hz"] for mode in modes(folder, f"linkage --cells-per-loop 4 {words}", "--modes", 56)])
                    for words in ("--tilt 30", "--dimensions 2"))
    ax = figure.add_subplot(places[:, 1])
    ax.semilogy(range(1, 57), np.maximum(np.abs(space / plane - 1), 1e-17), "o", markersize=4)
    ax.set(xlabel="mode (-)", ylabel="relative difference of frequencies,\nin space and in the plane (-)", ylim=(1e-17, 1e-9))
    save(figure, "linkage")


with tempfile.TemporaryDirectory() as temporary:
    for draw in (draw_pendulum, draw_beam_body, draw_block, draw_brake, draw_cantilever, draw_crank, draw_free_free, draw_grid,
                 draw_linkage, draw_rotor, draw_shell, draw_spring_chain, draw_turbine):
        draw(temporary)
