#include "beam_rows_loop.h"

namespace bki_mapping {

void addBeamRowsGeneric(const LocalBeam* beams, std::size_t count, BeamWeight weight, float reach,
                        float* sums) {
  addRows(beams, count, weight, reach, sums);
}

}  // namespace bki_mapping
