"""What people read of a city: progress while it is made, and a report."""
import time


class Progress:
    """Says how far a stage is, at most every few seconds, and at its end."""

    def __init__(self, what, count, say, interval=5.0):
        self.what, self.count, self.say, self.interval = what, count, say, interval
        self.done = self.failed = 0
        self.begin = self.said = time.monotonic()

    def step(self, failed=False):
        self.done += 1
        self.failed += failed
        now = time.monotonic()
        if self.done < self.count and now - self.said < self.interval:
            return
        self.said = now
        elapsed = now - self.begin
        rate = self.done / elapsed if elapsed > 0 else 0.0
        rest = '' if self.done == self.count else f', {(self.count - self.done) / rate:.0f} s remain'
        faults = f', {self.failed} failed' if self.failed else ''
        self.say(f'{self.what}: {self.done} of {self.count}{faults}, {rate:.2f} a second{rest}')


def write(folder, index, seconds, elapsed):
    """Writes report.md. seconds: of all workers together, by stage."""
    regions = index['regions']
    total = {name: sum(region['voxels'].get(name, 0) for region in regions) for name in ('occupied', 'free')}
    lines = ['# City', '', f"{len(index['drives'])} drives in {len(regions)} regions; {total['occupied']} occupied and "
             f"{total['free']} free voxels; {sum(region['bytes'] for region in regions) / 1e6:.1f} MB.", '']
    if index['left_out']:
        lines += ['## Drives left out', '', '| drive | reason |', '|---|---|']
        lines += [f'| {cell(name)} | {cell(why)} |' for name, why in index['left_out'].items()] + ['']
    lines += ['## Drives', '', '| drive | pieces | scans |', '|---|---|---|']
    lines += [f"| {cell(drive['name'])} | {len(drive['pieces'])} | {sum(piece['scans'] for piece in drive['pieces'])} |"
              for drive in index['drives']]
    lines += ['', '## Costs', '', f'This run took {elapsed:.1f} s. Time of all workers together:', '', '| stage | seconds |', '|---|---|']
    lines += [f'| {name} | {value:.1f} |' for name, value in seconds.items()]
    lines += ['', '## Regions', '', '| x | y | pieces | tiles | occupied | free | bytes |', '|---|---|---|---|---|---|---|']
    lines += [f"| {r['x']} | {r['y']} | {r['inputs']} | {r['tiles']} | {r['voxels'].get('occupied', 0)} | {r['voxels'].get('free', 0)} | "
              f"{r['bytes']} |" for r in regions]
    (folder / 'report.md').write_text('\n'.join(lines) + '\n')


def cell(text):
    return text.replace('|', '\\|').replace('\n', ' ')
