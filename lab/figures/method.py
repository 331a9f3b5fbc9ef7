"""The figures of docs/method.md. Everything in them is computed by the formulas of that page.

Usage: PYTHONPATH=scripts /usr/bin/python3 -m figures.method docs/images
"""
import sys

import matplotlib
if __name__ == '__main__':
    matplotlib.use('Agg')

import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402
from matplotlib.patches import Arc, Circle, Polygon, Rectangle  # noqa: E402

from .tables import save  # noqa: E402

INK, GREY, PALE = '#1b1f24', '#6e7781', '#d0d7de'
BLUE, ORANGE, GREEN, RED = '#0969da', '#e16f24', '#1a7f37', '#cf222e'
STYLE = {'font.size': 13, 'axes.edgecolor': GREY, 'axes.titlesize': 14, 'axes.titlelocation': 'left', 'text.color': INK,
         'mathtext.fontset': 'dejavusans'}

# The grid, as in include/bki_mapping/core/types.h, src/map/block_group.h and src/beams/raster/group_sums.h.
BLOCK_EDGE = 8  # voxels
GROUP_EDGE = 4  # blocks
HALO_ACROSS, HALO_ALONG = 6, 8  # voxels on each side of a group, across rows of voxels and along them
TABLE_ROWS, TABLE_COLUMNS = 128, 1024  # src/beams/beam_cells.h
COUNTS = 0.974  # fraction of the support radius beyond which the sparse kernel is below 1.1e-7


# (a) A ball on the sphere of directions

def unit(azimuth, elevation):
    return np.stack([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth),
                     np.sin(elevation) + 0 * azimuth], axis=-1)


def ball_extent(elevation, distance, radius):
    """Half extents in elevation and azimuth of a ball, Equations (8) and (9); None: all azimuths."""
    delta = np.arcsin(radius / distance)
    if np.abs(elevation) + delta >= np.pi / 2:
        return delta, None
    return delta, np.arcsin(np.sin(delta) / np.cos(elevation))


def ball_outline(azimuth, elevation, delta, count=721):
    """Unit vectors on the circle of directions that graze the ball."""
    centre = unit(np.array(azimuth), np.array(elevation))
    east = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    north = np.cross(centre, east)
    turn = np.linspace(0, 2 * np.pi, count)[:, None]
    return np.cos(delta) * centre + np.sin(delta) * (np.cos(turn) * east + np.sin(turn) * north)


def draw_side_view(axes):
    """The plane through the sensor, the vertical axis and the centre of the ball."""
    distance, radius, elevation = 4.0, 1.25, np.radians(24)
    delta = ball_extent(elevation, distance, radius)[0]
    centre = distance * np.array([np.cos(elevation), np.sin(elevation)])
    axes.plot([0, 5.6], [0, 0], color=PALE, linewidth=1.5)
    for angle in (elevation - delta, elevation + delta):
        tip = 5.5 * np.array([np.cos(angle), np.sin(angle)])
        axes.plot([0, tip[0]], [0, tip[1]], color=BLUE, linewidth=1.6)
    axes.plot([0, centre[0]], [0, centre[1]], color=INK, linewidth=1.2, linestyle=(0, (5, 3)))
    axes.add_patch(Circle(centre, radius, facecolor=ORANGE, alpha=0.25))
    axes.add_patch(Circle(centre, radius, fill=False, edgecolor=ORANGE, linewidth=2))
    touch = np.sqrt(distance ** 2 - radius ** 2) * np.array([np.cos(elevation + delta), np.sin(elevation + delta)])
    axes.plot(*np.stack([centre, touch]).T, color=INK, linewidth=1.2)
    axes.add_patch(Rectangle(centre - 0.13, 0.26, 0.26, facecolor=INK))
    axes.plot(0, 0, '^', color=RED, markersize=11, clip_on=False)
    axes.add_patch(Arc((0, 0), 3.6, 3.6, theta1=np.degrees(elevation), theta2=np.degrees(elevation + delta), color=BLUE,
                       linewidth=2))
    axes.add_patch(Arc((0, 0), 2.3, 2.3, theta1=0, theta2=np.degrees(elevation), color=INK, linewidth=1.2))
    middle = elevation + delta / 2
    axes.text(2.03 * np.cos(middle), 2.03 * np.sin(middle), r'$\delta$', color=BLUE, ha='center', va='center', fontsize=16)
    axes.text(1.36 * np.cos(elevation / 2), 1.36 * np.sin(elevation / 2) - 0.03, r'$\theta$', va='center', ha='center')
    axes.text(*(centre + touch) / 2 + np.array([0.13, 0.06]), r'$l$', fontsize=15)
    along = 0.64 * centre
    axes.text(along[0] + 0.12, along[1] - 0.2, r'$r$', fontsize=15, ha='left', va='top')
    axes.text(centre[0] + 0.25, centre[1] - 0.12, 'voxel\ncentre', va='top', linespacing=1.0)
    axes.text(-0.05, -0.28, 'sensor', color=RED, ha='center', va='top')
    axes.text(0.0, 3.55, r'$\sin\delta = l\,/\,r$', color=BLUE, fontsize=16)
    axes.set(xlim=(-0.5, 6.0), ylim=(-0.75, 4.1), aspect='equal', title='Side view: the beams that reach a voxel')
    axes.axis('off')


