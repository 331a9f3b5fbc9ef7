#include "beams/raster/trace_loop.h"
#include "beams/raster/track_loop.h"
#include "points/point_loop.h"
#include "points/tile_loop.h"
#include "simd/inner_loops.h"

namespace bki_mapping {

const InnerLoops& innerLoopsGeneric() {
  static const InnerLoops loops = {"generic",       sumPointsLoop,  makeTracksLoop,  traceBeamsLoop,
                                   placePointsLoop, placeCellsLoop, reachBlocksLoop, LaneKernel::unit()};
  return loops;
}

}  // namespace bki_mapping
