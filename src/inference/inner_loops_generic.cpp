#include "bki_mapping/inference/inner_loops.h"
#include "point_loop.h"
#include "tile_loop.h"
#include "trace_loop.h"
#include "track_loop.h"

namespace bki_mapping {

const InnerLoops& innerLoopsGeneric() {
  static const InnerLoops loops = {"generic",       sumPointsLoop,  makeTracksLoop,  traceBeamsLoop,
                                   placePointsLoop, placeCellsLoop, reachBlocksLoop, LaneKernel::unit()};
  return loops;
}

}  // namespace bki_mapping