BALLS = [  # azimuth, elevation [degrees], radius / distance, colour
    (40, 0, np.sin(np.radians(14)), ORANGE),
    (-40, 45, np.sin(np.radians(14)), GREEN),
    (172, -20, np.sin(np.radians(14)), BLUE),
    (100, 80, np.sin(np.radians(14)), RED),
]


def draw_sphere(axes):
    """The sphere of directions, seen from above the horizon."""
    look = unit(np.radians(np.array(25.0)), np.radians(np.array(28.0)))
    right = np.cross([0, 0, 1], look)
    right /= np.linalg.norm(right)
    up = np.cross(look, right)

    def plot(points, fill=None, **style):
        front = points @ look > 0
        flat = np.stack([points @ right, points @ up], axis=-1)
        if fill and front.all():
            axes.add_patch(Polygon(flat, facecolor=fill, alpha=0.25))
        flat = np.where(front[:, None], flat, np.nan)
        axes.plot(flat[:, 0], flat[:, 1], **style)

    axes.add_patch(Circle((0, 0), 1, facecolor='#f6f8fa', edgecolor=GREY, linewidth=1.4))
    turn = np.linspace(-np.pi, np.pi, 721)
    for elevation in np.radians([-60, -30, 0, 30, 60]):
        plot(unit(turn, np.full_like(turn, elevation)), color=PALE, linewidth=1)
    rise = np.linspace(-np.pi / 2, np.pi / 2, 361)
    for azimuth in np.radians(np.arange(-180, 180, 30)):
        plot(unit(np.full_like(rise, azimuth), rise), color=PALE, linewidth=1)
    for azimuth, elevation, sine, color in BALLS:
        delta = np.arcsin(sine)
        plot(ball_outline(np.radians(azimuth), np.radians(elevation), delta), fill=color, color=color, linewidth=2.2)
    axes.set(xlim=(-1.08, 1.08), ylim=(-1.1, 1.1), aspect='equal', title='Equal balls on the sphere of directions')
    axes.axis('off')


