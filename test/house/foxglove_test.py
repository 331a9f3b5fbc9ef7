#!/usr/bin/env python3
"""The layout for Foxglove shows topics that the node publishes, and that Foxglove's 3D panel can draw."""
import json
import os
import re
import unittest

ROOT = os.environ['BKI_MAPPING_SOURCE_DIR']
# Messages of the node that the 3D panel draws (foxglove/studio, packages/studio-base/src/panels/ThreeDeeRender/ros.ts).
DRAWN = {'visualization_msgs/MarkerArray', 'sensor_msgs/PointCloud2', 'nav_msgs/OccupancyGrid', 'nav_msgs/Path'}


def read(path):
    with open(os.path.join(ROOT, path)) as file:
        return file.read()


def published():
    """The types of the topics in docs/ros.md, which are compared there with the node."""
    section = re.search(r'^## Published topics$.*?^## ', read('docs/ros.md'), re.MULTILINE | re.DOTALL)[0]
    rows = re.findall(r'^\| `([~/\w]+)` \| `(\w+/\w+)` \|', section, re.MULTILINE)
    return {name.replace('~', '/mapping/') if name[0] in '~/' else '/' + name: kind for name, kind in rows}


def panels_of(layout):
    return [layout] if isinstance(layout, str) else panels_of(layout['first']) + panels_of(layout['second'])


class Foxglove(unittest.TestCase):
    layout = json.loads(read('config/foxglove/mapping.json'))

    def test_each_panel_has_its_place_and_its_settings(self):
        self.assertEqual(sorted(panels_of(self.layout['layout'])), sorted(self.layout['configById']))

    def test_the_3d_panel_offers_what_it_can_draw_of_the_node(self):
        drawn = {topic for topic, kind in published().items() if kind in DRAWN}
        self.assertGreater(len(drawn), 3)
        self.assertEqual(set(self.layout['configById']['3D!map']['topics']), drawn)

    def test_the_other_panels_show_topics_of_the_node(self):
        panels = self.layout['configById']
        self.assertEqual(published()[panels['RawMessages!status']['topicPath']], 'bki_mapping/MappingStatus')
        self.assertEqual(published()[panels['DiagnosticSummary!all']['topicToRender']], 'diagnostic_msgs/DiagnosticArray')


if __name__ == '__main__':
    unittest.main()
