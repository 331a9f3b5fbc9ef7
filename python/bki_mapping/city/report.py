"""What people read of a city: progress while it is made, a report, and a picture from above."""
import collections
import json
import os
import pathlib
import re
import time

from bki_mapping.city import plan

LARGEST = 3000  # edge of the picture [pixels]
DRAWN = 1000  # drives whose ways are drawn, at most
NAMED = 12  # drives that the picture names, at most


class Progress:
    """Says how far a stage is, at most every few seconds, and at its end."""

    def __init__(self, what, count, say, drives=(), interval=5.0):
        """drives: the drive of each task, if they belong to drives."""
        self.what, self.count, self.say, self.interval = what, count, say, interval
        self.left = collections.Counter(drives)
        self.drives = len(self.left)
        self.done = self.failed = 0
        self.more = collections.Counter()
        self.begin = self.said = time.monotonic()

    def step(self, failed=False, drive=None, more=None):
        """more: what else was done, as a word and a number."""
        self.done += 1
        self.failed += failed
        if drive is not None:
            self.left[drive] -= 1
        if more:
            self.more[more[0]] += more[1]
        now = time.monotonic()
        if self.done < self.count and now - self.said < self.interval:
            return
        self.said = now
        elapsed = now - self.begin
        rate = self.done / elapsed if elapsed > 0 else 0.0
        parts = [f'{self.what}: {self.done} of {self.count}']
        if self.left:
            parts.append(f'{sum(n == 0 for n in self.left.values())} of {self.drives} drives')
        parts += [f'{number} {word}' for word, number in self.more.items()]
        parts += [f'{self.failed} failed'] if self.failed else []
        parts.append(f'{rate:.2f} a second')
        if self.done < self.count:
            parts.append(f'{duration((self.count - self.done) / rate)} remain')
        self.say(', '.join(parts))


class Warnings:
    """What programs have warned of: says each kind of sentence once, and counts it."""
    FIGURES = re.compile(r'[\d.]+ ?%|[\d.]+ cm|\([\d,]+ points?\)')  # of one piece; other ones make no other warning

    def __init__(self, say, most=20):
        """most: how many are said; the others are only in the report."""
        self.say, self.most = say, most
        self.seen = {}  # by the sentence without figures: the first sentence, its origin, and the number of tasks

    def add(self, sentence, task):
        """task: a piece or a sum."""
        first = self.seen.setdefault(self.FIGURES.sub('', sentence), [sentence, origin_of(task), 0])
        first[2] += 1
        if first[2] > 1:
            return
        if len(self.seen) <= self.most:
            self.say(f'warning: {first[1]}: {sentence}')
        elif len(self.seen) == self.most + 1:
            self.say('warning: there are further ones; report.md has them all')


def origin_of(task):
    if isinstance(task, plan.Piece):
        return f"drive '{task.drive.name}' from scan {task.first}"
    return 'region {}_{}'.format(*task.region)


def duration(seconds):
    if seconds < 120:
        return f'{seconds:.0f} s'
    return f'{seconds / 60:.0f} min' if seconds < 7200 else f'{seconds / 3600:.1f} h'


class Cost:
    """What a stage has cost in this run."""

    def __init__(self):
        self.tasks = self.made = self.bytes = 0
        self.seconds = self.core_seconds = 0.0

    def add(self, found):
        self.tasks += 1
        self.made += found['made']
        self.bytes += found['bytes'] if found['made'] else 0
        self.seconds += found['seconds']
        self.core_seconds += found['core_seconds']


STAGES = {'bag': 'count clouds of bags', 'map': 'map pieces', 'sum': 'sum regions', 'check': 'check and draw regions'}


def write(folder, index, costs, elapsed, picture, warnings):
    """Writes report.md. picture: the sentence of draw."""
    regions = index['regions']
    total = {name: sum(region['voxels'].get(name, 0) for region in regions) for name in ('occupied', 'free')}
    lines = ['# City', '', f"{len(index['drives'])} drives in {len(regions)} regions; {total['occupied']} occupied and "
             f"{total['free']} free voxels; {megabytes(sum(region['bytes'] for region in regions))} MB.", '']
    if picture is not None:
        lines += [picture or '![The city from above, with the trajectories of the drives](city.png)', '']
    if index['left_out']:
        lines += ['## Drives left out', '', '| drive | reason |', '|---|---|']
        lines += [f'| {cell(name)} | {cell(why)} |' for name, why in index['left_out'].items()] + ['']
    if warnings.seen:
        lines += ['## Warnings of this run', '', '| first where | pieces or regions | warning |', '|---|---|---|']
        lines += [f'| {cell(where)} | {count} | {cell(sentence)} |' for sentence, where, count in warnings.seen.values()] + ['']
    lines += ['## Drives', '', '| drive | pieces | scans |', '|---|---|---|']
    lines += [f"| {cell(drive['name'])} | {len(drive['pieces'])} | {sum(piece['scans'] for piece in drive['pieces'])} |"
              for drive in index['drives']]
    lines += ['', '## Costs', '', f'This run took {elapsed:.1f} s. What was there already cost nothing but a look, except '
              'that every region is checked. Times are those of all workers together.', '',
              '| stage | tasks | made now | core-seconds | seconds | MB written |', '|---|---|---|---|---|---|']
    # The files of regions that are checked were written by the sums.
    lines += [f'| {STAGES[name]} | {cost.tasks} | {cost.made} | {cost.core_seconds:.1f} | {cost.seconds:.1f} | '
              f"{'' if name == 'check' else megabytes(cost.bytes)} |" for name, cost in costs.items()]
    lines += ['', '## Regions', '', '| x | y | pieces | tiles | occupied | free | bytes |', '|---|---|---|---|---|---|---|']
    lines += [f"| {r['x']} | {r['y']} | {r['inputs']} | {r['tiles']} | {r['voxels'].get('occupied', 0)} | "
              f"{r['voxels'].get('free', 0)} | {r['bytes']} |" for r in regions]
    write_whole(folder / 'report.md', '\n'.join(lines) + '\n')