def draw_unrolled(axes):
    """Azimuth and elevation: exact outlines, and the rectangles that the table looks up."""
    for azimuth, elevation, sine, color in BALLS:
        delta, width = ball_extent(np.radians(elevation), 1.0, sine)
        low, high = elevation - np.degrees(delta), min(elevation + np.degrees(delta), 90.0)
        spans = [(-180.0, 180.0)]
        if width is not None:
            first, last = azimuth - np.degrees(width), azimuth + np.degrees(width)
            spans = [(first, last)] if last <= 180 else [(first, 180.0), (-180.0, last - 360)]
        for first, last in spans:
            axes.add_patch(Rectangle((first, low), last - first, high - low, facecolor=color, alpha=0.14))
            axes.add_patch(Rectangle((first, low), last - first, high - low, fill=False, edgecolor=color, linewidth=1.4,
                                     linestyle=(0, (4, 2)), clip_on=False))
        outline = ball_outline(np.radians(azimuth), np.radians(elevation), delta)
        x, y = np.degrees(np.arctan2(outline[:, 1], outline[:, 0])), np.degrees(np.arcsin(outline[:, 2]))
        x[np.abs(np.diff(x, append=x[-1:])) > 180] = np.nan
        axes.plot(x, y, color=color, linewidth=2.2)

    def size(x, y, text, color, **style):
        axes.text(x, y, text, color=color, fontsize=12, **{'ha': 'center', 'va': 'center', **style})

    size(62, 0, r'$2\delta = 28°$ wide and high', ORANGE, ha='left')
    wide = 2 * np.degrees(ball_extent(np.radians(45), 1.0, BALLS[1][2])[1])
    size(-40, 23, rf'{wide:.0f}° wide: $\sin\delta\,/\,\cos\theta$', GREEN)
    size(178, -44, 'over the seam: two\npieces in each row', BLUE, ha='right', linespacing=1.1)
    size(-100, 74, 'over the pole: all azimuths', RED)
    axes.set(xlim=(-180, 180), ylim=(-60, 92), xticks=range(-180, 181, 60), yticks=range(-60, 91, 30), xlabel='azimuth [°]',
             ylabel='elevation [°]', title='Azimuth and elevation: outline of each ball, rectangle that is looked up')
    axes.grid(True, color=PALE, linewidth=0.8)
    axes.set_axisbelow(True)


def draw_ball(output):
    figure = plt.figure(figsize=(9.6, 8.8))
    grid = figure.add_gridspec(2, 2, height_ratios=[1.0, 1.05])
    draw_side_view(figure.add_subplot(grid[0, 0]))
    draw_sphere(figure.add_subplot(grid[0, 1]))
    draw_unrolled(figure.add_subplot(grid[1, :]))
    figure.tight_layout(h_pad=2.0)
    save(figure, output, 'method_ball.png')
    plt.close(figure)


# (b) A beam in slices

SLOPE_SIDE, SLOPE_HEIGHT, REACH = 0.38, 0.15, 1.0  # by step along the main axis; [voxels]
HEIGHT_AT_0 = 0.3  # of the beam where it starts in the figure [voxels]
DIRECTION = np.array([1.0, SLOPE_SIDE, SLOPE_HEIGHT]) / np.sqrt(1 + SLOPE_SIDE ** 2 + SLOPE_HEIGHT ** 2)
SLICINGS = {  # v: from column to column, n: across slices; along main, side, height. show: the slice drawn below
    'Straight slices': {'v': (0, 1, 0), 'n': (1, 0, 0), 'show': 3},
    'Sheared slices': {'v': (1, -2, 0), 'n': (2, 1, 0), 'show': 7},
}
MAIN, SIDE = range(-1, 8), range(-2, 5)  # voxels in the view from above


def slice_form(slicing):
    """A, B, C of Equation (16), and (u n)^2."""
    v, n, u = np.array(slicing['v'], float), np.array(slicing['n'], float), DIRECTION
    a, b, c = v @ v - (u @ v) ** 2, -(u @ v) * u[2], 1 - u[2] ** 2
    across = (u @ n) ** 2
    assert np.isclose(a * c - b * b, across)
    return a, b, c, across


def beam_in_slice(slicing, number):
    """Where the beam passes a slice, along the main axis [voxels]."""
    return number / (np.array(slicing['n'], float) @ DIRECTION / DIRECTION[0])


def column_offset(slicing, main, side):
    """Offset of a column from the beam in its slice [columns]."""
    at = beam_in_slice(slicing, np.dot(slicing['n'][:2], (main, side)))
    return side - SLOPE_SIDE * at if slicing['v'][0] == 0 else main - at


