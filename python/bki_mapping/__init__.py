"""Semantic 3D occupancy mapping from labelled lidar scans: maps that are built, asked, kept and merged in Python.

    import bki_mapping
    mapper = bki_mapping.SemanticMapper(classes='semantic_kitti', resolution=0.3, config='robot')
    mapper.integrate(origin, points, labels)
    states = mapper.map.states(points)

Lengths are in metres, times of scans in nanoseconds, coordinates in the map frame unless a text says otherwise. docs/python.md
explains more. ROS is not needed; where the package was built with ROS, bki_mapping.msg and bki_mapping.srv hold its messages.
"""
import importlib

__all__ = ['EVIDENCE_UNIT', 'FREE', 'FREE_CLASS', 'OCCLUDED', 'OCCUPIED', 'RAY_NOTHING', 'RAY_OCCUPIED', 'RAY_UNKNOWN', 'UNKNOWN', 'Block',
           'City', 'ClassFilter', 'ClassTable', 'DistanceField', 'Drive', 'Frame', 'Map', 'MapFileError', 'ScanRefused', 'ScanStats', 'Section',
           'SemanticClass', 'SemanticMapper', 'Sequence', 'correct', 'forget_journal', 'load', 'merge', 'open_city']


# Loaded when first used: nodes that import only messages need neither the library nor NumPy.
def __getattr__(name):
    if name not in __all__:
        raise AttributeError(f"module 'bki_mapping' has no attribute '{name}'")
    try:
        core = importlib.import_module('bki_mapping._core')
    except ModuleNotFoundError as error:
        if error.name != 'bki_mapping._core':
            raise
        raise ImportError('bki_mapping was built without its Python module; install pybind11-dev, and build it again') from None
    globals().update({each: getattr(core, each) for each in __all__})
    return globals()[name]


def __dir__():
    return sorted({*globals(), *__all__})