def write_whole(path, text):
    """Replaces a file, or leaves it as it was."""
    own = path.with_name(f'.{path.name}.{os.getpid()}')  # a name that a later run removes
    own.write_text(text)
    os.replace(own, path)


def megabytes(number):
    return f'{number / 1e6:.1f}'


def cell(text):
    return text.replace('|', '\\|').replace('\n', ' ')


def draw(folder, index):
    """Draws city.png: the pictures of the regions and the trajectories of the drives. Returns a sentence if that is not
    possible, or ''."""
    try:
        import matplotlib
        matplotlib.use('Agg')
        from matplotlib import image, pyplot
        import numpy
    except ImportError as error:
        return f'There is no picture of the city ({error}); install python3-matplotlib, and run the same command with --resume.'
    boxes = [(folder / plan.picture_of(region['file']), region['bounds']) for region in index['regions'] if region['bounds']]
    if not boxes:
        return 'There is no picture of the city, which is empty.'
    low = numpy.min([box['min'][:2] for _, box in boxes], axis=0)
    high = numpy.max([box['max'][:2] for _, box in boxes], axis=0)
    pixel = max(*(high - low) / LARGEST, 0.05)  # [m]
    size = numpy.maximum(numpy.ceil((high - low) / pixel).astype(int), 1)
    canvas = numpy.full((size[1], size[0], 3), 255, numpy.uint8)  # rows from below
    for path, box in boxes:
        picture = image.imread(path)[::-1, :, :3]
        begin, end = (((numpy.array(box[side][:2]) - low) / pixel).round().astype(int) for side in ('min', 'max'))
        end = numpy.minimum(numpy.maximum(end, begin + 1), size)
        width, height = end - begin
        rows = numpy.arange(height) * picture.shape[0] // height
        columns = numpy.arange(width) * picture.shape[1] // width
        canvas[begin[1]:end[1], begin[0]:end[0]] = (picture[rows][:, columns] * 255).round()
    figure, axes = pyplot.subplots(figsize=(10, 10 * max(0.3, min(3.0, size[1] / size[0]))), dpi=150)
    axes.imshow(canvas, origin='lower', extent=(low[0], low[0] + size[0] * pixel, low[1], low[1] + size[1] * pixel),
                interpolation='antialiased')
    colors = pyplot.get_cmap('tab20')
    for number, drive in enumerate(index['drives'][:DRAWN]):
        way = way_of(drive, folder)
        if len(way):
            axes.plot(way[:, 0], way[:, 1], color='white', linewidth=1.8)
            axes.plot(way[:, 0], way[:, 1], color=colors(number % 20), linewidth=1.0, label=drive['name'])
            axes.plot(*way[0, :2], 'o', color=colors(number % 20), markersize=3.5, markeredgecolor='white', markeredgewidth=0.5)
    if len(index['drives']) <= NAMED:
        axes.legend(fontsize='x-small', loc='best')
    axes.set_xlabel('x [m]')
    axes.set_ylabel('y [m]')
    axes.set_title(f"{len(index['drives'])} drives; a dot is where a drive begins", fontsize='medium')
    own = folder / '.city.png.json'  # a name that a later run removes
    figure.savefig(own, bbox_inches='tight', format='png')
    pyplot.close(figure)
    own.replace(folder / 'city.png')
    return ''


def way_of(drive, city):
    """Where the sensor was in each scan of a drive of the index, (N, 3), in the frame of the city [m]. city: its folder."""
    import numpy
    try:
        if 'bag' in drive:
            accounts = [json.loads((city / plan.account_of(piece['file'])).read_text()) for piece in drive['pieces']]
            return numpy.array([at for account in accounts for at in account['way']], float).reshape(-1, 3)
        folder = pathlib.Path(drive['sequence'])
        if not (folder / 'velodyne').is_dir():
            heads = [path.open('rb').read(4096).split(b'VIEWPOINT')[1].split()[:3] for path in sorted(folder.glob('pcd/*.pcd'))]
            return numpy.array(heads, float).reshape(-1, 3)
        numbers = sorted(int(path.stem) for path in (folder / 'velodyne').glob('*.bin')
                         if path.stem.isascii() and path.stem.isdigit())
        rows = numpy.loadtxt(drive['poses'], ndmin=2)
        if rows.shape[1] in (4, 8):  # with stamps, of the lidar
            return rows[:, 1:4] if drive.get('poses_in') != 'camera' else numpy.zeros((0, 3))
        poses = rows.reshape(len(rows), -1, 4)[:, :3]
        if drive.get('poses_in') == 'lidar':
            return poses[numbers, :, 3]
        calibration = next(line.split(':')[1].split() for line in (folder / 'calib.txt').read_text().splitlines()
                           if line.startswith('Tr:'))
        camera = numpy.array(calibration, float).reshape(3, 4)
    except (OSError, ValueError, IndexError, StopIteration):
        return numpy.zeros((0, 3))  # the drive is mapped all the same
    # Tr^-1 P Tr (0, 0, 0): the sensor's origin in the frame of the city.
    at = poses[numbers, :, :3] @ camera[:, 3] + poses[numbers, :, 3]
    return (at - camera[:, 3]) @ numpy.linalg.inv(camera[:, :3]).T