def sparse_kernel(r):
    r = np.minimum(r, 1.0)
    return (2 + np.cos(2 * np.pi * r)) / 3 * (1 - r) + np.sin(2 * np.pi * r) / (2 * np.pi)


def draw_plan(axes, name, slicing):
    """From above: which columns the kernel reaches, slice by slice."""
    _, _, c, across = slice_form(slicing)
    half = COUNTS * REACH * np.sqrt(c / across)
    colors = (BLUE, ORANGE, GREEN)
    counts = {}
    for main in MAIN:
        for side in SIDE:
            number = int(np.dot(slicing['n'][:2], (main, side)))
            if abs(column_offset(slicing, main, side)) <= half:
                counts[number] = counts.get(number, 0) + 1
                axes.add_patch(Rectangle((main - 0.5, side - 0.5), 1, 1, facecolor=colors[number % 3], alpha=0.38,
                                         edgecolor='white', linewidth=1.5))
    for number in counts:
        side = np.array([SIDE[0] - 0.6, SIDE[-1] + 0.6])
        main = (number - slicing['n'][1] * side) / slicing['n'][0]
        shown = number == slicing['show']
        axes.plot(main, side, color=INK if shown else colors[number % 3], linewidth=2.6 if shown else 1.2)
    for main in MAIN:
        axes.plot(np.full(len(SIDE), main), SIDE, '.', color=INK, markersize=4)
    ends = np.array([-2.0, 9.0])
    axes.plot(ends, SLOPE_SIDE * ends, color=RED, linewidth=2.4)
    width = COUNTS * REACH * np.sqrt(1 + SLOPE_SIDE ** 2)
    for sign in (-1, 1):
        axes.plot(ends, SLOPE_SIDE * ends + sign * width, color=RED, linewidth=1.2, linestyle=(0, (4, 3)))
    whole = [count for number, count in counts.items() if -0.5 < beam_in_slice(slicing, number) < 6.5]
    each = ' or '.join(str(count) for count in sorted(set(whole)))
    axes.set(xlim=(MAIN[0] - 0.6, MAIN[-1] + 0.6), ylim=(SIDE[0] - 0.6, SIDE[-1] + 0.6), aspect='equal', xticks=[],
             yticks=[], title=f'{name}: {each} column{"" if each == "1" else "s"} each')
    axes.set_xlabel('main axis')
    axes.set_ylabel('side axis')


def draw_section(axes, slicing):
    """The slice in bold: the ellipse that the kernel cuts out, and the voxel centres in it."""
    a, b, c, across = slice_form(slicing)
    e_side, e_height, g_height = np.sqrt(a), b / np.sqrt(a), np.sqrt(across / a)  # Equation (17)
    reach, pitch = COUNTS * REACH, np.linalg.norm(slicing['v'])  # voxels from column to column
    turn = np.linspace(0, 2 * np.pi, 361)
    height = reach * np.sin(turn) / g_height
    side = (reach * np.cos(turn) - e_height * height) / e_side
    half_side, half_height = reach * np.sqrt(c / across), reach * np.sqrt(a / across)
    assert np.isclose(side.max(), half_side, rtol=1e-3) and np.isclose(height.max(), half_height, rtol=1e-3)
    axes.add_patch(Rectangle((-pitch * half_side, -half_height), 2 * pitch * half_side, 2 * half_height, fill=False,
                             edgecolor=GREY, linewidth=1.2, linestyle=(0, (4, 3))))
    axes.fill(pitch * side, height, color=RED, alpha=0.12)
    axes.plot(pitch * side, height, color=RED, linewidth=2)
    axes.plot(0, 0, 'x', color=RED, markersize=9, markeredgewidth=2.2)
    at = beam_in_slice(slicing, slicing['show'])
    beam_column = SLOPE_SIDE * at if slicing['v'][0] == 0 else at
    beam_height = HEIGHT_AT_0 + SLOPE_HEIGHT * at
    reached = 0
    for column in np.arange(-4, 5) + round(beam_column):
        x = column - beam_column
        axes.plot([pitch * x] * 2, [-2.1, 2.1], color=INK, linewidth=1.0, alpha=0.35, zorder=0)
        for level in np.arange(-3, 4) + round(beam_height):
            y = level - beam_height
            distance = np.hypot(e_side * x + e_height * y, g_height * y)
            reached += distance < reach
            axes.plot(pitch * x, y, 'o', markersize=6 + 14 * sparse_kernel(distance) if distance < reach else 4,
                      color=BLUE if distance < reach else GREY, alpha=0.9 if distance < reach else 0.5)
    axes.set(xlim=(-3.2, 3.2), ylim=(-1.6, 1.6), aspect='equal', xticks=[], yticks=[],
             title=f'The slice in bold: {reached} voxels are reached')
    axes.set_xlabel(f'a: columns, {"1 voxel" if pitch == 1 else "√5 voxels"} apart')
    axes.set_ylabel('b: height axis')


def draw_slices(output):
    figure, axes = plt.subplots(2, 2, figsize=(9.6, 7.2), gridspec_kw={'height_ratios': [1.0, 0.66]})
    for column, (name, slicing) in enumerate(SLICINGS.items()):
        draw_plan(axes[0][column], name, slicing)
        draw_section(axes[1][column], slicing)
    figure.tight_layout(h_pad=1.2, w_pad=2.0)
    save(figure, output, 'method_slices.png')
    plt.close(figure)


# (c) Block, group and halo

def isometric(points):
    points = np.asarray(points, float)
    cos, sin = np.cos(np.radians(30)), np.sin(np.radians(30))
    return np.stack([(points[..., 0] - points[..., 1]) * cos,
                     points[..., 2] + (points[..., 0] + points[..., 1]) * -sin], axis=-1)


def draw_cube(axes, low, edge, cells, color, line, shade=0.9, step_line=0.6):
    """The three faces of a cube that an isometric view shows, with a grid of cells."""
    low = np.array(low, float)
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float) * edge
    for axis, light in ((2, 1.0), (0, 0.86), (1, 0.93)):
        others = [k for k in range(3) if k != axis]

        def on_face(flat):
            points = np.empty((len(flat), 3))
            points[:, axis] = edge
            points[:, others[0]], points[:, others[1]] = flat[:, 0], flat[:, 1]
            return isometric(points + low)
        tone = 1 - (1 - np.array(matplotlib.colors.to_rgb(color))) * shade
        axes.add_patch(Polygon(on_face(corners), facecolor=tone * light, edgecolor=line, linewidth=1.6, zorder=low.sum()))
        for step in np.linspace(0, edge, cells + 1)[1:-1]:
            for flat in ([[step, 0], [step, edge]], [[0, step], [edge, step]]):
                x, y = on_face(np.array(flat, float)).T
                axes.plot(x, y, color=line, linewidth=step_line, zorder=low.sum() + 0.1)


def draw_nesting(axes):
    edge = GROUP_EDGE * BLOCK_EDGE
    draw_cube(axes, (0, 0, 0), edge, GROUP_EDGE, '#c9dcf5', BLUE, step_line=1.0)
    scale = 2.2  # of the block that is drawn apart
    at = np.array([edge + 34.0, 12.0, 14.0])
    draw_cube(axes, at, scale * BLOCK_EDGE, BLOCK_EDGE, '#fbe0cd', ORANGE)
    own = np.array([edge, 0.0, 2.0 * BLOCK_EDGE])
    face = np.array([[0, 0, 0], [0, 1, 0], [0, 1, 1], [0, 0, 1]], float) * BLOCK_EDGE
    axes.add_patch(Polygon(isometric(own + face), facecolor='#f4b183', edgecolor=ORANGE, linewidth=2, zorder=500))
    for corner, target in ((face[3], [0, 1, 1]), (face[1], [0, 1, 0])):
        x, y = np.stack([isometric(own + corner), isometric(at + scale * BLOCK_EDGE * np.array(target))]).T
        axes.plot(x, y, color=ORANGE, linewidth=1.2, linestyle=(0, (4, 3)), zorder=600)
    axes.text(0, -36, 'group: 4 x 4 x 4 blocks,\none job of one thread', color=BLUE, ha='center', va='top', linespacing=1.15)
    x, y = isometric(at + scale * BLOCK_EDGE * np.array([1, 1, 0]))
    axes.text(x, y - 2.5, 'block: 8 x 8 x 8\nvoxels, a plane of\n512 for each class', color=ORANGE, ha='center', va='top',
              linespacing=1.15)
    axes.set(aspect='equal', title='Block and group', xlim=(-30, 64), ylim=(-50, 38))
    axes.axis('off')


def draw_halo(axes):
    """A layer of voxels of a group: the blocks that a scan touches, and what a beam adds, in the halo too."""
    edge, reach = GROUP_EDGE * BLOCK_EDGE, 2.5  # a kernel of two and a half voxels
    start, slope = 18.6, 0.52  # side where main is 0, and its change
    axes.add_patch(Rectangle((-HALO_ACROSS - 0.5, -HALO_ALONG - 0.5), edge + 2 * HALO_ACROSS, edge + 2 * HALO_ALONG,
                             facecolor='#f6f8fa', edgecolor=GREY, linewidth=1.4, linestyle=(0, (4, 3))))
    main, side = np.meshgrid(np.arange(edge), np.arange(-HALO_ALONG, edge + HALO_ALONG))  # straight slices of the group
    distance = np.abs(side - start - slope * main) / np.sqrt(1 + slope ** 2)
    added, inside = distance < COUNTS * reach, (side >= 0) & (side < edge)
    touched = set(zip(main[added & inside] // BLOCK_EDGE, side[added & inside] // BLOCK_EDGE))
    for bx in range(GROUP_EDGE):
        for by in range(GROUP_EDGE):
            axes.add_patch(Rectangle((BLOCK_EDGE * bx - 0.5, BLOCK_EDGE * by - 0.5), BLOCK_EDGE, BLOCK_EDGE, edgecolor=BLUE,
                                     facecolor='#dbe9fb' if (bx, by) in touched else 'white', linewidth=1.0))
    for x, y, d, kept in zip(main[added], side[added], distance[added], inside[added]):
        axes.add_patch(Rectangle((x - 0.5, y - 0.5), 1, 1, facecolor=BLUE if kept else ORANGE,
                                 alpha=0.12 + 0.8 * sparse_kernel(d / reach)))
    axes.add_patch(Rectangle((-0.5, -0.5), edge, edge, fill=False, edgecolor=BLUE, linewidth=2.2))
    ends = np.array([-9.0, edge + 8.0])
    axes.plot(ends, start + slope * ends, color=RED, linewidth=1.8)
    axes.text(-1.0, -HALO_ALONG + 3.2, 'halo: written like any voxel,\nnever read', color='#57606a', va='center',
              fontsize=12, linespacing=1.15)
    axes.text(edge / 2 - 0.5, 3.5, 'untouched blocks', color=GREY, ha='center', va='center', fontsize=12,
              bbox={'facecolor': 'white', 'edgecolor': 'none', 'pad': 1.5})
    axes.text(3.5, 27.8, 'touched\nblocks', color=BLUE, ha='center', va='center', fontsize=10.5, linespacing=1.1)
    axes.set(xlim=(-9, edge + 8), ylim=(-9, edge + 9.5), aspect='equal', title='One layer of a group, and its halo')
    axes.axis('off')


def draw_group(output):
    figure, axes = plt.subplots(1, 2, figsize=(9.6, 4.9), gridspec_kw={'width_ratios': [1.05, 1.0]})
    draw_nesting(axes[0])
    draw_halo(axes[1])
    figure.tight_layout(pad=1.2, w_pad=0.5)
    save(figure, output, 'method_group.png')
    plt.close(figure)


def draw(output):
    with plt.rc_context(STYLE):
        draw_ball(output)
        draw_slices(output)
        draw_group(output)


if __name__ == '__main__':
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    draw(sys.argv[1])
